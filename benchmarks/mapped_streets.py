"""Holds the streets of `build --osm` against their maps.

    python benchmarks/mapped_streets.py [--judge PROGRAM] EXTRACT [EXTRACT ...]

The map's ways are read from the extract by libosmium alone. At least 95 % of their length has to
lie within 4 m of a reference line of the road file, each way that tells its lanes has as many at
its middle, and the file is read without an error. The judge is the program ``lanes`` of
libOpenDRIVE (also $ENVGEN_LIBOPENDRIVE): it has to mesh every lane. Exit code 1 if any fails.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import osmium
import shapely
from pyproj import CRS, Transformer
from scipy.spatial import KDTree

from envgen_usd.errors import Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate
from envgen_usd.opendrive.reader import read_network
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.mapped_place import read_mapped_place
from envgen_usd.step_clock import Clock

STREETS = frozenset(
    {"unclassified", "residential", "living_street", "road"}.union(
        f"{name}{end}"
        for name in ("motorway", "trunk", "primary", "secondary", "tertiary")
        for end in ("", "_link")
    )
)
"""Values of ``highway`` for motor vehicles; service ways and tracks are none."""
DRIVEN = frozenset({"driving", "bidirectional", "bus", "taxi", "hov", "entry", "exit"})
"""Types of lanes that the tag ``lanes`` counts."""
NEAR = 4.0
"""Farthest a way lies from its reference line, metres."""
SHARE = 0.95
"""Least share of the length of the ways in the file."""
ALIKE = 0.9
"""Least cosine between a way and its reference line."""
STEP = 1.0
MOST_LANES = 12


@dataclass
class Held:
    """What the comparison shows.

    Attributes:
        length: Length of the map's ways, metres.
        share: Share of it in the road file.
        tagged: Ways outside junctions that tell their lanes.
        other: Ids of those with another number of lanes.
        roads: Number of roads outside junctions.
        junctions: Number of junctions.
        errors: Errors of the road file as it is read.
        warnings: Its other issues.
        seconds: CPU seconds from the extract to the road file.
        unread: What the judge could not mesh; `None` without a judge.
    """

    length: float = 0.0
    share: float = 0.0
    tagged: int = 0
    other: list[int] = field(default_factory=list)
    roads: int = 0
    junctions: int = 0
    errors: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    seconds: float = 0.0
    unread: int | None = None

    def __bool__(self) -> bool:
        """True if the road file departs from the map."""
        return self.share < SHARE or bool(self.other) or bool(self.errors) or bool(self.unread)


@dataclass(frozen=True)
class Reference:
    """Points of all reference lines, N of them: tree, road ids, positions, headings."""

    tree: KDTree
    road: list[str]
    s: FloatArray
    heading: FloatArray

    @staticmethod
    def of(network: RoadNetwork, *, junctions: bool) -> "Reference":
        """Samples the roads of a network each metre, with or without those in junctions."""
        lines, roads, places = [], [], []
        for road in network.roads.values():
            if road.junction and not junctions:
                continue
            s = np.linspace(0.0, road.length, int(np.ceil(road.length / STEP)) + 1)
            lines.append(np.stack(evaluate(road.plan_view, s), axis=1))
            places.append(s)
            roads += [road.id] * len(s)
        points = np.concatenate(lines)
        return Reference(KDTree(points[:, :2]), roads, np.concatenate(places), points[:, 2])

    def along(self, place: FloatArray, heading: float) -> int | None:
        """The nearest point on a line that runs as told, either way; another may cross there."""
        near = np.array(self.tree.query_ball_point(place, NEAR), int)
        near = near[np.abs(np.cos(self.heading[near] - heading)) > ALIKE]
        away = np.linalg.norm(self.tree.data[near] - place, axis=1)
        return int(near[away.argmin()]) if len(near) else None


def map_ways(extract: Path, crs: str) -> list[tuple[int, str | None, FloatArray]]:
    """Ways for motor vehicles: id, the tag ``lanes``, points in a reference system."""
    move, found = Transformer.from_crs(4326, crs, always_xy=True).transform, []
    for way in osmium.FileProcessor(str(extract)).with_locations():
        if not isinstance(way, osmium.osm.Way) or way.tags.get("highway") not in STREETS:
            continue
        places = [(n.lon, n.lat) for n in way.nodes if n.location.valid()]
        if way.tags.get("area") != "yes" and len(places) > 1:
            points = np.column_stack(move(*np.array(places).T))
            found.append((way.id, way.tags.get("lanes"), points))
    return found


def driven_lanes(road: Road, s: float) -> int:
    """Lanes for vehicles with a width at a position of a road."""
    section = [each for each in road.sections if each.s <= s][-1]
    lanes = [lane for lane in (*section.left, *section.right) if lane.type in DRIVEN]
    return sum(float(lane.width(np.array([s - section.s]))[0]) > 1.0 for lane in lanes)


def hold(extract: Path, judge: str) -> Held:
    """Compares the road file of an extract with its map."""
    held, start = Held(), time.process_time()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        options = BuildOptions(
            folder / "none.xodr", "1", "residential", folder, osm=extract, max_area=1e4
        )
        place = read_mapped_place(options, Clock(lambda *_: None))
        file = place.write_road(folder)
        held.seconds = time.process_time() - start
        network = read_network(file)
        for issue in network.issues:
            told = held.errors if issue.severity is Severity.ERROR else held.warnings
            told.append(f"{issue.kind} {issue.where}: {issue.message}")
        if judge:
            command = [judge, str(file), "0.05"]
            read = subprocess.run(command, check=False, capture_output=True, text=True)
            held.unread = read.stdout.count("EXC") + (read.returncode != 0)
    held.roads = sum(not road.junction for road in network.roads.values())
    held.junctions = len(network.junctions)
    _hold_ways(held, network, extract)
    return held


def _hold_ways(held: Held, network: RoadNetwork, extract: Path) -> None:
    """Compares reference lines and lanes with the map's ways."""
    crs = CRS.from_user_input(network.geo_reference).to_wkt()
    every, apart = (Reference.of(network, junctions=each) for each in (True, False))
    inside = 0.0
    for number, lanes, points in map_ways(extract, crs):
        line = shapely.LineString(points)
        along = np.arange(0.5 * STEP, max(line.length, STEP), STEP)
        spots = shapely.get_coordinates(shapely.line_interpolate_point(line, along))
        away, _ = every.tree.query(spots)
        held.length += line.length
        inside += line.length * float(np.mean(away <= NEAR))
        before, after = shapely.line_interpolate_point(line, [0.49, 0.51], normalized=True)
        run = np.array([after.x - before.x, after.y - before.y])
        middle = np.array([after.x + before.x, after.y + before.y]) / 2
        nearest = apart.along(middle, float(np.arctan2(run[1], run[0])))
        if nearest is None or not lanes or not lanes.isdigit() or int(lanes) > MOST_LANES:
            continue
        held.tagged += 1
        road = network.roads[apart.road[nearest]]
        if driven_lanes(road, float(apart.s[nearest])) != int(lanes):
            held.other.append(number)
    held.share = inside / held.length


def main() -> int:
    """Prints what each extract shows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("extracts", nargs="+", type=Path)
    parser.add_argument("--judge", default=os.environ.get("ENVGEN_LIBOPENDRIVE", ""))
    given, faults = parser.parse_args(), 0
    for extract in given.extracts:
        held = hold(extract, given.judge)
        print(f"{extract.name}: {held}", flush=True)
        faults += bool(held)
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())

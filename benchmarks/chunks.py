"""Times one chunk of ever larger maps, and what a worker process reads before its first chunk.

    python benchmarks/chunks.py --roads 25 100 400 1600

The maps are squares of streets with sidewalks, markings, crosswalks and signs; the chunk in their
middle holds the same on each of them, so that it must take the same time. Times are CPU seconds of
one process, the least of several runs in turn. The surface of 1600 roads takes a minute to build.
"""

import argparse
import math
import pickle
import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.chunks import CHUNK_SIZE, Chunk, chunks_of_points
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.plot_index import PlotIndex
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import Plot
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.chunk_products import ChunkInputs, ChunkMaps, build_chunk
from envgen_usd.recipe.map_land import read_road
from envgen_usd.terrain.heightmaps import build_heightmaps

COUNTRY, AREA = "1", "residential"
MIDDLE = Chunk(0, 0)
LAND = 5
"""Roads along each side of the map whose landuse all chunks get."""
MARK = '<roadMark sOffset="0" type="{}" color="standard" width="0.12"/>'
LANES = ((2, "sidewalk", 2.0), (1, "driving", 3.5), (-1, "driving", 3.5), (-2, "sidewalk", 2.0))


def read_streets(side: int, folder: Path) -> RoadSurface:
    """The surface of as many streets as roads in each, around the middle."""
    places = range(-(side // 2), side - side // 2)
    roads = "".join(road(column, row, places) for row in places for column in places)
    path = folder / f"{side}.xodr"
    path.write_text(
        f'<OpenDRIVE><header revMajor="1" revMinor="7"/>{roads}</OpenDRIVE>', encoding="utf-8"
    )
    return read_road(path, 0.02)[1]


def road(column: int, row: int, places: range) -> str:
    ends = (("predecessor", column - 1, "end"), ("successor", column + 1, "start"))
    ends = tuple(end for end in ends if end[1] in places)
    links = "".join(
        f'<{role} elementType="road" elementId="{beside}_{row}" contactPoint="{point}"/>'
        for role, beside, point in ends
    )
    link = "".join(f'<{role} id="{{0}}"/>' for role, _, _ in ends)
    lanes = {
        number: f'<lane id="{number}" type="{kind}"><link>{link.format(number)}</link>'
        f'<width sOffset="0" a="{width}" b="0" c="0" d="0"/>{MARK.format("solid")}</lane>'
        for number, kind, width in LANES
    }
    corners = "".join(
        f'<cornerRoad s="{s}" t="{t}" dz="0" height="0"/>'
        for s, t in ((88.5, -3.4), (91.5, -3.4), (91.5, 3.4), (88.5, 3.4))
    )
    return (
        f'<road id="{column}_{row}" length="{CHUNK_SIZE}" junction="-1"><link>{links}</link>'
        '<type s="0" type="town"/><planView>'
        f'<geometry s="0" x="{CHUNK_SIZE * column - 30}" y="{CHUNK_SIZE * row + 100}" hdg="0" '
        f'length="{CHUNK_SIZE}"><line/></geometry></planView><lanes><laneSection s="0">'
        f"<left>{lanes[2]}{lanes[1]}</left>"
        f'<center><lane id="0" type="none">{MARK.format("broken")}</lane></center>'
        f"<right>{lanes[-1]}{lanes[-2]}</right></laneSection></lanes>"
        f'<objects><object id="walk_{column}_{row}" type="crosswalk" s="90" t="0" zOffset="0" '
        f'orientation="none"><outline>{corners}</outline></object></objects>'
        f'<signals><signal id="sign_{column}_{row}" s="80" t="-6" zOffset="2" orientation="+" '
        'dynamic="no" type="274" country="DE"/></signals></road>'
    )


def middle_land(surface: RoadSurface, profile: Profile) -> ChunkMaps:
    """What lies in the chunk in the middle, and the plots around."""
    chunks = chunks_of_points(surface.vertices, land_beside(profile))
    landuse = RuleProvider().generate(surface, chunks, profile, 0)
    plots = find_plots(landuse, surface)
    around = tuple(MIDDLE.neighbours())
    heights = build_heightmaps(surface, [MIDDLE, *around], profile.terrain, 0, None, plots)
    neighbours = tuple(heights[chunk] for chunk in around)
    return ChunkMaps(landuse[MIDDLE], heights[MIDDLE], neighbours, plots)


def spread(plots: tuple[Plot, ...], side: int) -> PlotIndex:
    """The plots of the middle in every chunk of a map."""
    near = PlotIndex(plots).touching(MIDDLE)
    places = range(-(side // 2), side - side // 2)
    moved = []
    for x, y in ((x, y) for x in places for y in places if max(abs(x), abs(y)) > 1):
        by = np.array([x, y]) * CHUNK_SIZE
        moved += [replace(p, id=f"{p.id}_{x}_{y}", polygon=p.polygon + by) for p in near]
    return PlotIndex([*near, *moved])


@dataclass
class Measured:
    """A map and its times.

    Attributes:
        triangles: Of its road surface.
        inputs: What a worker process reads, pickled.
        maps: What the chunk in the middle is built from.
        indexing: Seconds that the main process takes for the index.
        reading: Seconds of each run to read the inputs.
        building: Seconds of each run to build the chunk.
    """

    triangles: int
    inputs: bytes
    maps: ChunkMaps
    indexing: float
    reading: list[float] = field(default_factory=list)
    building: list[float] = field(default_factory=list)

    def run(self) -> None:
        """Builds the chunk as the first of a new process."""
        times = [time.process_time()]
        inputs = pickle.loads(self.inputs)
        times.append(time.process_time())
        build_chunk(inputs, self.maps, "")
        times.append(time.process_time())
        reading, building = np.diff(times).tolist()
        self.reading.append(reading)
        self.building.append(building)


def prepared(count: int, land: ChunkMaps, profile: Profile, folder: Path) -> Measured:
    """A map with so many roads."""
    side = math.isqrt(count)
    surface = read_streets(side, folder)
    plots = spread(land.plots, side)
    start = time.process_time()
    options = BuildOptions(Path(), COUNTRY, AREA, folder)
    inputs = ChunkInputs.of(folder, surface, profile, read_catalogue(), options)
    indexing = time.process_time() - start
    maps = replace(land, plots=plots.touching(MIDDLE))
    pickled = pickle.dumps(inputs, pickle.HIGHEST_PROTOCOL)
    return Measured(len(surface.triangles), pickled, maps, indexing)


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--roads", type=int, nargs="+", default=[25, 100, 400, 1600])
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    profile = read_profile(COUNTRY, AREA)
    with tempfile.TemporaryDirectory() as folder:
        land = middle_land(read_streets(LAND, Path(folder)), profile)
        maps = {count: prepared(count, land, profile, Path(folder)) for count in options.roads}
        maps[options.roads[0]].run()  # The first chunk of a process reads the asset library.
        maps[options.roads[0]].building.clear()
        # In turn, as what else the machine does comes and goes.
        for _ in range(options.runs):
            for made in maps.values():
                made.run()
    print("roads  triangles  index s  read s  read MB  chunk s  ratio")
    first = min(maps[options.roads[0]].building)
    for count, made in maps.items():
        print(
            f"{count:5}  {made.triangles:9,}  {made.indexing:7.2f}  {min(made.reading):6.2f}"
            f"  {len(made.inputs) / 1e6:7.1f}  {min(made.building):7.2f}"
            f"  {min(made.building) / first:5.2f}"
        )


if __name__ == "__main__":
    main()

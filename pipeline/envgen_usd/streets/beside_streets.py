"""What a map has beside streets, as objects and signs of the roads on whose sidewalks it stands."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from lxml import etree

from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.street_plan import StreetPlan, StreetPoint
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.mapped_furniture import holder
from envgen_usd.streets.street_sections import StreetSection, value_of

OBJECTS: Mapping[str, tuple[str, str]] = {
    "tree": ("tree", "tree"),
    "lamp": ("pole", "streetlight"),
    "bench": ("obstacle", "bench"),
    "bin": ("obstacle", "bin"),
    "bollard": ("obstacle", "bollard"),
    "hydrant": ("obstacle", "hydrant"),
}
"""Type and name of the object of each kind of point that OpenDRIVE knows."""
BESIDE = frozenset(
    {*OBJECTS, "mailbox", "phone_box", "bicycle_rack", "fountain", "monument", "crane"}
)
"""Kinds of points that stand beside streets."""
_FARTHEST = 25.0
"""Farthest road of a point from its reference line, metres."""
_SIGN = 8.0
"""Farthest sign from the border of its road, metres."""
_FREE = 0.3
"""Least distance of an object from the carriageway, metres."""
_OFF = 0.5
"""Largest distance of an object from where s and t put it, metres; past ends they cannot."""
_POST = 0.4
"""Distance of a sign from the border of the carriageway, metres."""

Road = tuple[RoundedLine, Sequence[StreetSection], etree._Element]


@dataclass(frozen=True)
class Placed:
    """What became of points beside streets.

    Attributes:
        placed: Number of objects and signs of roads, of each kind.
        land: Points that stand beyond the roads' borders, on the land.
        on_road: Number of points on a carriageway.
        no_street: Number of signs without a street near.
    """

    placed: Mapping[str, int]
    land: tuple[StreetPoint, ...]
    on_road: int
    no_street: int

    def issues(self, plan: StreetPlan) -> Iterator[Issue]:
        """Issues that count what is left out."""
        for count, what in (
            (self.on_road, "trees, lamps and pieces of furniture stand on a carriageway"),
            (self.no_street, f"traffic signs stand more than {_SIGN:g} m from a street"),
        ):
            if count:
                yield Issue("osm.point", Severity.INFO, plan.source, f"{count} {what}", "left out")


@dataclass(frozen=True)
class _Site:
    """A point beside a road: s and t, and its distance from carriageway and outer border."""

    s: float
    t: float
    from_kerb: float
    from_border: float


def add_beside(points: Sequence[StreetPoint], roads: Sequence[Road]) -> Placed:
    """Adds objects and signs to the roads on whose sidewalks points lie.

    Args:
        points: Points of the kinds of `BESIDE`, and signs.
        roads: Reference line, lane sections and element of each road; elements get objects.
    """
    placed: Counter[str] = Counter()
    land: list[StreetPoint] = []
    on_road = no_street = 0
    lines = [
        shapely.LineString(line(np.linspace(0.0, line.length, max(int(line.length), 2)))[0])
        for line, _, _ in roads
    ]
    tree = shapely.STRtree(lines)
    for number, point in enumerate(points):
        spot = shapely.Point(point.place)
        near = tree.query(spot, predicate="dwithin", distance=_FARTHEST).tolist()
        found = [(n, _site(point, lines[n], roads[n])) for n in near]
        sites = [(site.from_kerb, n, site) for n, site in found if site is not None]
        if point.kind == "sign":
            fits = [site for site in sites if site[2].from_border < _SIGN]
            no_street += not fits
            if fits:
                _, n, site = min(fits, key=lambda each: each[0])
                _add_sign(roads[n], point, site, f"map_sign_{number}")
                placed["signs_of_map"] += 1
        elif any(site.from_kerb < _FREE for _, _, site in sites):
            on_road += 1
        elif own := [each for each in sites if point.kind in OBJECTS and each[2].from_border <= 0]:
            _, n, site = min(own, key=lambda each: each[0])
            holding, name = holder(roads[n][2], "objects"), f"{point.kind}_{number}"
            elements.add_standing(holding, name, OBJECTS[point.kind], (site.s, site.t))
            placed[f"{point.kind}s" if point.kind != "bench" else "benches"] += 1
        else:
            land.append(point)
    return Placed(placed, tuple(land), on_road, no_street)


def _add_sign(road: Road, point: StreetPoint, site: _Site, name: str) -> None:
    """A sign at the right-hand side of the traffic that it faces."""
    edge = abs(site.t) - site.from_kerb
    along = point.along or (1 if site.t <= 0.0 else -1)
    # A node of the street's line says nothing of the side.
    t = site.t if site.from_kerb > _FREE else -along * (edge + _POST)
    country, _, code = point.code.partition(":")
    orientation = "+" if along > 0 else "-"
    elements.add_signal(
        holder(road[2], "signals"), name, code, site.s, t, orientation, country=country
    )


def _site(point: StreetPoint, line: shapely.LineString, road: Road) -> _Site | None:
    """Where a point lies beside a road; `None` past an end."""
    curve, sections, _ = road
    s = shapely.line_locate_point(line, shapely.Point(point.place)) * curve.length / line.length
    places, headings = curve(np.array([s]))
    normal = np.array([-np.sin(headings[0]), np.cos(headings[0])])
    t = float((point.place - places[0]) @ normal)
    if np.hypot(*(places[0] + t * normal - point.place)) > _OFF:
        return None
    section = next(x for x in reversed(sections) if x.start <= s + 1e-9)
    at = s - section.start
    lanes = section.left if t > 0.0 else section.right
    widths = [(lane.lane.kind, value_of(lane.width, at)) for lane in lanes]
    wide = sum(width for kind, width in widths if kind != "sidewalk")
    offset = value_of(section.offset, at) * (1.0 if t > 0.0 else -1.0)
    border = sum(width for _, width in widths) + offset
    return _Site(float(s), t, abs(t) - wide - offset, abs(t) - border)

"""Trees, lamps and benches of a map as objects of the roads beside them."""

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

BESIDE: Mapping[str, tuple[str, str]] = {
    "tree": ("tree", "tree"),
    "lamp": ("pole", "streetlight"),
    "bench": ("obstacle", "bench"),
}
"""Type and name of the object of each kind of point."""
_FARTHEST = 25.0
"""Farthest object from the middle of its street, metres: its height is that of the street."""
_FREE = 0.3
"""Least distance of an object from the carriageway, metres."""
_OFF = 0.5
"""Largest distance of an object from where s and t put it, metres; past ends they cannot."""

Road = tuple[RoundedLine, Sequence[StreetSection], etree._Element]


@dataclass(frozen=True)
class Placed:
    """What became of points beside streets.

    Attributes:
        placed: Number of objects of each kind.
        far: Number of points without a street near.
        on_road: Number of points on a carriageway.
    """

    placed: Mapping[str, int]
    far: int
    on_road: int

    def issues(self, plan: StreetPlan) -> Iterator[Issue]:
        """Issues that count what is left out."""
        for count, what in (
            (self.far, f"lie more than {_FARTHEST:g} m from a street, or past its end"),
            (self.on_road, "lie on a carriageway"),
        ):
            if count:
                text = f"{count} trees, lamps and benches {what}"
                yield Issue("osm.point", Severity.INFO, plan.source, text, "left out")


def add_beside(points: Sequence[StreetPoint], roads: Sequence[Road]) -> Placed:
    """Adds objects to the road nearest to each point.

    Args:
        points: Points of the kinds of `BESIDE`.
        roads: Reference line, lane sections and element of each road; elements get objects.
    """
    placed: Counter[str] = Counter()
    far = on_road = 0
    lines = [
        shapely.LineString(line(np.linspace(0.0, line.length, max(int(line.length), 2)))[0])
        for line, _, _ in roads
    ]
    tree = shapely.STRtree(lines)
    for number, point in enumerate(points):
        spot = shapely.Point(point.place)
        near = tree.query(spot, predicate="dwithin", distance=_FARTHEST).tolist()
        sites = [_site(point, lines[n], roads[n]) for n in near]
        if any(site is not None and site[2] < _FREE for site in sites):
            on_road += 1
            continue
        fits = [(site[2], n, site) for n, site in zip(near, sites, strict=True) if site]
        if not fits:
            far += 1
            continue
        _, n, (s, t, _) = min(fits)
        element = roads[n][2]
        name = f"{point.kind}_{number}"
        elements.add_standing(holder(element, "objects"), name, BESIDE[point.kind], (s, t))
        placed[f"{point.kind}s" if point.kind != "bench" else "benches"] += 1
    return Placed(placed, far, on_road)


def _site(
    point: StreetPoint, line: shapely.LineString, road: Road
) -> tuple[float, float, float] | None:
    """Distances s and t of a point, and its distance from the carriageway; `None` past an end."""
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
    wide = sum(value_of(lane.width, at) for lane in lanes if lane.lane.kind not in {"sidewalk"})
    offset = value_of(section.offset, at)
    edge = offset + wide if t > 0.0 else wide - offset
    return float(s), t, abs(t) - edge

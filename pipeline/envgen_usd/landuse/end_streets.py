"""Streets behind the ends of roads: they lead between houses to a street across.

Road files end somewhere, but towns go on: at the end of a street a camera sees houses.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.blocks.laid_plot import way_into
from envgen_usd.landuse.land_layout import LandLayout, Shapes
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.plot_sites import NARROWEST
from envgen_usd.landuse.road_stubs import LENGTH, ONTO, RoadEnd, way_on
from envgen_usd.landuse.site_fitting import TOUCH, clear_of_roads
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.distribution import drawn, mean_of
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.land_rules import PlotRules
from envgen_usd.models.road_surface import LaneLine, RoadSurface
from envgen_usd.seeds import generator

ACROSS = 7.0
"""Width of the carriageway of a street across, metres."""
WALK = 2.0
"""Width of its sidewalks, metres."""
_CARRIAGEWAY = frozenset({"driving", "bidirectional", "stop", "parking", "shoulder", "border"})
"""Lane types between the kerbs."""
_AT_END = 3.0
"""Largest distance of a lane's end from that of its road, along it, metres."""
_FIRST = 1.0
"""Distance of the first plot from the end of the road, metres."""
_VIEW = 3.0
"""Distance from the road's middle line within which a house closes the view, metres."""
_NONE = np.empty((0, 4, 2))


@dataclass(frozen=True)
class EndLand:
    """What lies behind the end of a road; each an array of polygons, metres.

    Attributes:
        plots: Plots for houses.
        driveways: Paved ways into them.
        ways: The way that goes on, and the street across.
        walks: Sidewalks along them.
    """

    plots: Shapes
    driveways: Shapes
    ways: Shapes
    walks: Shapes


@dataclass(frozen=True)
class _Street:
    """Rectangles behind the end of a road, each N x 4 x 2.

    Attributes:
        plots: Plots, counter-clockwise from the first point of the front.
        driveways: Ways into the plots.
        ways: The way that goes on, and the street across.
        walks: Sidewalks.
        closing: N, true for plots whose house closes the view along the road.
    """

    plots: FloatArray
    driveways: FloatArray
    ways: FloatArray
    walks: FloatArray
    closing: BoolArray


def land_behind_ends(
    ends: Sequence[RoadEnd], surface: RoadSurface, layout: LandLayout, profile: Profile, seed: int
) -> Iterator[EndLand]:
    """What lies behind each end: a street, at a share of `BlockRules.ends`, or else a way.

    No street is laid into a block, where the map does not reach far enough, or where another road,
    other plots or the street of an earlier end lie in its way. Of its plots those that do not fit
    are left out, and the whole street if no house would close the view.

    Args:
        ends: All ends of roads of the surface, in their order.
        surface: The whole road.
        layout: Plots and lanes beside the road.
        profile: The environment.
        seed: The user's seed.
    """
    ground = _Ground(ends, surface, layout, profile.plots.verge[0])
    lanes: dict[str, list[LaneLine]] = {}
    for lane in surface.lanes:
        if lane.lane_type in _CARRIAGEWAY:
            lanes.setdefault(lane.road, []).append(lane)
    for end in ends:
        kerbs = _kerbs(end, lanes.get(end.road, []))
        street = _drawn_street(end, kerbs, profile, seed)
        found = ground.fitted(end, street) if street is not None else None
        boxes = (_NONE, _NONE, way_on(end)[None], _NONE)
        if found is not None:
            boxes = (found.plots, found.driveways, found.ways, found.walks)
        yield EndLand(*(shapely.polygons(part) for part in boxes))


class _Ground:
    """Land that is free for streets; each street takes its part of it."""

    def __init__(
        self, ends: Sequence[RoadEnd], surface: RoadSurface, layout: LandLayout, verge: float
    ) -> None:
        self._outline, self._surface, self._verge = Outline.of(surface), surface, verge
        loops = [loop[:, :2] for loop in surface.outline_loops() if len(loop) > 2]
        rings = np.array([shapely.linearrings(loop) for loop in loops], object)
        blocks = shapely.make_valid(shapely.polygons(rings[~shapely.is_ccw(rings)]))
        self._taken = shapely.STRtree([*layout.plots, *blocks])
        onward = [shapely.Polygon(way_on(end)) for end in ends]
        self._paved = shapely.STRtree([*layout.lanes, *onward])
        self._claims: list[shapely.Geometry] = []

    def fitted(self, end: RoadEnd, street: _Street) -> _Street | None:
        """The part of a street that is free; `None` where no street is left."""
        shapes = shapely.polygons(street.plots)
        claim = shapely.convex_hull(shapely.multipolygons(shapes))
        if shapely.intersects(claim, self._claims).any():
            return None
        # Whether other plots leave it room does not count: a part of a map knows only those near.
        self._claims.append(claim)
        ways = street.ways.copy()
        ways[0, [0, 3]] += (ONTO + self._verge) * end.out  # it touches its own road
        free = self._are_free(street.plots)
        free[self._paved.query(shapely.buffer(shapes, -TOUCH), "intersects")[0]] = False
        if not self._are_free(ways).all() or not free[street.closing].any():
            return None
        return replace(street, plots=street.plots[free], driveways=street.driveways[free])

    def _are_free(self, boxes: FloatArray) -> BoolArray:
        shapes = shapely.polygons(boxes)
        free = clear_of_roads(shapes, self._outline, self._surface, self._verge)
        free[self._taken.query(shapely.buffer(shapes, -TOUCH), "intersects")[0]] = False
        return free


def _drawn_street(
    end: RoadEnd, kerbs: tuple[float, float], profile: Profile, seed: int
) -> _Street | None:
    """A street behind the end of a road before any check for space; `None` for no street."""
    rules = profile.plots
    draw = generator(seed, "landuse", "end", f"{end.middle[0]:.0f} {end.middle[1]:.0f}")
    verge, depths = drawn(draw, rules.verge), drawn(draw, rules.depth, 2)
    front = LENGTH + ACROSS + WALK + verge
    if draw.uniform() >= profile.blocks.ends or front + depths[0] > land_beside(profile):
        return None
    side = end.width / 2.0 + verge
    reach = side + depths[1]
    behind = _borders(-reach, reach, rules, draw)
    beside = [_borders(_FIRST, LENGTH - WALK - verge, rules, draw) for _ in range(2)]
    plots = [
        # Rectangles begin at their near right corner; a plot begins with its front.
        *(np.roll(end.box(front, front + depths[0], *v), 1, axis=0) for v in behind),
        *(np.roll(end.box(*u, -reach, -side), 2, axis=0) for u in beside[0]),
        *(end.box(*u, side, reach) for u in beside[1]),
    ]
    closing = [first < _VIEW and last > -_VIEW for first, last in behind]
    return _Street(
        np.array(plots).reshape(-1, 4, 2),
        np.array([way_into(plot[:2], verge) for plot in plots]).reshape(-1, 4, 2),
        *_paving(end, kerbs, reach),
        np.pad(np.array(closing, np.bool_), (0, len(plots) - len(closing))),
    )


def _paving(
    end: RoadEnd, kerbs: tuple[float, float], reach: float
) -> tuple[FloatArray, FloatArray]:
    """Ways and sidewalks, 2 x 4 x 2 and 5 x 4 x 2; the street across has a reach to each side."""
    (right, left), half = kerbs, end.width / 2.0
    near, far = LENGTH, LENGTH + ACROSS
    walks = [
        end.box(0.0, near, -half, right),
        end.box(0.0, near, left, half),
        end.box(near - WALK, near, -reach, -half),
        end.box(near - WALK, near, half, reach),
        end.box(far, far + WALK, -reach, reach),
    ]
    ways = [end.box(-ONTO, far, right, left), end.box(near, far, -reach, reach)]
    return np.array(ways), np.array(walks)


def _borders(
    first: float, last: float, rules: PlotRules, draw: np.random.Generator
) -> list[tuple[float, float]]:
    """Neighbouring fronts that fill a length, metres; none where it is too short for one."""
    if last - first < NARROWEST * rules.frontage[0]:
        return []
    count = max(1, round((last - first) / mean_of(rules.frontage)))
    widths = drawn(draw, rules.frontage, count)
    stops = first + (last - first) * np.append(0.0, np.cumsum(widths)) / widths.sum()
    return list(pairwise(stops.tolist()))


def _kerbs(end: RoadEnd, lanes: Sequence[LaneLine]) -> tuple[float, float]:
    """Offsets of both kerbs at the end of a road to the left of its middle, metres.

    Args:
        end: The end.
        lanes: Lanes of its road between the kerbs.
    """
    aside, low, high = np.array([-end.out[1], end.out[0]]), np.inf, -np.inf
    for lane in lanes:
        for place in (0, -1):
            offset = lane.points[place, :2] - end.middle
            if abs(offset @ end.out) < _AT_END:
                half = float(lane.width[place]) / 2.0
                low, high = min(low, offset @ aside - half), max(high, offset @ aside + half)
    half = end.width / 2.0
    if low > high:
        return -half, half
    return max(float(low), -half), min(float(high), half)

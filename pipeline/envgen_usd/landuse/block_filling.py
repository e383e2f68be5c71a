"""Fills the land between streets: plots back to back, plots at corners and in gaps of the front.

Blocks are the faces that roads enclose. Outside of them only a strip along the streets is filled.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.chunks import GRID
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.landuse.roadside import Roadside
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.distribution import mean_of
from envgen_usd.models.environment_profile import PlotRules
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.seeds import generator

LEAST_HALF = 0.5
"""Least depth of a plot in a shallow block, as a share of the rules' least depth.

A larger value leaves one side of more blocks empty.
"""
RAYS = (0.1, 0.5, 0.9)
"""Shares of a front at which the depth of its block is measured."""
NARROW = 5.0
"""Width in metres below which land becomes no plot; a larger value leaves more gaps open."""
WIDEST = 2
"""Largest number of mean fronts in a gap that becomes a single plot; wider gaps are divided."""
LEAST_AREA = 0.5
"""Least area of a plot in a gap, as a share of the rules' smallest plot."""
COMPACT = 0.75
"""Least area of a plot in a gap, as a share of the rectangle around it."""
MOST_AREA = 1.5
"""Largest area of a plot in a gap, as a share of the rules' largest plot; other land stays open."""
DEEPER = (1.1, 1.2, 1.3, 1.45, 1.6, 1.8, 2.0, 2.3)
"""Tried depths of plots with land behind them, in depths that they had without it."""
DEEPEST = 1.5
"""Largest depth of a plot with the land behind it, in greatest depths of the rules.

A larger value leaves less land in the middle of deep blocks.
"""
JOINT = 0.05
"""Overlap of plots that only touch, metres; a larger value lets them grow into one another."""
WAY = 2.5
"""Width of the paved way into a plot of a gap, metres."""
STREET = 1.5
"""Largest distance of a plot's side from the edge of the verge, metres, to face the street."""


@dataclass(frozen=True)
class Filled:
    """Plots with the land that they were given.

    Attributes:
        shapes: P polygons; first those of the sites, in their order.
        ways: Q x 4 x 2, paved ways into the plots that have no site.
    """

    shapes: NDArray[np.object_]
    ways: FloatArray

    @staticmethod
    def of(sites: Sites) -> "Filled":
        """Sites alone."""
        return Filled(np.array(shapely.polygons(sites.polygons()), object), np.empty((0, 4, 2)))


def shared_depths(sites: Sites, outline: Outline, rules: PlotRules) -> Sites:
    """Limits the depths of plots to half of their block, so that rows lie back to back.

    Blocks that are too shallow for two rows, and rules with several rows, keep the drawn depths.

    Args:
        sites: Candidate sites.
        outline: Outline of the road.
        rules: Sizes of plots.
    """
    if not len(sites) or rules.rows > 1:
        return sites
    reach = 2.0 * rules.depth[1] + rules.verge[1]
    half = (_block_depths(sites, outline, reach) - rules.verge[1]) / 2.0
    shallow = (half < sites.depths) & (half >= LEAST_HALF * rules.depth[0])
    return replace(sites, depths=np.where(shallow, half, sites.depths))


def _block_depths(sites: Sites, outline: Outline, reach: float) -> FloatArray:
    """Distance of each front from the next road behind it, P; infinite beyond a reach in metres."""
    share = np.array(RAYS)[:, None]
    starts = sites.fronts[:, :1] + share * (sites.fronts[:, 1:] - sites.fronts[:, :1])  # P x R x 2
    normal = sites.normals.mean(axis=1, keepdims=True)
    starts, step = (starts + 0.5 * normal).reshape(-1, 2), np.repeat(normal, len(RAYS), axis=1)
    step = step.reshape(-1, 2)
    edges = np.stack([outline.start[:, :2], outline.end[:, :2]], axis=1)
    rays = shapely.linestrings(np.stack([starts, starts + reach * step], axis=1))
    ray, edge = shapely.STRtree(shapely.linestrings(edges)).query(rays, "intersects")
    along = edges[edge, 1] - edges[edge, 0]
    offset = edges[edge, 0] - starts[ray]
    cross = step[ray, 0] * along[:, 1] - step[ray, 1] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        away = (offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0]) / cross
    nearest = np.full(len(starts), np.inf)
    np.minimum.at(nearest, ray, np.where(np.isfinite(away), away, np.inf))
    depths: FloatArray = nearest.reshape(-1, len(RAYS)).min(axis=1) + 0.5
    return depths


def fill_blocks(
    sites: Sites, roadsides: Sequence[Roadside], surface: RoadSurface, rules: PlotRules, seed: int
) -> Filled:
    """Gives the free land of blocks and street fronts to plots.

    1. Land at the street, at corners and in gaps of the front, becomes plots: a share of
       `PlotRules.infill`, as far as the land is as large as a plot and not much wider.
    2. The other plots grow into the land behind them, until they meet.

    Args:
        sites: Plots that fit.
        roadsides: Roadsides of the whole map.
        surface: The whole road.
        rules: Sizes of plots.
        seed: The user's seed.
    """
    shapes = list(shapely.polygons(sites.polygons()))
    if not shapes or rules.infill <= 0.0:
        return Filled.of(sites)
    streets = _Streets(roadsides, surface, rules, shapely.multipoints(sites.fronts[:, 0]))
    land = _without(streets.land, _union(shapes))
    land = _without(land, _union(shapely.polygons(sites.lanes())))
    fronts = _opened(_common(land, streets.band))
    ways: list[FloatArray] = []
    open_land = []
    for gap in shapely.get_parts(fronts):
        x, y = shapely.get_coordinates(shapely.centroid(gap))[0]
        draw = generator(seed, "landuse", "infill", f"{x:.0f} {y:.0f}")
        is_built = draw.uniform() < rules.infill
        for part in _divided(gap, streets, rules):
            way = _entrance(part, streets, rules)
            if way is None:
                continue
            if is_built:
                shapes.append(part)
                ways.append(way)
            else:
                open_land.append(part)
    shapes[: len(sites)] = _deepened(sites, land, [*shapes[len(sites) :], *open_land], rules)
    return Filled(np.array(shapes, object), np.array(ways).reshape(-1, 4, 2))


class _Streets:
    """Streets of a map, and the land along them and between them."""

    def __init__(
        self,
        roadsides: Sequence[Roadside],
        surface: RoadSurface,
        rules: PlotRules,
        settled: shapely.Geometry,
    ) -> None:
        """Finds the blocks and the strips along the streets.

        Args:
            roadsides: Roadsides of the whole map.
            surface: The whole road.
            rules: Sizes of plots.
            settled: Points of plots: blocks without any, as islands of roundabouts, stay empty.
        """
        loops = [loop[:, :2] for loop in surface.outline_loops() if len(loop) > 2]
        rings = [shapely.linearrings(loop) for loop in loops]
        faces = shapely.make_valid(shapely.polygons(rings))
        is_enclosed = ~shapely.is_ccw(rings)  # the road lies to the left of its outline
        is_block = is_enclosed & shapely.intersects(faces, settled)
        decks = surface.vertices[surface.triangles[surface.triangle_level > 0], :2]
        verges = [np.empty((0, 4, 2)), *(side.verges() for side in roadsides)]
        strips = [_strip(side, rules.depth[0]) for side in roadsides if side.open]
        closed = [shapely.linestrings(side.points) for side in roadsides if not side.open]
        street = edges = shapely.multilinestrings(rings)
        roads = _union(faces[~is_enclosed])
        blocks = _union(faces[is_block])
        beside = _union([shapely.make_valid(strip) for strip in strips])
        margin = shapely.buffer(edges, rules.verge[0])
        taken = [margin, *shapely.make_valid(shapely.polygons(np.concatenate(verges)))]
        taken += shapely.buffer(shapely.polygons(decks), rules.verge[0]).tolist()
        outside = _without(beside, _union([roads, *faces[is_enclosed]]))
        self.land = _without(_union([blocks, outside]), _union(taken))
        near = shapely.buffer(edges, rules.depth[0] + rules.verge[1])
        self.band = _union([near, beside])
        if closed:
            unreachable = shapely.buffer(shapely.multilinestrings(closed), rules.verge[1] + STREET)
            street = shapely.difference(street, unreachable)
        self._street = street
        shapely.prepare(self._street)
        self._front = shapely.buffer(street, rules.verge[1] + STREET)
        shapely.prepare(self._front)

    def beside(self, middles: FloatArray) -> BoolArray:
        """Tells which points (N x 2) are at the edge of the verge."""
        beside: BoolArray = shapely.intersects_xy(self._front, *middles.T)
        return beside

    def away(self, place: FloatArray) -> float:
        """Distance of a point (2) from the street, metres."""
        return float(shapely.distance(self._street, shapely.Point(place)))


def _union(shapes: Iterable[shapely.Geometry]) -> shapely.Geometry:
    """Union of areas on a grid: without it, GEOS 3.14 loses shapes that nearly touch."""
    return _areas(shapely.union_all([_areas(shape) for shape in shapes], grid_size=GRID))


def _without(shape: shapely.Geometry, other: shapely.Geometry) -> shapely.Geometry:
    return _areas(shapely.difference(shape, other, grid_size=GRID))


def _common(shape: shapely.Geometry, other: shapely.Geometry) -> shapely.Geometry:
    return _areas(shapely.intersection(shape, other, grid_size=GRID))


def _areas(shape: shapely.Geometry) -> shapely.Geometry:
    """The polygons of a shape, without points and lines."""
    parts = shapely.get_parts(shapely.get_parts(shape))
    return shapely.multipolygons(parts[shapely.area(parts) > 0.0])


def _strip(side: Roadside, depth: float) -> shapely.Geometry:
    """The land along a roadside, down to a depth in metres."""
    back = side.points + depth * side.normals
    quads = np.stack([side.points[:-1], side.points[1:], back[1:], back[:-1]], axis=1)
    return _union(shapely.make_valid(shapely.polygons(quads)))


def _opened(land: shapely.Geometry) -> shapely.Geometry:
    """Land without what is narrower than a plot."""
    with np.errstate(divide="ignore", invalid="ignore"):  # mitres of sides in line
        core = shapely.buffer(land, -NARROW / 2.0, join_style="mitre")
        whole = shapely.buffer(core, NARROW / 2.0, join_style="mitre")
    return _common(shapely.make_valid(whole), land)


def _divided(part: shapely.Geometry, streets: _Streets, rules: PlotRules) -> list[shapely.Geometry]:
    """Land at a street in pieces as wide as plots, cut at right angles to its longest front."""
    front = _longest_front(part, streets)
    if front is None:
        return [part]
    along = front[1] - front[0]
    along /= np.linalg.norm(along)
    across = np.array([-along[1], along[0]])
    axes = np.stack([along, across])
    low, high = (pick(shapely.get_coordinates(part) @ axes.T, axis=0) for pick in (np.min, np.max))
    count = int((high[0] - low[0]) / mean_of(rules.frontage))
    if count <= WIDEST:
        return [part]
    stops = np.linspace(low[0], high[0], count + 1)
    corners = np.array(
        [
            [[left, low[1]], [right, low[1]], [right, high[1]], [left, high[1]]]
            for left, right in pairwise(stops)
        ]
    )
    slabs = shapely.polygons(corners @ axes)
    return [piece for slab in slabs for piece in shapely.get_parts(_common(part, slab))]


def _longest_front(part: shapely.Geometry, streets: _Streets) -> FloatArray | None:
    """The longest side of land that faces a street, 2 x 2, counter-clockwise; `None` without."""
    if part.geom_type != "Polygon":
        return None
    ring = shapely.get_coordinates(shapely.orient_polygons(shapely.simplify(part, 0.5)).exterior)
    sides = np.stack([ring[:-1], ring[1:]], axis=1)
    lengths = np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1)
    lengths[~streets.beside(sides.mean(axis=1))] = 0.0
    longest = int(np.argmax(lengths))
    return sides[longest] if lengths[longest] >= NARROW else None


def _entrance(part: shapely.Geometry, streets: _Streets, rules: PlotRules) -> FloatArray | None:
    """A paved way (4 x 2) into land at the street, `None` if it is too small or has no street."""
    front = _longest_front(part, streets)
    least = LEAST_AREA * rules.frontage[0] * rules.depth[0]
    most = MOST_AREA * rules.frontage[1] * rules.depth[1]
    around = shapely.area(shapely.oriented_envelope(part))
    if front is None or not max(least, COMPACT * around) <= part.area <= most:
        return None
    along = front[1] - front[0]
    along /= np.linalg.norm(along)
    outwards = np.array([along[1], -along[0]])  # the ring is counter-clockwise
    middle, half = front.mean(axis=0), along * WAY / 2.0
    street = middle + outwards * (streets.away(middle) + 1.0)
    inside = middle - outwards * WAY
    return np.stack([street - half, street + half, inside + half, inside - half])


def _deepened(
    sites: Sites, land: shapely.Geometry, others: Sequence[shapely.Geometry], rules: PlotRules
) -> list[shapely.Geometry]:
    """Plots with the land behind them: all grow in turn, until they meet.

    Args:
        sites: Plots that fit.
        land: Land without the plots.
        others: Land that is no longer free.
        rules: Sizes of plots.

    Returns:
        The shapes of the sites.
    """
    cores = shapely.buffer(np.array([shapely.polygons(sites.polygons())]), -JOINT)[0]
    shapes = list(shapely.polygons(sites.polygons()))
    largest = shapely.polygons(sites.polygons(DEEPER[-1]))
    near: list[list[int]] = [[] for _ in shapes]
    for first, second in shapely.STRtree(largest).query(largest, "intersects").T.tolist():
        if first != second:
            near[first].append(second)
    free = shapely.buffer(_without(land, _union(others)), JOINT)
    shapely.prepare(free)
    grows = np.ones(len(sites), bool)
    before = 1.0
    for share in DEEPER:
        grows &= share * sites.depths <= DEEPEST * rules.depth[1]
        added = _between(sites, before, share)
        grows &= shapely.covers(free, added)
        wider = shapely.polygons(sites.polygons(share))
        for number in np.flatnonzero(grows).tolist():
            if shapely.intersects(added[number], [cores[index] for index in near[number]]).any():
                grows[number] = False
                continue
            shapes[number] = wider[number]
            cores[number] = shapely.buffer(wider[number], -JOINT)
        before = share
    return shapes


def _between(sites: Sites, first: float, second: float) -> NDArray[np.object_]:
    """The land of each site between two shares of its depth."""
    near, far = sites.polygons(first)[:, 2:], sites.polygons(second)[:, 2:]
    added: NDArray[np.object_] = shapely.polygons(np.concatenate([near[:, ::-1], far], axis=1))
    return added

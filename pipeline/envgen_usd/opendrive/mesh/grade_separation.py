"""Assigns road stretches to levels: the ground, and decks above other roads."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import shapely

from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.flat_arrays import ascending
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.models.road_objects import RoadObject
from envgen_usd.opendrive.geometry.section_grids import SectionGrid

_CLEARANCE = 2.5
"""Least height difference in metres between roads that cross without meeting."""
_BLOCK = 10.0
"""Length of a block in metres; a smaller value locates crossings more exactly."""
_LEAST_LENGTH = 1.0
"""Metres below which a bridge of the file is left out."""
_MARGIN = 8.0
"""Metres of a stretch before and after an overlap; a larger value lengthens bridges."""
_SHORTEST_GROUND = 60.0
"""Least length in metres at ground level between two decks; shorter gaps stay elevated."""
_MOST_LEVELS = 8
"""Largest number of passes over the levels; bounds roads that spiral above each other."""
_FLATTEST = 1e-6
"""Least square of width to length of a block; narrower ones are level across."""
_LEAST_OVERLAP = 0.05
"""Least overlap of two blocks as a share of their area; a larger value ignores more overlaps."""


class Stretch(NamedTuple):
    """A road stretch above the ground, at level 1 and up."""

    start: float
    end: float
    level: int


class _Block(NamedTuple):
    """A short segment of a road.

    Attributes:
        road: Road id.
        start: s at the start, metres.
        end: s at the end, metres.
        corners: N x 3, points on the outermost borders, metres.
        area: Convex hull of the corners in plan.
    """

    road: str
    start: float
    end: float
    corners: FloatArray
    area: shapely.Geometry


def find_stretches(network: RoadNetwork, grids: Sequence[SectionGrid]) -> dict[str, list[Stretch]]:
    """Returns the stretches above the ground by road id, ascending and disjoint.

    1. Bridges in the file are elevated.
    2. Where roads overlap in plan with clearance, the upper road is elevated. A connecting road
       includes its whole junction.
    3. Roads that overlap an elevated stretch at the same height are elevated too.
    """
    stretches = {road.id: _named(road) for road in network.roads.values()}
    blocks = _cut_blocks(grids)
    level = _levels(network, blocks)
    for k in np.flatnonzero(level > 0).tolist():
        road = network.roads[blocks[k].road]
        start = max(blocks[k].start - _MARGIN, 0.0)
        end = min(blocks[k].end + _MARGIN, road.length)
        stretches[road.id].append(Stretch(start, end, int(level[k])))
    return {road: _merged(each) for road, each in stretches.items() if each}


def unnamed_bridges(
    network: RoadNetwork, stretches: Mapping[str, Sequence[Stretch]]
) -> Iterator[Issue]:
    """Yields an issue for each road with an elevated stretch that no bridge in the file names."""
    for id_, elevated in sorted(stretches.items()):
        bridges = _named(network.roads[id_])
        unnamed = [
            stretch
            for stretch in elevated
            if not any(b.start < stretch.end and stretch.start < b.end for b in bridges)
        ]
        if unnamed:
            yield Issue(
                "road.unnamed_bridge",
                Severity.INFO,
                f"road[id={id_}]",
                f"{len(unnamed)} stretches lie more than {_CLEARANCE:g} m above another road",
                "built as bridges",
            )


def is_bridge(road: Road, road_object: RoadObject) -> bool:
    """Returns whether an object is a bridge under a stretch of its road."""
    stretch = _stretch(road, road_object)
    return road_object.type == "bridge" and stretch.end - stretch.start > _LEAST_LENGTH


def _named(road: Road) -> list[Stretch]:
    return [_stretch(road, each) for each in road.objects if is_bridge(road, each)]


def _stretch(road: Road, bridge: RoadObject) -> Stretch:
    return Stretch(max(bridge.s, 0.0), min(bridge.s + bridge.length, road.length), 1)


def _cut_blocks(grids: Sequence[SectionGrid]) -> list[_Block]:
    cuts: list[tuple[str, float, float]] = []
    sides_of: list[FloatArray] = []
    for grid in grids:
        rows = grid.borders.s
        if grid.points.shape[1] < 2:
            continue
        count = max(round((rows[-1] - rows[0]) / _BLOCK), 1)
        ends = np.linspace(rows[0], rows[-1], count + 1)
        s = ascending(np.concatenate([rows, ends]))
        outer = grid.points[:, [0, -1]].reshape(len(rows), 6)
        sides = np.column_stack([np.interp(s, rows, value) for value in outer.T])
        first, last = np.searchsorted(s, ends[:-1]), np.searchsorted(s, ends[1:])
        for k, (a, b) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
            cuts.append((grid.road.id, float(ends[k]), float(ends[k + 1])))
            sides_of.append(sides[a : b + 1].reshape(-1, 3))
    if not cuts:
        return []
    owner = np.repeat(np.arange(len(cuts)), [len(corners) for corners in sides_of])
    places = np.concatenate(sides_of)[:, :2]
    areas = shapely.convex_hull(shapely.multipoints(places, indices=owner)).tolist()
    each = zip(cuts, sides_of, areas, strict=True)
    return [_Block(*cut, corners, area) for cut, corners, area in each]


def _levels(network: RoadNetwork, blocks: Sequence[_Block]) -> IntArray:
    """Returns the level of each block: above all blocks that it crosses."""
    pairs, rise = _overlaps(blocks)
    over = pairs[rise > _CLEARANCE]
    level = np.zeros(len(blocks), dtype=np.int64)
    if not len(over):
        return level
    road = np.array([block.road for block in blocks])
    beside = pairs[(np.abs(rise) <= _CLEARANCE) & (road[pairs[:, 0]] != road[pairs[:, 1]])]
    junction = np.array([network.roads[block.road].junction for block in blocks])
    for _ in range(_MOST_LEVELS):
        before = level.copy()
        np.maximum.at(level, over[:, 0], level[over[:, 1]] + 1)
        np.maximum.at(level, beside[:, 0], level[beside[:, 1]])
        for name in set(junction[level > 0].tolist()) - {""}:
            level[junction == name] = level[junction == name].max()
        if (before == level).all():
            break
    return level


def _overlaps(blocks: Sequence[_Block]) -> tuple[IntArray, FloatArray]:
    """Returns pairs of overlapping blocks, and the height of the first above the second."""
    if not blocks:
        return np.empty((0, 2), dtype=np.int64), np.empty(0)
    area = np.array([block.area for block in blocks])
    base, partner = shapely.STRtree(area).query(area, predicate="intersects")
    first = base < partner
    base, partner = base[first], partner[first]
    shared = shapely.intersection(area[base], area[partner])
    size = shapely.area(area)
    large = shapely.area(shared) > _LEAST_OVERLAP * np.minimum(size[base], size[partner])
    base, partner, shared = base[large], partner[large], shared[large]
    place = shapely.get_coordinates(shapely.centroid(shared))
    middle, slope = _planes([block.corners for block in blocks])
    heights = [
        middle[block, 2] + ((place - middle[block, :2]) * slope[block]).sum(axis=1)
        for block in (base, partner)
    ]
    rise = heights[0] - heights[1]
    pairs = np.column_stack([np.append(base, partner), np.append(partner, base)])
    return pairs, np.append(rise, -rise)


def _planes(corners: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Returns the middle (B x 3) and slope (B x 2) of the planes through corners (N x 3) of B."""
    count = np.array([len(part) for part in corners])
    points, owner = np.concatenate(corners), np.repeat(np.arange(len(corners)), count)
    sums = np.stack([np.bincount(owner, values) for values in points.T], axis=1)
    middle: FloatArray = sums / count[:, None]
    apart = points - middle[owner]
    xx, xy, xz, yx, yy, yz = (
        np.bincount(owner, apart[:, j] * apart[:, k]) for j in (0, 1) for k in (0, 1, 2)
    )
    spread = np.stack([xx, xy, yx, yy], axis=1).reshape(-1, 2, 2)
    inverse = np.linalg.pinv(spread, rcond=_FLATTEST, hermitian=True)
    slope: FloatArray = (inverse @ np.stack([xz, yz], axis=1)[..., None])[..., 0]
    return middle, slope


def _merged(stretches: Sequence[Stretch]) -> list[Stretch]:
    """Joins adjacent stretches; the higher level applies to both."""
    merged: list[Stretch] = []
    for start, end, level in sorted(stretches):
        if merged and start <= merged[-1].end + _SHORTEST_GROUND:
            last = merged.pop()
            merged.append(Stretch(last.start, max(last.end, end), max(last.level, level)))
        else:
            merged.append(Stretch(start, end, level))
    return merged


def level_cuts(stretches: Mapping[str, Sequence[Stretch]], grid: SectionGrid) -> list[Stretch]:
    """Splits a lane section into stretches of a single level; level 0 is the ground."""
    start, end = float(grid.borders.s[0]), float(grid.borders.s[-1])
    cuts: list[Stretch] = []
    for stretch in stretches.get(grid.road.id, ()):
        a, b = max(stretch.start, start), min(stretch.end, end)
        if b - a < 0.05:
            continue
        if a - start > 0.05:
            cuts.append(Stretch(start, a, 0))
        else:
            a = start
        start = b if end - b > 0.05 else end
        cuts.append(Stretch(a, start, stretch.level))
    if end - start > 0.0 or not cuts:
        cuts.append(Stretch(start, end, 0))
    return cuts

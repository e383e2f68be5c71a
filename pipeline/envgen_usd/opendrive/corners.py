"""Sidewalks and shoulders around junctions whose connecting roads have none, from arm to arm."""

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import shapely

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.surface import Patch
from envgen_usd.opendrive.cells import Cells
from envgen_usd.opendrive.names import nc_name
from envgen_usd.opendrive.strips import SectionGrid, Strip, lane_strips

_AT_ARM = 0.3
"""How far from an arm's end the corner's own border begins, and how far it reaches inwards (m)."""
_OVERLAP = 0.02
"""How far a corner reaches under its arms, so that rounding opens no slit (m)."""
_LONGEST = 120.0
_VERGES = ("shoulder", "border")
_CRACK = 0.1
_SMOOTHED = 0.05
"""Cracks and jags of the border (m) that do not show in the sidewalk around it."""


class _Arm(NamedTuple):
    """End of a road at a junction: the borders across it, from left to right.

    Attributes:
        points: (L + 1) x 3.
        types: L lane types.
        heights: L x 2, at the left and right border of each lane.
    """

    points: FloatArray
    types: tuple[str, ...]
    heights: FloatArray


class _Band(NamedTuple):
    """A lane beside a corner: its borders as distances outwards, their rise and lane height."""

    reach: FloatArray
    rise: FloatArray
    height: FloatArray
    lane_type: str


def corner_strips(network: RoadNetwork, grids: Sequence[SectionGrid]) -> list[Strip]:
    """Sidewalks, and what lies between them and the road, along the borders of junctions.

    Two arms that follow one another around a junction and both have a sidewalk outside the
    connecting roads are joined by one, as wide and as high as theirs; so are shoulders. It counts
    only where nothing else lies.
    """
    inside: dict[str, list[SectionGrid]] = {}
    for grid in grids:
        inside.setdefault(grid.road.junction, []).append(grid)
    arms = _arms(network, inside.get("", []))
    strips: list[Strip] = []
    for junction, parts in inside.items():
        if len(arms.get(junction, ())) > 1:
            strips += _around(junction, parts, arms[junction])
    return strips


def _arms(network: RoadNetwork, grids: Sequence[SectionGrid]) -> dict[str, list[_Arm]]:
    found: dict[str, list[_Arm]] = {}
    for grid in grids:
        road, borders = grid.road, grid.borders
        for link, row, at_end in (
            (road.predecessor, 0, borders.s[0] <= 1e-6),
            (road.successor, -1, borders.s[-1] >= road.length - 1e-6),
        ):
            if link is None or link.element != "junction" or not at_end:
                continue
            if link.id not in network.junctions:
                continue
            heights = np.column_stack([borders.height_left[row], borders.height_right[row]])
            types = tuple(lane.type for lane in borders.lanes)
            found.setdefault(link.id, []).append(_Arm(grid.points[row], types, heights))
    return found


def _around(junction: str, grids: Sequence[SectionGrid], arms: Sequence[_Arm]) -> Iterator[Strip]:
    strips = [strip for grid in grids for strip in lane_strips(grid)]
    if not strips:
        return
    rings = [np.concatenate([strip.left, strip.right[::-1]])[:, :2] for strip in strips]
    area = shapely.union_all(shapely.make_valid([shapely.Polygon(ring) for ring in rings]))
    area = shapely.buffer(shapely.buffer(area, _CRACK), -_CRACK)
    ends = [shapely.LineString(arm.points[[0, -1], :2]) for arm in arms]
    near = shapely.buffer(shapely.union_all(ends), _AT_ARM)
    cells = Cells(strips)
    outer = [part.exterior for part in shapely.get_parts(shapely.orient_polygons(area))]
    for number, path in enumerate(_paths(outer, near)):
        places = [_nearest(ends, shapely.Point(path[k])) for k in (0, -1)]
        if places[0] == places[1] or None in places:
            continue
        first, last = (arms[place] for place in places if place is not None)
        yield from _corner((junction, number), path, (first, last), cells)


def _paths(rings: Sequence[shapely.LinearRing], near: shapely.Geometry) -> list[FloatArray]:
    """Pieces of the junction's border between its arms, with the junction on the left."""
    found = []
    for ring in rings:
        rest = shapely.line_merge(shapely.difference(ring, near), directed=True)
        for piece in shapely.get_parts(rest):
            if piece.geom_type == "LineString" and 0.5 < piece.length < _LONGEST:
                found.append(shapely.get_coordinates(shapely.simplify(piece, _SMOOTHED)))
    return found


def _nearest(ends: Sequence[shapely.LineString], place: shapely.Point) -> int | None:
    distances = shapely.distance(np.array(ends), place)
    best = int(np.argmin(distances))
    return best if distances[best] < 2 * _AT_ARM else None


def _corner(
    name: tuple[str, int], path: FloatArray, arms: tuple[_Arm, _Arm], cells: Cells
) -> Iterator[Strip]:
    """Strips along one piece of the border; right of the path lies the corner."""
    outward = _normals(path)
    ends = [_end_row(arm, path[k], outward[k]) for arm, k in zip(arms, (0, -1), strict=True)]
    path = np.concatenate([ends[0][:1], path, ends[1][:1]])
    outward = np.concatenate([ends[0][1:], outward, ends[1][1:]])
    bands = [_bands(arm, path[k], outward[k]) for arm, k in zip(arms, (0, -1), strict=True)]
    hits = cells.at(path)
    count = np.bincount(hits.place, minlength=len(path))
    z = np.bincount(hits.place, hits.base, minlength=len(path)) / count
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    share = (along / along[-1])[:, None]
    for place, (one, other) in enumerate(_matched(*bands)):
        reach = one.reach * (1 - share) + other.reach * share
        if place == 0:
            reach[:, 0] = -_AT_ARM
        rise = one.rise * (1 - share) + other.rise * share
        sides = path[:, None] + reach[..., None] * outward[:, None]
        points = np.concatenate([sides, (z[:, None] + rise)[..., None]], axis=2)
        height = one.height * (1 - share) + other.height * share
        patch = Patch(
            id=f"junction_{nc_name(name[0])}_corner_{name[1]}_{place}",
            kind="junction",
            lane_type=one.lane_type,
            junction=name[0],
        )
        yield Strip(points[:, 0], points[:, 1], height, np.zeros_like(height), patch)


def _normals(path: FloatArray) -> FloatArray:
    """Unit vectors to the right of a path, at its vertices."""
    step = np.diff(path, axis=0)
    step /= np.maximum(np.hypot(*step.T), 1e-9)[:, None]
    right = np.column_stack([step[:, 1], -step[:, 0]])
    outward = np.concatenate([right[:1], right[:-1] + right[1:], right[-1:]])
    unit: FloatArray = outward / np.maximum(np.hypot(*outward.T), 1e-9)[:, None]
    return unit


def _end_row(arm: _Arm, place: FloatArray, outward: FloatArray) -> FloatArray:
    """Where a path meets its arm, slightly inside, and the direction outwards along the arm."""
    across = arm.points[-1, :2] - arm.points[0, :2]
    across /= max(float(np.hypot(*across)), 1e-9)
    foot = arm.points[0, :2] + ((place - arm.points[0, :2]) @ across) * across
    apart = foot - place
    inside = foot + apart / max(float(np.hypot(*apart)), 1e-9) * _OVERLAP
    return np.stack([inside, across if across @ outward >= 0 else -across])


def _bands(arm: _Arm, start: FloatArray, outward: FloatArray) -> list[_Band]:
    """Lanes of an arm beyond a place on its end, outwards, up to the sidewalk; else verges."""
    across = arm.points[-1, :2] - arm.points[0, :2]
    across /= max(float(np.hypot(*across)), 1e-9)
    sign = 1.0 if across @ outward >= 0 else -1.0
    reach = sign * ((arm.points[:, :2] - start) @ across)
    ground = float(np.interp(0.0, reach[:: int(sign)], arm.points[:: int(sign), 2]))
    found: list[_Band] = []
    for lane in range(len(arm.types))[:: int(sign)]:
        sides = [lane, lane + 1][:: int(sign)]
        if reach[sides[1]] < 0.05 or reach[sides[1]] - reach[sides[0]] < 0.05:
            continue
        rise = arm.points[sides, 2] - ground
        found.append(
            _Band(
                np.maximum(reach[sides], 0.0),
                rise,
                arm.heights[lane][:: int(sign)],
                arm.types[lane],
            )
        )
        following = lane + int(sign)
        last = not 0 <= following < len(arm.types) or arm.types[following] != "sidewalk"
        if arm.types[lane] == "sidewalk" and last:
            return found
    return list(itertools.takewhile(lambda band: band.lane_type in _VERGES, found))


def _matched(one: list[_Band], other: list[_Band]) -> list[tuple[_Band, _Band]]:
    """Pairs of bands; where the kinds differ, all before the sidewalk become one.

    Where an arm has no sidewalk, only what both have in common goes on.
    """
    if not all(bands and bands[-1].lane_type == "sidewalk" for bands in (one, other)):
        pairs = zip(one, other, strict=False)
        return list(itertools.takewhile(lambda two: two[0].lane_type == two[1].lane_type, pairs))
    if [band.lane_type for band in one] == [band.lane_type for band in other]:
        return list(zip(one, other, strict=True))
    found = [(one[-1], other[-1])]
    before = [_joined(bands) for bands in (one, other)]
    if any(band.reach[1] > 0.05 for band in before):
        found.insert(0, (before[0], before[1]))
    return found


def _joined(bands: list[_Band]) -> _Band:
    """Everything before the sidewalk as one band, level with the road at its inner border."""
    last = bands[-1]
    kind = bands[0].lane_type if len(bands) > 1 else "shoulder"
    return _Band(np.array([0.0, last.reach[0]]), np.array([0.0, last.rise[0]]), np.zeros(2), kind)

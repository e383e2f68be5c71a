"""Sidewalks and shoulders around junctions, from arm to arm, where connecting roads lack them."""

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import shapely

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanes import WALKED
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_surface import KERB_STONE, Patch
from envgen_usd.opendrive.geometry.section_grids import SectionGrid
from envgen_usd.opendrive.strips.kerb_stones import LEAST_RISE, STONE_WIDTH, stones_of
from envgen_usd.opendrive.strips.lane_strips import Strip, lane_strips
from envgen_usd.opendrive.strips.strip_index import Cells
from envgen_usd.opendrive.surface_ids import nc_name

_AT_ARM = 0.3
"""Metres from an arm's end to the start of the corner's border; also its reach inwards."""
_OVERLAP = 0.02
"""Metres of overlap of a corner with its arms; prevents slits by rounding."""
_LONGEST = 120.0
"""Longest border in metres of a corner; longer borders get no sidewalk."""
_VERGES = ("shoulder", "border")
_CRACK = 0.1
"""Half the width in metres of cracks that are closed before the border is traced."""
_SMOOTHED = 0.05
"""Tolerance in metres for smoothing the border; larger values hide larger cracks and jags."""
_LEVELLED = 0.003
"""Largest height in metres between a piece of the border and its lanes; smaller: more vertices."""
_PROFILE = 1.0
"""Metres between the places at which the heights of the border are looked at."""


class _Arm(NamedTuple):
    """End of a road at a junction: borders across the road, from left to right.

    Attributes:
        points: (L + 1) x 3, metres, road frame.
        types: L lane types.
        heights: L x 2, metres, at the left and right border of each lane.
    """

    points: FloatArray
    types: tuple[str, ...]
    heights: FloatArray


class _Band(NamedTuple):
    """A lane beside a corner: distances of its borders outwards, their rise, its lane height."""

    reach: FloatArray
    rise: FloatArray
    height: FloatArray
    lane_type: str


def corner_strips(
    network: RoadNetwork, grids: Sequence[SectionGrid]
) -> tuple[list[Strip], list[Strip]]:
    """Returns strips of sidewalks, and of the lanes inside them, along junction borders.

    Neighbouring arms around a junction are joined if both have a sidewalk outside the connecting
    roads. The joint is as wide and high as theirs. Shoulders are joined likewise. All other strips
    take precedence. The second list holds the kerb stones that lie on raised sidewalks.
    """
    inside: dict[str, list[SectionGrid]] = {}
    for grid in grids:
        inside.setdefault(grid.road.junction, []).append(grid)
    arms = _arms(network, inside.get("", []))
    strips: list[Strip] = []
    for junction, parts in inside.items():
        if len(arms.get(junction, ())) > 1:
            strips += _around(junction, parts, arms[junction])
    stones = [strip for strip in strips if strip.patch.kind == KERB_STONE]
    return [strip for strip in strips if strip.patch.kind != KERB_STONE], stones


def corner_issues(strips: Sequence[Strip]) -> Iterator[Issue]:
    """Yields an issue for each junction with such strips."""
    counts = Counter(strip.patch.junction for strip in strips)
    for junction, count in sorted(counts.items()):
        yield Issue(
            "junction.corner",
            Severity.INFO,
            f"junction[id={junction}]",
            f"{count} gaps between sidewalks or shoulders of its arms have no connecting lane",
            "continued around the corners",
        )


def _arms(network: RoadNetwork, grids: Sequence[SectionGrid]) -> dict[str, list[_Arm]]:
    by_junction: dict[str, list[_Arm]] = {}
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
            by_junction.setdefault(link.id, []).append(_Arm(grid.points[row], types, heights))
    return by_junction


def _around(junction: str, grids: Sequence[SectionGrid], arms: Sequence[_Arm]) -> Iterator[Strip]:
    strips = [strip for grid in grids for strip in lane_strips(grid)]
    if not strips:
        return
    rings = [np.concatenate([strip.left, strip.right[::-1]])[:, :2] for strip in strips]
    owner = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
    lanes = shapely.polygons(shapely.linearrings(np.concatenate(rings), indices=owner))
    area = shapely.union_all(shapely.make_valid(lanes))
    area = shapely.buffer(shapely.buffer(area, _CRACK), -_CRACK)
    ends = [shapely.LineString(arm.points[[0, -1], :2]) for arm in arms]
    near = shapely.buffer(shapely.union_all(ends), _AT_ARM)
    cells = Cells(strips)
    outer = [part.exterior for part in shapely.get_parts(shapely.orient_polygons(area))]
    for number, path in enumerate(_paths(outer, near, cells)):
        places = [_nearest(ends, shapely.Point(path[k])) for k in (0, -1)]
        if places[0] == places[1] or None in places:
            continue
        first, last = (arms[place] for place in places if place is not None)
        yield from _corner((junction, number), path, (first, last), cells)


def _paths(
    rings: Sequence[shapely.LinearRing], near: shapely.Geometry, cells: Cells
) -> list[FloatArray]:
    """Returns the pieces of the junction's border between its arms, junction on the left."""
    paths = []
    for ring in rings:
        rest = shapely.line_merge(shapely.difference(ring, near), directed=True)
        for piece in shapely.get_parts(rest):
            if piece.geom_type == "LineString" and 0.5 < piece.length < _LONGEST:
                fine = shapely.segmentize(piece, _PROFILE)
                paths.append(_simplified(shapely.get_coordinates(fine), cells))
    return paths


def _simplified(path: FloatArray, cells: Cells) -> FloatArray:
    """Returns the vertices of a path that its shape in plan or its heights need.

    A long piece over a hump would cut the lanes along it, and narrow triangles beside it would be
    as steep as the hump is high.
    """
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T)))
    kept = np.zeros(len(path), bool)
    for line, tolerance in (
        (path, _SMOOTHED),
        (np.column_stack([along, _heights(path, cells)]), _LEVELLED),
    ):
        numbered = np.column_stack([line, np.arange(len(path))])
        rest = shapely.simplify(shapely.LineString(numbered), tolerance, preserve_topology=False)
        kept[shapely.get_coordinates(rest, include_z=True)[:, 2].astype(np.int64)] = True
    return path[kept]


def _heights(path: FloatArray, cells: Cells) -> FloatArray:
    """Returns the mean height of the strips at each vertex of a path, metres."""
    hits = cells.at(path)
    count = np.bincount(hits.place, minlength=len(path))
    heights: FloatArray = np.bincount(hits.place, hits.base, minlength=len(path)) / count
    return heights


def _nearest(ends: Sequence[shapely.LineString], place: shapely.Point) -> int | None:
    distances = shapely.distance(np.array(ends), place)
    best = int(np.argmin(distances))
    return best if distances[best] < 2 * _AT_ARM else None


def _corner(
    name: tuple[str, int], path: FloatArray, arms: tuple[_Arm, _Arm], cells: Cells
) -> Iterator[Strip]:
    """Yields strips along a piece of the border; the corner lies right of the path."""
    outward = _normals(path)
    ends = [_end_row(arm, path[k], outward[k]) for arm, k in zip(arms, (0, -1), strict=True)]
    path = np.concatenate([ends[0][:1], path, ends[1][:1]])
    outward = np.concatenate([ends[0][1:], outward, ends[1][1:]])
    bands = [_bands(arm, path[k], outward[k]) for arm, k in zip(arms, (0, -1), strict=True)]
    z = _heights(path, cells)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    share = (along / along[-1])[:, None]
    inside = np.zeros(len(path))
    for place, (first, second) in enumerate(_matched(*bands)):
        reach, rise, height = (
            one * (1 - share) + other * share
            for one, other in zip(first[:3], second[:3], strict=True)
        )
        base = np.column_stack([path, z])[:, None] + np.zeros((1, 2, 1))
        base[..., 2] += rise
        patch = Patch(
            id=f"junction_{nc_name(name[0])}_corner_{name[1]}_{place}",
            kind="junction",
            lane_type=first.lane_type,
            junction=name[0],
        )
        if patch.lane_type in WALKED and (height[:, 0] - inside).min() >= LEAST_RISE:
            edge = reach[:, :1] + [0.0, STONE_WIDTH]
            yield _band(base, np.minimum(edge, reach[:, 1:]), outward, stones_of(patch))
        if place == 0:
            reach[:, 0] = -_AT_ARM
        yield _band(base, reach, outward, patch, height)
        inside = height[:, 1]


def _band(
    base: FloatArray,
    reach: FloatArray,
    outward: FloatArray,
    patch: Patch,
    height: FloatArray | None = None,
) -> Strip:
    """A strip beside a path, between two distances from it.

    Args:
        base: N x 2 x 3, the path at the height of either side, metres.
        reach: N x 2, distances of both sides, metres.
        outward: N x 2, unit vectors away from the path.
        patch: Semantics of the strip.
        height: N x 2, lane heights; none for what lies on a lane.
    """
    points = base.copy()
    points[..., :2] += reach[..., None] * outward[:, None]
    level = np.zeros_like(reach)
    return Strip(points[:, 0], points[:, 1], level if height is None else height, level, patch)


def _normals(path: FloatArray) -> FloatArray:
    """Returns the unit vectors to the right of a path at its vertices."""
    step = np.diff(path, axis=0)
    step /= np.maximum(np.hypot(*step.T), 1e-9)[:, None]
    right = np.column_stack([step[:, 1], -step[:, 0]])
    outward = np.concatenate([right[:1], right[:-1] + right[1:], right[-1:]])
    unit: FloatArray = outward / np.maximum(np.hypot(*outward.T), 1e-9)[:, None]
    return unit


def _end_row(arm: _Arm, place: FloatArray, outward: FloatArray) -> FloatArray:
    """Returns the start of a path slightly inside its arm, and the direction along the arm."""
    across = arm.points[-1, :2] - arm.points[0, :2]
    across /= max(float(np.hypot(*across)), 1e-9)
    foot = arm.points[0, :2] + ((place - arm.points[0, :2]) @ across) * across
    apart = foot - place
    inside = foot + apart / max(float(np.hypot(*apart)), 1e-9) * _OVERLAP
    return np.stack([inside, across if across @ outward >= 0 else -across])


def _bands(arm: _Arm, start: FloatArray, outward: FloatArray) -> list[_Band]:
    """Returns an arm's lanes outwards from a position, up to the sidewalk; otherwise verges."""
    across = arm.points[-1, :2] - arm.points[0, :2]
    across /= max(float(np.hypot(*across)), 1e-9)
    sign = 1.0 if across @ outward >= 0 else -1.0
    reach = sign * ((arm.points[:, :2] - start) @ across)
    ground = float(np.interp(0.0, reach[:: int(sign)], arm.points[:: int(sign), 2]))
    bands: list[_Band] = []
    for lane in range(len(arm.types))[:: int(sign)]:
        sides = [lane, lane + 1][:: int(sign)]
        if reach[sides[1]] < 0.05 or reach[sides[1]] - reach[sides[0]] < 0.05:
            continue
        rise = arm.points[sides, 2] - ground
        bands.append(
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
            return bands
    return list(itertools.takewhile(lambda band: band.lane_type in _VERGES, bands))


def _matched(first: list[_Band], second: list[_Band]) -> list[tuple[_Band, _Band]]:
    """Pairs the bands of two arms; different lane types before the sidewalk become a band.

    Without a sidewalk at an arm, only the common lane types continue.
    """
    if not all(bands and bands[-1].lane_type == "sidewalk" for bands in (first, second)):
        pairs = zip(first, second, strict=False)
        return list(itertools.takewhile(lambda two: two[0].lane_type == two[1].lane_type, pairs))
    if [band.lane_type for band in first] == [band.lane_type for band in second]:
        return list(zip(first, second, strict=True))
    matched = [(first[-1], second[-1])]
    before = [_joined(bands) for bands in (first, second)]
    if any(band.reach[1] > 0.05 for band in before):
        matched.insert(0, (before[0], before[1]))
    return matched


def _joined(bands: list[_Band]) -> _Band:
    """Joins all bands before the sidewalk; the result is level with the road at its border."""
    last = bands[-1]
    kind = bands[0].lane_type if len(bands) > 1 else "shoulder"
    return _Band(np.array([0.0, last.reach[0]]), np.array([0.0, last.rise[0]]), np.zeros(2), kind)

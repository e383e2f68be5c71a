"""Cuts the strips of wall below windows out of a wall, for streaks that run down from sills.

Windows stand in columns. The strip between two windows of a column becomes a quad of its own, and
the windows and strips of a column become a single hole. Triangles and vertices are as many as
before. The strip below a lowest window ends above the foot of the wall, whose edge it must not
touch: it adds four triangles. What the shader has to know of a strip is the height of its sill, and
the texture coordinates carry it: see `sill_periods`.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from envgen_usd.geometry.flat_arrays import join, take
from envgen_usd.geometry.polygon_planes import polygon_normals
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.polygon_arrays import Polygons

SILL_STEP = 0.1
"""Step of heights in texture coordinates, metres; a larger value reaches higher."""
_FIRST = 2
"""Least periods of a strip; others may straddle one period, so that a larger value is safe, too."""
_DIGITS = 14
"""Periods of u and of v that differ; a larger value reaches higher and blurs textures."""
PERIOD = 256
"""Repeats after which textures and their patches start anew, as in `texture_bombing.glsl`."""
_SAME = 2e-3
"""Largest distance of corners on one line, metres: twice the grid."""
_LEAST = 0.3
"""Least height of a strip, metres; a larger value leaves out low sills, e.g. of doors."""
_LONGEST = 2.5
"""Height of a strip without a window below, metres: streaks have faded where a longer one ends."""
_CLEAR = 0.08
"""Distance of a strip from the edge of the wall below it, metres; a larger value shows its end."""


class _Hole(NamedTuple):
    """A rectangular opening of a wall.

    Attributes:
        left, low, right, high: Place along the wall and height, metres.
        ring: 4 x 3, its corners from the lower left one, clockwise seen from outside.
    """

    left: float
    low: float
    right: float
    high: float
    ring: FloatArray


def sill_periods(height: FloatArray) -> FloatArray:
    """Whole repeats, N x 2, to add to the texture coordinates below sills.

    Textures repeat, so that they look the same; the wear of walls (`surface_wear.glsl`) reads the
    height from them. It is rounded up: streaks then begin behind the sill.

    Args:
        height: N, height of the sill above the foot of the building, metres; 0 for no sill. Texture
            coordinates start between 0 and `PERIOD`.
    """
    code = np.minimum(np.ceil(height / SILL_STEP - 1e-6), _DIGITS**2).astype(np.int64)
    digits = np.stack([(code - 1) % _DIGITS, (code - 1) // _DIGITS], axis=1)
    return np.where(code[:, None] > 0, PERIOD * (digits + _FIRST), 0).astype(np.float64)


def with_sill_strips(
    polygons: Polygons, share: float, rng: np.random.Generator
) -> tuple[Polygons, FloatArray]:
    """Cuts strips below windows out of upright polygons with rectangular holes.

    Args:
        polygons: P polygons of a wall, exteriors counter-clockwise seen from outside.
        share: Share of the windows below which there is a strip, 0 to 1.
        rng: Decides which.

    Returns:
        The polygons with their strips, and the height of the sill above each of them, metres in
        the frame of the points; NaN for what is no strip.
    """
    if share <= 0.0 or len(polygons.ring_offsets) - 1 == len(polygons):
        return polygons, np.full(len(polygons), np.nan)
    normals = polygon_normals(polygons)
    walls = (np.diff(polygons.polygon_offsets) > 1) & (np.abs(normals[:, 2]) < 1e-3)
    plain = take(polygons, np.flatnonzero(~walls))
    found: list[list[FloatArray]] = []
    heights: list[float] = []
    for wall in np.flatnonzero(walls).tolist():
        normal = normals[wall]
        along = np.array([-normal[1], normal[0]])
        rings, strips = _cut(polygons.rings(wall), along, share, rng)
        found += [rings, *([strip] for strip, _ in strips)]
        heights += [np.nan, *(height for _, height in strips)]
    if not found:
        return polygons, np.full(len(polygons), np.nan)
    sills = np.concatenate([np.full(len(plain), np.nan), heights])
    return join([plain, _joined(found)]), sills


def _joined(found: list[list[FloatArray]]) -> Polygons:
    rings = [ring for each in found for ring in each]
    sizes = np.array([0, *(len(ring) for ring in rings)], dtype=np.int64)
    counts = np.array([0, *(len(each) for each in found)], dtype=np.int64)
    return Polygons(np.concatenate(rings), np.cumsum(sizes), np.cumsum(counts))


def _cut(
    rings: list[FloatArray], along: FloatArray, share: float, rng: np.random.Generator
) -> tuple[list[FloatArray], list[tuple[FloatArray, float]]]:
    """Rings of a wall with columns for holes, and the strips with the heights of their sills."""
    outer, *inner = rings
    extents = np.array([_extent(ring, along) for ring in inner])
    upright, whole = _holes(inner, extents, along)
    bounds = np.array([hole[:4] for hole in upright]).reshape(-1, 4)
    strips: list[tuple[FloatArray, float]] = []
    for column in _columns(upright):
        lowest = column[0]
        end = _end_below(outer, extents, lowest, along)
        feet: list[list[FloatArray]] = [[]]
        if end is not None and rng.random() < share:
            feet = [[np.array([*corner[:2], end]) for corner in lowest.ring[[0, 3]]]]
            quad = np.stack([feet[0][0], feet[0][1], lowest.ring[3], lowest.ring[0]])
            strips.append((quad, lowest.low))
        runs = [[lowest]]
        for below, above in pairwise(column):
            if _is_free(bounds, above, below.high) and rng.random() < share:
                quad = np.stack([below.ring[1], below.ring[2], above.ring[3], above.ring[0]])
                strips.append((quad, above.low))
                runs[-1].append(above)
            else:
                runs.append([above])
        feet += [[]] * (len(runs) - 1)
        whole += [_around(run, foot) for run, foot in zip(runs, feet, strict=True)]
    return [outer, *whole], strips


def _extent(ring: FloatArray, along: FloatArray) -> tuple[float, float, float, float]:
    """Left, low, right and high end of a ring in the plane of its wall."""
    x, z = ring[:, :2] @ along, ring[:, 2]
    return float(x.min()), float(z.min()), float(x.max()), float(z.max())


def _holes(
    rings: list[FloatArray], extents: FloatArray, along: FloatArray
) -> tuple[list[_Hole], list[FloatArray]]:
    """Rectangular holes, and the rings of all others."""
    fours = np.array([len(ring) == 4 for ring in rings])
    quads = np.stack(
        [ring if four else np.zeros((4, 3)) for ring, four in zip(rings, fours, strict=True)]
    )
    left, low, right, high = extents.T[:, :, None]
    x, z = quads[:, :, :2] @ along, quads[:, :, 2]
    first = np.argmin(np.hypot(x - left, z - low), axis=1)
    order = (first[:, None] + np.arange(4)) % 4
    quads = np.take_along_axis(quads, order[:, :, None], axis=1)
    x, z = np.take_along_axis(x, order, axis=1), np.take_along_axis(z, order, axis=1)
    apart = np.abs(x - np.concatenate([left, left, right, right], axis=1)).max(axis=1)
    above = np.abs(z - np.concatenate([low, high, high, low], axis=1)).max(axis=1)
    straight = fours & (np.maximum(apart, above) <= _SAME)
    holes = [
        _Hole(west, foot, east, top, quad)
        for (west, foot, east, top), quad in zip(
            extents[straight].tolist(), quads[straight], strict=True
        )
    ]
    return holes, [ring for ring, is_hole in zip(rings, straight, strict=True) if not is_hole]


def _columns(holes: list[_Hole]) -> Iterator[list[_Hole]]:
    """Holes of one place and width, each column from the lowest to the highest."""
    left = sorted(holes, key=lambda hole: (hole.left, hole.low))
    while left:
        first = left[0]
        column: list[_Hole] = []
        others: list[_Hole] = []
        for hole in left:
            same = max(abs(hole.left - first.left), abs(hole.right - first.right)) <= _SAME
            (column if same else others).append(hole)
        left = others
        yield sorted(column, key=lambda hole: hole.low)


def _is_free(bounds: FloatArray, above: _Hole, down_to: float) -> bool:
    """True if no other hole reaches into the strip from a sill down to a height.

    Args:
        bounds: H x 4, left, low, right and high end of all holes.
        above: The hole above the strip.
        down_to: Lower end of the strip.
    """
    left, low, right, high = bounds.T
    beside = (left < above.right + _SAME) & (right > above.left - _SAME)
    hit = beside & (low < above.low - _SAME) & (high > down_to + _SAME)
    return above.low - down_to >= _LEAST and not hit.any()


def _end_below(
    outer: FloatArray, extents: FloatArray, hole: _Hole, along: FloatArray
) -> float | None:
    """Height at which a strip below a lowest opening ends, or `None` where no strip has room."""
    starts, ends = outer, np.roll(outer, -1, axis=0)
    left, right = np.sort(np.stack([starts @ [*along, 0.0], ends @ [*along, 0.0]]), axis=0)
    low, high = np.sort(np.stack([starts[:, 2], ends[:, 2]]), axis=0)
    beside = (left < hole.right + _CLEAR) & (right > hole.left - _CLEAR)
    if (beside & (low < hole.low) & (high >= hole.low)).any():
        return None
    below = high[beside & (high < hole.low)]
    end = round(max(float(below.max()) + _CLEAR, hole.low - _LONGEST), 3) if len(below) else None
    if end is None or hole.low - end < _LEAST:
        return None
    left, low, right, high = extents.T
    across = (left < hole.right + _CLEAR) & (right > hole.left - _CLEAR)
    hit = across & (low < hole.low - _SAME) & (high > end - _CLEAR)
    return None if hit.any() else end


def _around(run: list[_Hole], foot: list[FloatArray]) -> FloatArray:
    """Ring around holes above one another, clockwise seen from outside from the lower left.

    Args:
        run: The holes, from the lowest to the highest.
        foot: Lower corners of the strip below the lowest, left and right; empty for none.
    """
    up = [hole.ring[:2] for hole in run]
    down = [hole.ring[2:] for hole in reversed(run)]
    return np.concatenate(
        [*(corner[None] for corner in foot[:1]), *up, *down, *(corner[None] for corner in foot[1:])]
    )

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
    found: list[list[FloatArray]] = []
    heights: list[float] = []
    for polygon, normal in enumerate(normals):
        rings = polygons.rings(polygon)
        strips: list[tuple[FloatArray, float]] = []
        if len(rings) > 1 and abs(normal[2]) < 1e-3:
            rings, strips = _cut(rings, np.array([-normal[1], normal[0]]), share, rng)
        found += [rings, *([strip] for strip, _ in strips)]
        heights += [np.nan, *(height for _, height in strips)]
    return _joined(found), np.array(heights)


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
    holes = [_hole(ring, along) for ring in inner]
    whole = [ring for ring, hole in zip(inner, holes, strict=True) if hole is None]
    upright = [hole for hole in holes if hole is not None]
    strips: list[tuple[FloatArray, float]] = []
    for column in _columns(upright):
        lowest = column[0]
        end = _end_below(outer, inner, lowest, along)
        feet: list[list[FloatArray]] = [[]]
        if end is not None and rng.random() < share:
            feet = [[np.array([*corner[:2], end]) for corner in lowest.ring[[0, 3]]]]
            quad = np.stack([feet[0][0], feet[0][1], lowest.ring[3], lowest.ring[0]])
            strips.append((quad, lowest.low))
        runs = [[lowest]]
        for below, above in pairwise(column):
            if _is_free(upright, above, below.high) and rng.random() < share:
                quad = np.stack([below.ring[1], below.ring[2], above.ring[3], above.ring[0]])
                strips.append((quad, above.low))
                runs[-1].append(above)
            else:
                runs.append([above])
        feet += [[]] * (len(runs) - 1)
        whole += [_around(run, foot) for run, foot in zip(runs, feet, strict=True)]
    return [outer, *whole], strips


def _hole(ring: FloatArray, along: FloatArray) -> _Hole | None:
    """The rectangle of a hole, or `None` for other shapes."""
    if len(ring) != 4:
        return None
    x, z = ring[:, :2] @ along, ring[:, 2]
    left, right, low, high = float(x.min()), float(x.max()), float(z.min()), float(z.max())
    first = int(np.argmin(np.hypot(x - left, z - low)))
    x, z = np.roll(x, -first), np.roll(z, -first)
    wanted = np.array([[left, low], [left, high], [right, high], [right, low]])
    if np.abs(np.column_stack([x, z]) - wanted).max() > _SAME:
        return None
    return _Hole(left, low, right, high, np.roll(ring, -first, axis=0))


def _columns(holes: list[_Hole]) -> Iterator[list[_Hole]]:
    """Holes of one place and width, each column from the lowest to the highest."""
    left = sorted(holes, key=lambda hole: (hole.left, hole.low))
    while left:
        first = left[0]
        column = [
            hole
            for hole in left
            if abs(hole.left - first.left) <= _SAME and abs(hole.right - first.right) <= _SAME
        ]
        left = [hole for hole in left if not any(hole is other for other in column)]
        yield sorted(column, key=lambda hole: hole.low)


def _is_free(holes: list[_Hole], above: _Hole, down_to: float) -> bool:
    """True if no other hole reaches into the strip from a sill down to a height."""
    return above.low - down_to >= _LEAST and not any(
        hole.left < above.right + _SAME
        and hole.right > above.left - _SAME
        and hole.low < above.low - _SAME
        and hole.high > down_to + _SAME
        for hole in holes
    )


def _end_below(
    outer: FloatArray, inner: list[FloatArray], hole: _Hole, along: FloatArray
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
    for ring in inner:
        x, z = ring[:, :2] @ along, ring[:, 2]
        across = x.min() < hole.right + _CLEAR and x.max() > hole.left - _CLEAR
        if across and z.min() < hole.low - _SAME and z.max() > end - _CLEAR:
            return None
    return end


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

"""The largest rectangle of a given orientation inside a polygon."""

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray

_SAMPLES = 33
_ROUNDS = 6
_RASTER = 64


def largest_rectangle(polygon: FloatArray) -> tuple[float, float, float, float]:
    """Returns the largest axis-aligned rectangle inside a simple polygon.

    An x-monotone polygon (every convex polygon, and every plot along a smooth road) is solved to
    1e-4 of its width. The rectangle over [a, b] reaches from the maximum of the lower border to the
    minimum of the upper border. Both lie at a, at b or at vertices, so the search covers only a and
    b. Other polygons are searched on a raster, and the best rectangle is then grown to the border.

    Args:
        polygon: N x 2, counter-clockwise, not closed.

    Returns:
        (min x, min y, max x, max y); of zero area if the polygon has no area.
    """
    borders = _borders(polygon)
    if borders is None:
        return _by_raster(polygon)
    lower, upper = borders
    vertices = np.unique(polygon[:, 0])
    left, right = vertices[[0, -1]]
    samples = np.linspace(left, right, _SAMPLES)
    step = samples[1] - samples[0]
    best = (float(left), float(polygon[0, 1]), float(left), float(polygon[0, 1]))
    for _ in range(_ROUNDS):
        best = _best(np.union1d(vertices, samples), lower, upper)
        near = np.linspace(-step, step, _SAMPLES // 2)
        samples = np.concatenate([best[0] + near, best[2] + near]).clip(left, right)
        step = near[1] - near[0]
    return best


def _borders(polygon: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Lower and upper border, each N_i x 2 by ascending x; `None` if the polygon folds back."""
    rolled = np.roll(polygon, -int(np.lexsort((polygon[:, 1], polygon[:, 0]))[0]), axis=0)
    last = int(np.lexsort((rolled[:, 1], rolled[:, 0]))[-1])
    lower, upper = rolled[: last + 1], np.vstack([rolled[last:], rolled[:1]])[::-1]
    if (np.diff(lower[:, 0]) < 0).any() or (np.diff(upper[:, 0]) < 0).any():
        return None
    return lower, upper


def _best(x: FloatArray, lower: FloatArray, upper: FloatArray) -> tuple[float, float, float, float]:
    # At a vertical side the border has two heights; the inner height is that just inside.
    low = np.maximum(*_both_sides(x, lower))
    high = np.minimum(*_both_sides(x, upper))
    start, end = np.triu_indices(len(x))
    lows = np.full((len(x), len(x)), -np.inf)
    highs = np.full((len(x), len(x)), np.inf)
    lows[start, end], highs[start, end] = low[end], high[end]
    bottom = np.maximum.accumulate(lows, axis=1)
    top = np.minimum.accumulate(highs, axis=1)
    width = np.maximum(x[None, :] - x[:, None], 0.0)
    with np.errstate(invalid="ignore"):
        area = np.where(width > 0, width * np.maximum(top - bottom, 0.0), 0.0)
    i, j = np.unravel_index(int(area.argmax()), area.shape)
    if area[i, j] <= 0.0:
        return float(x[0]), float(low[0]), float(x[0]), float(low[0])
    return float(x[i]), float(bottom[i, j]), float(x[j]), float(top[i, j])


def _both_sides(x: FloatArray, border: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Height of a border just left and just right of each x in its range."""
    at = border[:, 0]
    first = np.searchsorted(at, x, side="left")
    last = np.searchsorted(at, x, side="right")
    between: FloatArray = np.interp(x, at, border[:, 1])
    hit = last > first
    lefts, rights = between.copy(), between.copy()
    lefts[hit] = border[first[hit], 1]
    rights[hit] = border[last[hit] - 1, 1]
    # Beyond a vertical first or last side there is no polygon, so that side does not limit.
    lefts[x <= at[0]] = rights[x <= at[0]]
    rights[x >= at[-1]] = lefts[x >= at[-1]]
    return lefts, rights


def _by_raster(polygon: FloatArray) -> tuple[float, float, float, float]:
    shape = shapely.polygons(polygon)
    shapely.prepare(shape)
    low, high = polygon.min(axis=0).tolist(), polygon.max(axis=0).tolist()
    x, y = (np.linspace(low[axis], high[axis], _RASTER + 1) for axis in (0, 1))
    boxes = shapely.box(x[None, :-1], y[:-1, None], x[None, 1:], y[1:, None])
    inside = shapely.covers(shape, boxes)
    row0, row1, column0, column1 = _largest_block(inside)
    if row1 <= row0:
        return float(x[0]), float(y[0]), float(x[0]), float(y[0])
    box = [float(x[column0]), float(y[row0]), float(x[column1]), float(y[row1])]
    for side, step in enumerate((x[0] - x[1], y[0] - y[1], x[1] - x[0], y[1] - y[0])):
        box[side] = _grown(shape, box, side, float(step))
    return box[0], box[1], box[2], box[3]


def _largest_block(inside: np.ndarray[tuple[int, int], np.dtype[np.bool_]]) -> tuple[int, ...]:
    """Rows and columns (first, last + 1) of the largest block of true cells."""
    best, area = (0, 0, 0, 0), 0
    heights = np.zeros(inside.shape[1] + 1, dtype=np.int64)
    for row, cells in enumerate(inside):
        heights[:-1] = (heights[:-1] + 1) * cells
        stack: list[tuple[int, int]] = []
        for column, height in enumerate(heights.tolist()):
            start = column
            while stack and stack[-1][1] >= height:
                start, tall = stack.pop()
                if tall * (column - start) > area:
                    area = tall * (column - start)
                    best = (row + 1 - tall, row + 1, start, column)
            stack.append((start, height))
    return best


def _grown(shape: shapely.Polygon, box: list[float], side: int, step: float) -> float:
    """Outward limit of a side of the box, at most one step away, by bisection."""
    inner, outer = box[side], box[side] + step
    for _ in range(16):
        middle = (inner + outer) / 2
        moved = [*box[:side], middle, *box[side + 1 :]]
        if shapely.covers(shape, shapely.box(*moved)):
            inner = middle
        else:
            outer = middle
    return inner

"""Measures of landuse: agreement of classes and shapes of plots."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import wasserstein_distance

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.models.landuse import LanduseClass

CLASSES = max(LanduseClass) + 1
MATCH = 0.5
"""Least intersection over union of two matched plots; a larger value matches fewer plots."""


def mean_iou(confusion: FloatArray) -> float:
    """Mean intersection over union of the classes that occur in the truth (its rows)."""
    hit = np.diag(confusion)
    union = confusion.sum(0) + confusion.sum(1) - hit
    present = confusion.sum(1) > 0
    return float(np.mean(hit[present] / union[present]))


def confusion_of(
    truth: ByteArray, generated: ByteArray, road: int = LanduseClass.ROAD
) -> FloatArray:
    """Confusion matrix of true (row) and generated (column) class or channel, without the road."""
    hole = truth != road
    pairs = truth[hole].astype(np.int64) * CLASSES + generated[hole]
    counts: FloatArray = np.bincount(pairs, minlength=CLASSES**2).astype(np.float64)
    return counts.reshape(CLASSES, CLASSES)


def plot_shapes(plots: np.ndarray, normals: np.ndarray) -> FloatArray:
    """Area (m²), depth and frontage (m) of the plots that lie wholly in a window, P x 3.

    Depth and frontage are the extents along and across the direction away from the road.

    Args:
        plots: H x W plot numbers, 0 without a plot.
        normals: 2 x H / 2 x W / 2, unit vectors away from the road.
    """
    edge = np.concatenate([plots[0], plots[-1], plots[:, 0], plots[:, -1]])
    row, column = np.nonzero((plots > 0) & ~np.isin(plots, edge))
    numbers, index = np.unique(plots[row, column], return_inverse=True)
    if not len(numbers):
        return np.empty((0, 3))
    counts = np.bincount(index)
    away = normals[:, row // 2, column // 2].astype(np.float64)
    x, y = (np.bincount(index, part) / counts for part in away)
    length = np.maximum(np.hypot(x, y), 1e-9)
    x, y = x[index] / length[index], y[index] / length[index]
    spans = [
        _spans(place, index, len(numbers)) for place in (column * x + row * y, column * y - row * x)
    ]
    return np.column_stack([counts * CELL_SIZE**2, *spans])


def _spans(place: FloatArray, index: np.ndarray, count: int) -> FloatArray:
    """Distance between the first and the last cell of each group, both included, metres."""
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, index, place)
    np.maximum.at(high, index, place)
    spans: FloatArray = (high - low + 1) * CELL_SIZE
    return spans


def matched(truth: np.ndarray, generated: np.ndarray) -> tuple[int, int, int]:
    """Numbers of matched plots (`MATCH`), of true plots, and of generated plots."""
    pairs, counts = np.unique(
        np.stack([truth, generated]).reshape(2, -1), axis=1, return_counts=True
    )
    both = np.all(pairs > 0, axis=0)
    sizes = [np.bincount(plots.ravel()) for plots in (truth, generated)]
    union = sizes[0][pairs[0]] + sizes[1][pairs[1]] - counts
    same = int(np.sum(counts[both] > MATCH * union[both]))
    return same, int(np.count_nonzero(sizes[0][1:])), int(np.count_nonzero(sizes[1][1:]))


def distances(
    truth: Sequence[FloatArray], generated: Sequence[FloatArray]
) -> tuple[float, float, float]:
    """Wasserstein distances of area, depth and frontage; NaN without plots."""
    true, drawn = np.concatenate(truth), np.concatenate(generated)
    if not len(true) or not len(drawn):
        return np.nan, np.nan, np.nan
    area, depth, frontage = (
        wasserstein_distance(*pair) for pair in zip(true.T, drawn.T, strict=True)
    )
    return float(area), float(depth), float(frontage)

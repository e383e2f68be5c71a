"""Statistics of labelled images by class: shares, places, neighbours, colours, edges."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.study.labelled_images import Images
from envgen_usd.study.study_classes import CLASSES, VOID

BANDS = 10
"""Bands of rows and of columns; a larger value shows places more finely."""
_LUMA = np.array([0.2126, 0.7152, 0.0722])
"""Weights of red, green and blue in the luma (ITU-R BT.709)."""
_Values: TypeAlias = NDArray[np.floating[Any]]
_KINDS = len(CLASSES) + 1
"""The classes, and void as the last one."""


@dataclass(frozen=True, eq=False)
class SetStatistics:
    """Statistics of a set of images; NaN where a class does not occur.

    Attributes:
        share: C + 1, share of the pixels of each class; void is last.
        rows: `BANDS` x C + 1, share of the classes in each band of rows, top first.
        columns: `BANDS` x C + 1, the same for columns.
        adjacency: C + 1 x C + 1, share of the borders between two classes, symmetric, sum 1.
        brightness: C, mean luma of the pixels, 0 to 1.
        chroma: C, mean of the largest minus the smallest channel, 0 to 1.
        gradient: C, mean absolute luma difference to the right and lower neighbour of the class.
        colour: C x 3, mean of the channels, 0 to 1.
        deviation: C x 3, standard deviation of the channels.
    """

    share: FloatArray
    rows: FloatArray
    columns: FloatArray
    adjacency: FloatArray
    brightness: FloatArray
    chroma: FloatArray
    gradient: FloatArray
    colour: FloatArray
    deviation: FloatArray


def set_statistics(images: Images) -> SetStatistics:
    """Measures a set of images of one size."""
    kinds = np.where(images.classes == VOID, len(CLASSES), images.classes).astype(np.int64)
    values = images.pictures.astype(np.float32) / 255.0
    luma = values @ _LUMA.astype(np.float32)
    chroma = values.max(3) - values.min(3)
    colour, square = _means(kinds, values), _means(kinds, values**2)
    return SetStatistics(
        share=_shares(kinds),
        rows=_banded(kinds, 1),
        columns=_banded(kinds, 2),
        adjacency=_adjacency(kinds),
        brightness=_means(kinds, luma[..., None])[:, 0],
        chroma=_means(kinds, chroma[..., None])[:, 0],
        gradient=_gradient(kinds, luma),
        colour=colour,
        deviation=np.sqrt(np.maximum(square - colour**2, 0.0)),
    )


def set_distances(first: SetStatistics, second: SetStatistics) -> dict[str, float]:
    """Distances of two sets by statistic.

    Shares are compared by total variation (0 to 1), means by class by their mean absolute
    difference over the classes that both sets have.
    """
    found = {
        "class shares": _variation(first.share, second.share),
        "classes by row": _variation(first.rows, second.rows),
        "classes by column": _variation(first.columns, second.columns),
        "neighbours": _variation(first.adjacency.reshape(-1), second.adjacency.reshape(-1)),
    }
    for name in ("brightness", "chroma", "gradient"):
        gap = np.abs(getattr(first, name) - getattr(second, name))
        found[f"{name} by class"] = float(np.nanmean(gap))
    return found


def _shares(kinds: IntArray) -> FloatArray:
    counts = np.bincount(kinds.reshape(-1), minlength=_KINDS).astype(np.float64)
    shares: FloatArray = counts / max(float(counts.sum()), 1.0)
    return shares


def _banded(kinds: IntArray, axis: int) -> FloatArray:
    return np.stack([_shares(part) for part in np.array_split(kinds, BANDS, axis)])


def _means(kinds: IntArray, values: _Values) -> FloatArray:
    """Mean of the channels (..., K) over the pixels of each class, C x K."""
    counts = np.bincount(kinds.reshape(-1), minlength=_KINDS)[: len(CLASSES)]
    sums = [
        np.bincount(kinds.reshape(-1), values[..., k].reshape(-1), _KINDS)[: len(CLASSES)]
        for k in range(values.shape[-1])
    ]
    with np.errstate(invalid="ignore", divide="ignore"):
        means: FloatArray = np.stack(sums, axis=1) / counts[:, None]
    return means


def _gradient(kinds: IntArray, luma: _Values) -> FloatArray:
    """Differences between neighbours of one class, so that outlines do not count."""
    total, number = np.zeros(len(CLASSES)), np.zeros(len(CLASSES))
    for axis in (1, 2):
        steps = np.abs(np.diff(luma, axis=axis))
        here = np.take(kinds, range(kinds.shape[axis] - 1), axis)
        alike = np.diff(kinds, axis=axis) == 0
        total += np.bincount(here[alike], steps[alike], _KINDS)[: len(CLASSES)]
        number += np.bincount(here[alike], minlength=_KINDS)[: len(CLASSES)]
    with np.errstate(invalid="ignore", divide="ignore"):
        gradient: FloatArray = total / number
    return gradient


def _adjacency(kinds: IntArray) -> FloatArray:
    counts = np.zeros((_KINDS, _KINDS))
    for axis in (1, 2):
        size = kinds.shape[axis]
        here, there = np.take(kinds, range(size - 1), axis), np.take(kinds, range(1, size), axis)
        other = here != there
        pairs = here[other] * _KINDS + there[other]
        counts += np.bincount(pairs, minlength=_KINDS**2).reshape(_KINDS, _KINDS)
    both: FloatArray = counts + counts.T
    both /= max(float(both.sum()), 1.0)
    return both


def _variation(first: FloatArray, second: FloatArray) -> float:
    """Total variation of distributions along the last axis, mean over the others."""
    half: FloatArray = np.abs(first - second).sum(-1) / 2.0
    return float(half.mean())

"""Intervals of scores and of their differences, by bootstrap over seeds and blocks of images.

Two arms are compared on the same seeds and the same images (Efron and Tibshirani 1993, chapter 8;
blocks: Künsch 1989), so that what is hard for both does not widen the interval of the difference.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.seeds import generator
from envgen_usd.study.segmentation_scores import scores

DRAWS = 2000
"""Number of bootstrap draws; a larger value makes the ends of intervals steadier."""
LEVEL = 0.95
"""Share of the draws within an interval."""
FoldCounts = Mapping[str, FloatArray]
"""Name of a fold to confusion matrices, seeds x blocks x C x C."""
Measure = Callable[[FloatArray], FloatArray]
"""Confusion matrices, ... x C x C, to a score, ...."""


@dataclass(frozen=True)
class Interval:
    """A value and its interval."""

    value: float
    low: float
    high: float


def miou(matrices: FloatArray) -> FloatArray:
    """Mean intersection over union of confusion matrices, ... x C x C."""
    return scores(matrices).miou


def interval(counts: FoldCounts, measure: Measure = miou, draws: int = DRAWS) -> Interval:
    """The mean over folds and seeds of a score, and its interval."""
    return _interval(_value(counts, measure), _drawn(counts, measure, draws))


def difference(
    first: FoldCounts, second: FoldCounts, measure: Measure = miou, draws: int = DRAWS
) -> Interval:
    """The first score minus the second one, with its paired interval.

    Args:
        first: Counts of an arm; folds, seeds and blocks as in `second`.
        second: Counts of the other arm.
        measure: The score.
        draws: Number of bootstrap draws.
    """
    value = _value(first, measure) - _value(second, measure)
    return _interval(value, _drawn(first, measure, draws) - _drawn(second, measure, draws))


def _interval(value: float, drawn: FloatArray) -> Interval:
    low, high = np.quantile(drawn, [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0])
    return Interval(value, float(low), float(high))


def _value(counts: FoldCounts, measure: Measure) -> float:
    """Mean over folds of the mean over seeds of the score of all blocks together."""
    return float(np.mean([measure(fold.sum(1)).mean() for fold in counts.values()]))


def _drawn(counts: FoldCounts, measure: Measure, draws: int) -> FloatArray:
    """The value in each draw; the same draws for equal folds, seeds and blocks."""
    total = np.zeros(draws)
    for name, fold in counts.items():
        seeds, blocks = fold.shape[:2]
        chance = generator(0, "study", "bootstrap", name)
        chosen = chance.multinomial(seeds, np.full(seeds, 1.0 / seeds), draws)
        weights = chance.multinomial(blocks, np.full(blocks, 1.0 / blocks), draws)
        for seed in range(seeds):
            sums = np.tensordot(weights.astype(np.float64), fold[seed], axes=(1, 0))
            total += chosen[:, seed] / seeds * measure(sums)
    return total / len(counts)

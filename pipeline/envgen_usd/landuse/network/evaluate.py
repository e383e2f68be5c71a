"""How near generated landuse comes to the rules, with baselines."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy.stats import wasserstein_distance

from envgen_usd.landuse.network.batches import window_of
from envgen_usd.landuse.network.classes import OUTPUTS, ROAD, to_channels
from envgen_usd.landuse.network.fields import RAW, expand
from envgen_usd.landuse.network.generator import Generator, PlainUNet
from envgen_usd.landuse.network.repair import repair
from envgen_usd.landuse.network.samples import Sample, Split, make_sample
from envgen_usd.landuse.network.sampling import PASSES, UNSEEN, Chance, fill, gumbel
from envgen_usd.models.arrays import BoolArray, ByteArray, FloatArray, IntArray
from envgen_usd.seeds import generator

SIZE = 256
"""Cells along a side of an evaluated window."""
_CUT = (126, 126, SIZE)
_BINS = 24

Fill = Callable[[Sample, int], ByteArray]
"""Makes the channels of a window whose whole land is the hole, for a number of a draw."""


@dataclass(frozen=True)
class Score:
    """Figures of one way to make landuse.

    Attributes:
        miou: Mean intersection over union in the hole, over the classes that the truth has.
        best: The same for the best of the draws.
        diversity: 1 - agreement (mIoU) of two draws.
        plot_area: Wasserstein distance of plot areas to the truth's, m².
        repaired: Share of cells that repair changes, border lines apart.
    """

    miou: float
    best: float
    diversity: float
    plot_area: float
    repaired: float


def mean_iou(confusion: FloatArray) -> float:
    """Mean intersection over union of the classes that occur in the truth (its rows)."""
    hit = np.diag(confusion)
    union = confusion.sum(0) + confusion.sum(1) - hit
    present = confusion.sum(1) > 0
    return float(np.mean(hit[present] / union[present]))


def confusion_of(truth: ByteArray, made: ByteArray) -> FloatArray:
    """Cells by true (row) and made (column) output channel, without the road."""
    hole = truth != ROAD
    pairs = (truth[hole].astype(np.int64) - 1) * OUTPUTS + made[hole] - 1
    counts: FloatArray = np.bincount(pairs, minlength=OUTPUTS**2).astype(np.float64)
    return counts.reshape(OUTPUTS, OUTPUTS)


def evaluation_windows(split: Split, count: int, seed: int, again: int = 0) -> list[Sample]:
    """Middle windows of the first samples of a split; `again` draws the rules anew."""
    return [window_of(make_sample(split, n, seed, again), *_CUT) for n in range(count)]


def score(windows: Sequence[Sample], make: Fill, draws: int) -> Score:
    """Measures one way to make landuse on full holes; figures are pooled over windows."""
    confusions = np.zeros((draws, OUTPUTS, OUTPUTS))
    between = np.zeros((OUTPUTS, OUTPUTS))
    best, areas, true_areas, changed = np.zeros((OUTPUTS, OUTPUTS)), [], [], []
    for window in windows:
        made = [make(window, draw) for draw in range(draws)]
        each = np.stack([confusion_of(window.channels, one) for one in made])
        confusions += each
        best += each[int(np.argmax([mean_iou(one) for one in each]))]
        between += confusion_of(made[0], made[-1])
        classes, plots = repair(made[0])
        mended = to_channels(classes, plots)
        changed.append(np.mean((mended != made[0]) & ~_near_line(mended, made[0])))
        areas += _areas(plots)
        true_areas += _areas(window.plots)
    distance = wasserstein_distance(areas, true_areas) if areas and true_areas else np.nan
    return Score(
        mean_iou(confusions.sum(0)),
        mean_iou(best),
        1 - mean_iou(between) if draws > 1 else 0.0,
        float(distance),
        float(np.mean(changed)),
    )


def by_network(network: Generator | PlainUNet, passes: Sequence[float] = PASSES) -> Fill:
    """Landuse by a trained network."""

    def make(window: Sample, draw: int) -> ByteArray:
        rng = generator(draw, "landuse", "evaluate", int(window.classes.sum()))
        shape = window.classes.shape
        chance = Chance(
            rng.random((1, *shape), dtype=np.float32),
            gumbel(rng, shape)[None],
            [int(rng.integers(2**31))],
            passes,
        )
        channels = np.where(window.channels == ROAD, np.uint8(ROAD), np.uint8(UNSEEN))[None]
        fields = expand(torch.from_numpy(window.raw[None]))
        condition = torch.from_numpy(window.condition[None])
        filled = fill(network, channels, fields, condition, chance)
        return np.asarray(filled[0], dtype=np.uint8)

    return make


def by_majority(training: Sequence[Sample]) -> Fill:
    """The most frequent class everywhere."""
    counts = sum(np.bincount(s.channels.ravel(), minlength=OUTPUTS + 1) for s in training)
    most = np.uint8(1 + np.argmax(np.asarray(counts)[1:]))
    return lambda window, _: np.where(window.channels == ROAD, np.uint8(ROAD), most)


def by_distance(training: Sequence[Sample]) -> Fill:
    """The most frequent class at each offset from the roadside, in plots of middle depth."""
    counts = np.zeros((2, _BINS, OUTPUTS + 1))
    for sample in training:
        np.add.at(counts[_ground(sample)], (_bins(sample), sample.channels), 1)
    most = (1 + np.argmax(counts[..., 1:], axis=-1)).astype(np.uint8)

    def make(window: Sample, _: int) -> ByteArray:
        found = most[_ground(window), _bins(window)]
        return np.where(window.channels == ROAD, np.uint8(ROAD), found)

    return make


def table(scores: Mapping[str, Score]) -> str:
    """Scores as a Markdown table."""
    head = "| | mIoU | best | diversity | plot area, m² | repaired |\n|---|---|---|---|---|---|\n"
    return head + "\n".join(
        f"| {name} | {s.miou:.3f} | {s.best:.3f} | {s.diversity:.3f} | {s.plot_area:.0f} | "
        f"{100 * s.repaired:.1f} % |"
        for name, s in scores.items()
    )


def _ground(sample: Sample) -> int:
    return int(sample.condition[-1] > 0)


def _bins(sample: Sample) -> IntArray:
    depth = sample.raw[RAW.index("depth")].repeat(2, 0).repeat(2, 1)
    bins: IntArray = np.clip((depth + 0.2) * 12, 0, _BINS - 1).astype(np.int64)
    return bins


def _areas(plots: np.ndarray) -> list[float]:
    """Areas in m² of plots that lie wholly in the window."""
    edge = np.concatenate([plots[0], plots[-1], plots[:, 0], plots[:, -1]])
    counts = np.bincount(plots.ravel())
    whole = [n for n in np.flatnonzero(counts) if n and n not in set(edge.tolist())]
    return [float(counts[n]) * (200 / 255) ** 2 for n in whole]


def _near_line(one: ByteArray, other: ByteArray) -> BoolArray:
    """Cells that are a border line in either map."""
    line: BoolArray = (one == OUTPUTS) | (other == OUTPUTS)
    return line

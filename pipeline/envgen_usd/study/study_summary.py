"""What a study found: scores with intervals, gains, equivalent images, replaceable shares."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.study.paired_bootstrap import FoldCounts, Interval, difference, interval
from envgen_usd.study.segmentation_scores import scores
from envgen_usd.study.study_protocol import ALL, Cell, Run, StudyPlan, image_blocks
from envgen_usd.study.study_runs import RunResult, read_result, result_file

BLOCK = 10
"""Neighbouring images that a bootstrap draws together."""
LOSSES = (0.01, 0.05)
"""Losses of mIoU up to which real images count as replaced."""
PLACE = tuple[str, int, float]
"""Arm, size and ratio."""


@dataclass(frozen=True, eq=False)
class Row:
    """An arm at a size and a ratio.

    Attributes:
        arm: Name of the arm.
        size: Number of images, or `ALL`.
        ratio: Share of real images.
        real: Number of different real images, mean over folds.
        synthetic: Number of synthetic images, mean over folds.
        overall: Share of right pixels.
        mean_class: Mean accuracy over the classes.
        miou: Mean intersection over union.
        deviation: Standard deviation of the mIoU over seeds.
        by_fold: mIoU of each fold.
        iou: Intersection over union by class, mean over folds and seeds; NaN where there is none.
        confusion: C x C, sum over folds and seeds.
    """

    arm: str
    size: int
    ratio: float
    real: float
    synthetic: float
    overall: Interval
    mean_class: Interval
    miou: Interval
    deviation: float
    by_fold: Mapping[str, float]
    iou: FloatArray
    confusion: IntArray


@dataclass(frozen=True)
class Comparison:
    """The difference of the mIoU of two arms.

    Attributes:
        first: The arm whose mIoU counts positive.
        second: The other arm, at the same size and ratio, or `ALL_REAL`.
        size: Size of the first arm.
        ratio: Ratio of the first arm.
        real: Number of real images of the first arm, mean over folds.
        gain: Difference of the mIoU.
    """

    first: str
    second: str
    size: int
    ratio: float
    real: float
    gain: Interval


@dataclass(frozen=True)
class Replaceable:
    """The largest share of real images that can go at a loss; NaN if none can.

    Attributes:
        size: Number of images of all real ones.
        loss: Largest loss of mIoU, with 97.5 % confidence.
        mix: Share that synthetic images replace.
        real_only: Share that can be left out without a replacement.
    """

    size: int
    loss: float
    mix: float
    real_only: float


@dataclass(frozen=True, eq=False)
class Summary:
    """What a study found.

    Attributes:
        rows: All arms at all sizes and ratios.
        comparisons: Differences between arms.
        equivalent: Number of real images alone that reach what a mix reaches, by size and ratio;
            None off the measured curve.
        replaceable: Replaceable shares.
        pareto: Places that no other place beats in both mIoU and number of real images.
        seeds: Repetitions that are whole.
        results: Results by run.
    """

    rows: tuple[Row, ...]
    comparisons: tuple[Comparison, ...]
    equivalent: Mapping[tuple[int, float], float | None]
    replaceable: tuple[Replaceable, ...]
    pareto: tuple[PLACE, ...]
    seeds: tuple[int, ...]
    results: Mapping[Run, RunResult]


COMPARED = (
    ("mix", "real_only"),
    ("added", "real_only"),
    ("mix", "oversampled"),
    ("mix", "flat"),
    ("real_only", "plain"),
)
"""Pairs of arms whose difference says something: the first one minus the second one."""
ALL_REAL = "all real"
"""Name of `real_only` with all real images, where an arm of fewer real images is beside it."""


def summarise(plan: StudyPlan, out: Path) -> Summary:
    """Reads the results of all whole repetitions and sums them up.

    Raises:
        EnvgenError: No repetition is whole, or a result cannot be read.
    """
    seeds = whole_seeds(plan, out)
    if not seeds:
        raise EnvgenError(f"{out}: no repetition is whole yet; run the other shards, then again")
    runs = {run for cell, run in plan.cells.items() if cell.seed in seeds}
    results = {run: read_result(out, run) for run in runs}
    counts = _counts(plan, results, seeds)
    rows = tuple(_row(plan, place, counts[place], seeds) for place in counts)
    return Summary(
        rows,
        (*_comparisons(plan, rows, counts), *_beside_all_real(rows, counts)),
        _equivalent(rows),
        _replaceable(counts),
        _pareto(rows),
        seeds,
        results,
    )


def _comparisons(
    plan: StudyPlan, rows: Sequence[Row], counts: Mapping[PLACE, FoldCounts]
) -> list[Comparison]:
    """Differences of arms at the same size and ratio."""
    return [
        Comparison(
            first, second, row.size, row.ratio, row.real,
            difference(counts[first, row.size, row.ratio], counts[second, row.size, row.ratio]),
        )
        for first, second in COMPARED
        for row in rows
        if row.arm == first and (second, row.size, row.ratio) in counts
        and _differ(plan, first, second, row.size, row.ratio)
    ]  # fmt: skip


def _beside_all_real(rows: Sequence[Row], counts: Mapping[PLACE, FoldCounts]) -> list[Comparison]:
    """Arms with synthetic and few real images, minus all real images of the other sequences."""
    whole = counts.get(("real_only", ALL, 1.0))
    if whole is None:
        return []
    return [
        Comparison(
            row.arm, ALL_REAL, row.size, row.ratio, row.real,
            difference(counts[row.arm, row.size, row.ratio], whole),
        )
        for row in rows
        if row.arm in {"mix", "added"} and row.synthetic and (row.size, row.ratio) != (ALL, 1.0)
    ]  # fmt: skip


def whole_seeds(plan: StudyPlan, out: Path) -> tuple[int, ...]:
    """The repetitions of which every run is done."""
    lacking = {cell.seed for cell, run in plan.cells.items() if not result_file(out, run).is_file()}
    return tuple(seed for seed in range(plan.protocol.seeds) if seed not in lacking)


def named_size(size: int) -> str:
    """A size as it is written."""
    return "all" if size == ALL else str(size)


def _counts(
    plan: StudyPlan, results: Mapping[Run, RunResult], seeds: Sequence[int]
) -> dict[PLACE, dict[str, FloatArray]]:
    """Counts of each place by fold: seeds x blocks x C x C."""
    places = dict.fromkeys((cell.arm, cell.size, cell.ratio) for cell in plan.cells)
    return {
        place: {
            fold.name: np.stack(
                [
                    _blocks(plan, results[plan.cells[Cell(*place, fold.name, seed)]], fold.name)
                    for seed in seeds
                ]
            )
            for fold in plan.folds
        }
        for place in places
    }


def _blocks(plan: StudyPlan, result: RunResult, fold: str) -> FloatArray:
    """Counts of the images of a fold, summed by block: blocks x C x C."""
    images = plan.fold(fold).test
    index = {name: number for number, name in enumerate(result.images)}
    rows = [index[f"{image.sequence}/{image.name}"] for image in images]
    blocks = image_blocks(images, BLOCK)
    sums = np.zeros((blocks.max() + 1, *result.counts.shape[1:]))
    np.add.at(sums, blocks, result.counts[rows])
    return sums


def _row(plan: StudyPlan, place: PLACE, counts: FoldCounts, seeds: Sequence[int]) -> Row:
    runs = [plan.cells[Cell(*place, fold.name, seeds[0])] for fold in plan.folds]
    by_seed = np.mean([scores(fold.sum(1)).miou for fold in counts.values()], axis=0)
    iou = np.concatenate([scores(fold.sum(1)).iou for fold in counts.values()])
    return Row(
        *place,
        real=float(np.mean([run.real for run in runs])),
        synthetic=float(np.mean([run.synthetic for run in runs])),
        overall=interval(counts, lambda m: scores(m).overall),
        mean_class=interval(counts, lambda m: scores(m).mean_class),
        miou=interval(counts),
        deviation=float(np.std(by_seed, ddof=1)) if len(by_seed) > 1 else 0.0,
        by_fold={k: float(scores(fold.sum(1)).miou.mean()) for k, fold in counts.items()},
        iou=_known_mean(iou),
        confusion=np.sum([fold.sum((0, 1)) for fold in counts.values()], axis=0).astype(np.int64),
    )


def _known_mean(values: FloatArray) -> FloatArray:
    """Mean over the rows of what is a number; NaN where nothing is."""
    known = ~np.isnan(values)
    with np.errstate(invalid="ignore"):
        means: FloatArray = np.where(known, values, 0.0).sum(0) / known.sum(0)
    return means


def _differ(plan: StudyPlan, first: str, second: str, size: int, ratio: float) -> bool:
    """False where two arms are the same runs, e.g. a mix with real images only."""
    fold = plan.folds[0].name
    return plan.cells[Cell(first, size, ratio, fold, 0)] != plan.cells.get(
        Cell(second, size, ratio, fold, 0)
    )


def _equivalent(rows: Sequence[Row]) -> dict[tuple[int, float], float | None]:
    """Inverts the curve of real images alone, made monotone, linear in the logarithm."""
    curve = sorted({(row.real, row.miou.value) for row in rows if row.arm == "real_only"})
    if not curve:
        return {}
    numbers = np.log([number for number, _ in curve])
    heights = np.maximum.accumulate([height for _, height in curve])
    found: dict[tuple[int, float], float | None] = {}
    for row in rows:
        if row.arm == "mix" and row.synthetic:
            value = row.miou.value
            inside = heights[0] <= value <= heights[-1]
            equal = float(np.exp(np.interp(value, heights, numbers)))
            found[row.size, row.ratio] = equal if inside else None
    return found


def _replaceable(counts: Mapping[PLACE, FoldCounts]) -> tuple[Replaceable, ...]:
    sizes = dict.fromkeys(size for _, size, ratio in counts if ratio == 1.0)
    found = []
    for size in sizes:
        whole = counts.get(("mix", size, 1.0)) or counts.get(("real_only", size, 1.0))
        if whole is None:
            continue
        for loss in LOSSES:
            shares = [
                max(
                    (
                        1.0 - ratio
                        for name, n, ratio in counts
                        if name == arm and n == size and ratio < 1.0
                        and difference(counts[name, n, ratio], whole).low >= -loss
                    ),
                    default=float("nan"),
                )
                for arm in ("mix", "real_only")
            ]  # fmt: skip
            found.append(Replaceable(size, loss, *shares))
    return tuple(found)


def _pareto(rows: Sequence[Row]) -> tuple[PLACE, ...]:
    """Places without another one that has at most as many real images and a higher mIoU."""
    return tuple(
        (row.arm, row.size, row.ratio)
        for row in rows
        if not any(other.real <= row.real and other.miou.value > row.miou.value for other in rows)
    )

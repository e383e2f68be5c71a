"""Finds what costs synthetic images most, by training without it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.step_clock import Progress
from envgen_usd.study.counterfactuals import Counterfactual, counterfactuals
from envgen_usd.study.labelled_images import Images, LabelledImage, decoded
from envgen_usd.study.learners import Lesson
from envgen_usd.study.paired_bootstrap import Interval, difference, interval
from envgen_usd.study.segmentation_scores import scores
from envgen_usd.study.set_statistics import SetStatistics, set_statistics
from envgen_usd.study.study_folder import RUNS, open_folder
from envgen_usd.study.study_protocol import image_blocks
from envgen_usd.study.study_summary import BLOCK
from envgen_usd.study.training_exercise import Exercise, carry_exercise_out, read_counts
from envgen_usd.study.training_options import TrainingOptions

BASELINE = "baseline"


@dataclass(frozen=True, eq=False)
class Cause:
    """What a counterfactual gave.

    Attributes:
        counterfactual: The change.
        gain: mIoU with the change minus mIoU without it.
        iou: C, gain of each class; NaN where the real images have none.
        confusion: C x C, sum over seeds, with the change.
    """

    counterfactual: Counterfactual
    gain: Interval
    iou: FloatArray
    confusion: IntArray


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What costs most.

    Attributes:
        baseline: mIoU of synthetic images alone.
        iou: C, of the baseline.
        confusion: C x C, of the baseline, sum over seeds.
        causes: The counterfactuals, the largest gain first.
        real: Statistics of the real images.
        synthetic: Statistics of the synthetic images.
    """

    baseline: Interval
    iou: FloatArray
    confusion: IntArray
    causes: tuple[Cause, ...]
    real: SetStatistics
    synthetic: SetStatistics


def diagnose(  # noqa: PLR0913 - what a diagnosis follows from
    real: Sequence[LabelledImage],
    synthetic: Sequence[LabelledImage],
    options: TrainingOptions,
    out: Path,
    *,
    seeds: int = 1,
    progress: Progress = lambda *_: None,
) -> Diagnosis:
    """Trains on synthetic images alone, as they are and changed, and scores on all real ones.

    The changes use statistics and labels of the real images, so their scores are no results: they
    say what a fault costs. A second call goes on where the first one stopped.

    Args:
        real: Real images.
        synthetic: Synthetic images.
        options: How networks are trained.
        out: Folder of the diagnosis.
        seeds: Number of repetitions.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: The folder holds another diagnosis, an image cannot be read, or a training
            failed.
    """
    open_folder(out, options, (*real, *synthetic))
    photographs, frames = decoded(real, options.size), decoded(synthetic, options.size)
    changes = [
        Counterfactual(BASELINE, "as they are"),
        *counterfactuals(photographs, frames, light=not options.augmentation.light),
    ]
    counts: dict[str, FloatArray] = {}
    for number, change in enumerate(changes):
        progress("train", number * seeds, len(changes) * seeds)
        runs = []
        for seed in range(seeds):
            path = out / RUNS / f"{change.name}_seed{seed}.json"
            if not path.is_file():
                carry_exercise_out(_exercise(change, frames, real, options, seed), path)
            runs.append(_blocks(real, read_counts(path)))
            progress("train", number * seeds + seed + 1, len(changes) * seeds)
        counts[change.name] = np.stack(runs)
    base = {"all": counts[BASELINE]}
    causes = [
        Cause(
            change,
            difference({"all": counts[change.name]}, base),
            _iou(counts[change.name]) - _iou(base["all"]),
            counts[change.name].sum((0, 1)).astype(np.int64),
        )
        for change in changes[1:]
    ]
    return Diagnosis(
        interval(base),
        _iou(base["all"]),
        base["all"].sum((0, 1)).astype(np.int64),
        tuple(sorted(causes, key=lambda cause: -cause.gain.value)),
        set_statistics(photographs),
        set_statistics(frames),
    )


def _exercise(
    change: Counterfactual,
    frames: Images,
    real: Sequence[LabelledImage],
    options: TrainingOptions,
    seed: int,
) -> Exercise:
    if change.light:
        options = replace(options, augmentation=replace(options.augmentation, light=True))
    lesson = Lesson(
        decoded((), options.size),
        change.train(frames) if change.train else frames,
        decoded((), options.size).pictures,
        seed,
        augmented=True,
        steps=options.iterations,
    )
    return Exercise(lesson, options, tuple(real), {"change": change.name}, change.test)


def _iou(counts: FloatArray) -> FloatArray:
    """Intersection over union by class, mean over seeds, of seeds x blocks x C x C."""
    means: FloatArray = scores(counts.sum(1)).iou.mean(0)
    return means


def _blocks(images: Sequence[LabelledImage], counts: IntArray) -> FloatArray:
    numbers = image_blocks(images, BLOCK)
    sums = np.zeros((numbers.max() + 1, *counts.shape[1:]))
    np.add.at(sums, numbers, counts)
    return sums

"""The protocol of a study: which networks are trained on which images, and compared with which."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Literal

import numpy as np

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import IntArray
from envgen_usd.seeds import generator
from envgen_usd.study.labelled_images import LabelledImage, images_digest
from envgen_usd.study.training_options import TrainingOptions

ALL = 0
"""A size that stands for all real images of the training sequences."""
Arm = Literal["mix", "real_only", "oversampled", "flat", "plain", "added"]
ARMS: Mapping[str, str] = {
    "mix": "r N real and (1 - r) N synthetic images",
    "real_only": "the same r N real images alone",
    "oversampled": "the same r N real images, repeated to N",
    "flat": "as mix, the synthetic images in a random flat colour for each class and image",
    "plain": "the same r N real images alone, without augmentation of light and framing",
    "added": "the same r N real images, and all synthetic ones",
}
"""The arms of the default protocol, and what each trains on."""
RANDOM_FOLD = "random"
"""Name of the fold of a random split."""
_RANDOM_TEST = 0.2
"""Share of the images that a random split scores on."""
_DIGITS = 8
"""Hexadecimal digits that tell sets of synthetic images apart; more make names longer."""


@dataclass(frozen=True)
class Fold:
    """A split of the real images.

    Attributes:
        name: Names of the sequences that are scored on; `RANDOM_FOLD` for a random split.
        train: Images that networks may train on.
        test: Images of other sequences, which no training sees.
    """

    name: str
    train: tuple[LabelledImage, ...]
    test: tuple[LabelledImage, ...]


@dataclass(frozen=True)
class Protocol:
    """What a study compares.

    Attributes:
        sizes: Numbers N of images of an arm; `ALL` for all real ones.
        ratios: Shares r of real images.
        arms: Names of `ARMS`.
        seeds: Number of repetitions with other subsets, first weights and batches.
        folds: Largest number of folds; sequences are joined to that many.
        random_split: Split images instead of sequences; neighbouring frames then stand on both
            sides, which flatters real images.
    """

    sizes: tuple[int, ...] = (50, 100, ALL)
    ratios: tuple[float, ...] = (1.0, 0.5, 0.25, 0.1, 0.05, 0.0)
    arms: tuple[str, ...] = tuple(ARMS)
    seeds: int = 5
    folds: int = 5
    random_split: bool = False


@dataclass(frozen=True)
class Run:
    """One training and its score; what equals in all of this is trained once.

    Attributes:
        fold: Name of the fold; empty for a training without real images, scored on all folds.
        seed: Number of the repetition.
        real: Number of real images.
        repeated: Real images are repeated to this number; 0 leaves them as they are.
        synthetic: Number of synthetic images.
        flat: Synthetic images show a flat colour for each class.
        augmented: Light and framing are augmented as the options say.
        pace: Number of images whose epochs give the steps; 0 where steps are given.
        frames: Digest of all synthetic images; empty without synthetic images.
    """

    fold: str
    seed: int
    real: int
    repeated: int = 0
    synthetic: int = 0
    flat: bool = False
    augmented: bool = True
    pace: int = 0
    frames: str = ""

    @property
    def name(self) -> str:
        """A name that is unique in a study, and usable as a file name."""
        kind = ("flat" if self.flat else "syn") if self.synthetic else ""
        parts = [
            self.fold or "all",
            f"real{self.real}" + (f"x{self.repeated}" if self.repeated else ""),
            f"{kind}{self.synthetic}-{self.frames}" if kind else "",
            "" if self.augmented else "plain",
            f"of{self.pace}" if self.pace else "",
            f"seed{self.seed}",
        ]
        return "_".join(part.replace("/", "-") for part in parts if part)


@dataclass(frozen=True)
class Cell:
    """A place in the table: an arm at a size and a ratio, in a fold with a seed."""

    arm: str
    size: int
    ratio: float
    fold: str
    seed: int


@dataclass(frozen=True, eq=False)
class StudyPlan:
    """Everything that a study does.

    Attributes:
        protocol: What is compared.
        options: How networks are trained, alike in all arms.
        folds: Splits of the real images.
        synthetic: Synthetic images.
        cells: The run of each place in the table.
    """

    protocol: Protocol
    options: TrainingOptions
    folds: tuple[Fold, ...]
    synthetic: tuple[LabelledImage, ...]
    cells: Mapping[Cell, Run] = field(default_factory=dict)

    @property
    def runs(self) -> tuple[Run, ...]:
        """All runs, each once: seed by seed, so that an early stop leaves whole repetitions."""
        unique = dict.fromkeys(self.cells.values())
        return tuple(sorted(unique, key=lambda run: run.seed))

    def fold(self, name: str) -> Fold:
        """The fold of that name."""
        return next(fold for fold in self.folds if fold.name == name)


def make_plan(
    protocol: Protocol,
    options: TrainingOptions,
    real: Sequence[LabelledImage],
    synthetic: Sequence[LabelledImage],
) -> StudyPlan:
    """Lays a study out.

    Raises:
        EnvgenError: An arm is unknown, a size is larger than the data, or there is only one
            sequence.
    """
    unknown = [arm for arm in protocol.arms if arm not in ARMS]
    if unknown:
        raise EnvgenError(f"--arms {unknown[0]}: unknown; choose from {', '.join(ARMS)}")
    if not all(0.0 <= ratio <= 1.0 for ratio in protocol.ratios):
        raise EnvgenError("--ratios: shares of real images are from 0 to 1")
    folds = _random_fold(real) if protocol.random_split else _sequence_folds(real, protocol.folds)
    digest = images_digest(synthetic)[:_DIGITS]
    cells: dict[Cell, Run] = {}
    sizes, ratios = dict.fromkeys(protocol.sizes), dict.fromkeys(protocol.ratios)
    for fold, size, ratio in product(folds, sizes, ratios):
        count = _checked_size(size, ratio, fold, len(synthetic), protocol)
        for seed in range(protocol.seeds):
            runs = _runs(protocol, fold.name, ratio, count, seed, len(synthetic))
            for arm, run in runs.items():
                cell = Cell(arm, size, ratio, fold.name, seed)
                cells[cell] = _completed(run, count, digest, options)
    return StudyPlan(protocol, options, folds, tuple(synthetic), cells)


def nested_subset(
    images: Sequence[LabelledImage], count: int, seed: int, *names: str
) -> tuple[LabelledImage, ...]:
    """The first images of an order that only the seed gives, so that small subsets lie in large.

    Args:
        images: Images to choose from.
        count: Size of the subset.
        seed: Number of the repetition.
        names: What the subset is for; other names give another order.
    """
    order = generator(seed, "study", *names).permutation(len(images))[:count]
    return tuple(images[index] for index in order.tolist())


def run_images(
    plan: StudyPlan, run: Run
) -> tuple[tuple[LabelledImage, ...], tuple[LabelledImage, ...]]:
    """The real and the synthetic images of a run."""
    train = plan.fold(run.fold).train if run.fold else ()
    real = nested_subset(train, run.real, run.seed, "real", run.fold)
    synthetic = nested_subset(plan.synthetic, run.synthetic, run.seed, "synthetic")
    if run.repeated and real:
        real = tuple(real[index % len(real)] for index in range(run.repeated))
    return real, synthetic


def scored_images(plan: StudyPlan, run: Run) -> tuple[LabelledImage, ...]:
    """The images that a run is scored on: of its fold, or of all folds."""
    if run.fold:
        return plan.fold(run.fold).test
    return tuple(image for fold in plan.folds for image in fold.test)


def _runs(  # noqa: PLR0913, PLR0917 - a place in the table
    protocol: Protocol, fold: str, ratio: float, count: int, seed: int, synthetic: int
) -> dict[str, Run]:
    """The run of each arm that has images at a size and a ratio."""
    real = round(ratio * count)
    rest = count - real
    runs = {
        "mix": Run(fold, seed, real, synthetic=rest),
        "real_only": Run(fold, seed, real),
        "oversampled": Run(fold, seed, real, repeated=count if rest else 0),
        "flat": Run(fold, seed, real, synthetic=rest, flat=rest > 0),
        "plain": Run(fold, seed, real, augmented=False),
        "added": Run(fold, seed, real, synthetic=synthetic),
    }
    result = {}
    for arm in protocol.arms:
        run = runs[arm]
        if run.real or run.synthetic:
            result[arm] = run
    return result


def _completed(run: Run, count: int, digest: str, options: TrainingOptions) -> Run:
    """A run with what follows from the options and from all synthetic images."""
    if run.synthetic:
        run = replace(run, frames=digest)
    if options.epochs:
        run = replace(run, pace=count)
    if not run.real and options.adaptation == "none":
        run = replace(run, fold="")
    return run


def _checked_size(size: int, ratio: float, fold: Fold, synthetic: int, protocol: Protocol) -> int:
    """The number of images of a size in a fold."""
    count = len(fold.train) if size == ALL else size
    real = round(ratio * count)
    if real > len(fold.train):
        raise EnvgenError(
            f"--sizes {size}: fold {fold.name} has {len(fold.train)} real images to train on, and"
            f" ratio {ratio:g} needs {real}; give a smaller size, or 'all'"
        )
    drawn = {"mix", "flat"} & set(protocol.arms)
    if drawn and count - real > synthetic:
        named = "all" if size == ALL else size
        raise EnvgenError(
            f"--sizes {named}: ratio {ratio:g} needs {count - real} synthetic images in fold"
            f" {fold.name}, and there are {synthetic}; render more, or give a smaller size"
        )
    return count


def _sequence_folds(images: Sequence[LabelledImage], most: int) -> tuple[Fold, ...]:
    """A fold for each sequence; many sequences are joined, the longest first, to even groups."""
    sizes: dict[str, int] = {}
    for image in images:
        sizes[image.sequence] = sizes.get(image.sequence, 0) + 1
    if len(sizes) < 2:
        only = next(iter(sizes), "none")
        raise EnvgenError(
            f"the real images are of one sequence ({only}), and none is left to score on; give"
            " more sequences, or --split random"
        )
    groups: list[list[str]] = [[] for _ in range(min(most, len(sizes)))]
    for name in sorted(sizes, key=lambda n: (-sizes[n], n)):
        least = min(groups, key=lambda group: sum(sizes[n] for n in group))
        least.append(name)
    return tuple(
        Fold(
            "+".join(sorted(group)),
            tuple(image for image in images if image.sequence not in group),
            tuple(image for image in images if image.sequence in group),
        )
        for group in sorted(groups)
    )


def _random_fold(images: Sequence[LabelledImage]) -> tuple[Fold, ...]:
    order = generator(0, "study", "random split").permutation(len(images))
    tested = set(order[: max(round(_RANDOM_TEST * len(images)), 1)].tolist())
    train = tuple(image for n, image in enumerate(images) if n not in tested)
    return (Fold(RANDOM_FOLD, train, tuple(images[n] for n in sorted(tested))),)


def image_blocks(images: Sequence[LabelledImage], length: int) -> IntArray:
    """Number of the block of each image: `length` neighbours of one sequence.

    Neighbouring frames are alike, so that a bootstrap draws blocks, not frames.
    """
    numbers = np.zeros(len(images), np.int64)
    block, start = -1, 0
    for n, image in enumerate(images):
        if n == 0 or image.sequence != images[n - 1].sequence or n - start >= length:
            block, start = block + 1, n
        numbers[n] = block
    return numbers

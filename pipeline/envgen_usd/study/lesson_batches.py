"""Batches of real and synthetic images."""

from collections.abc import Iterator

import numpy as np
import torch

from envgen_usd.models.array_types import ByteArray, FloatArray, IntArray
from envgen_usd.study.domain_adaptation import colours_of, with_amplitudes, with_colours
from envgen_usd.study.labelled_images import Images
from envgen_usd.study.learners import Lesson
from envgen_usd.study.picture_augmentation import Augmentation, augmented
from envgen_usd.study.study_classes import CLASSES
from envgen_usd.study.training_options import ADAPTATIONS, WEIGHTS, TrainingOptions

_RAREST = 1e-3
"""Least share of a class for weights; a smaller value gives rare classes larger weights."""
Batch = tuple[torch.Tensor, torch.Tensor]
"""Pictures, B x 3 x H x W, 0 to 1; classes, B x H x W."""


class Batches:
    """Batches of a lesson, the same for the same seed and kind of device.

    All images and the order of all steps lie on the device, and nothing is asked back from it, so
    that a GPU can repeat a step without Python.
    """

    def __init__(self, lesson: Lesson, options: TrainingOptions, device: torch.device) -> None:
        """Args: images, how they are drawn and changed, and where the batches are wanted."""
        adapts = len(lesson.unlabelled) and len(lesson.synthetic)
        self._way = options.adaptation if adapts else "none"
        self.draws = torch.Generator(device).manual_seed(lesson.seed)
        choice = options.augmentation
        self._choice = choice if lesson.augmented else Augmentation(flip=choice.flip)
        both = [lesson.synthetic, lesson.real]
        self._pictures = _tensor([images.pictures for images in both]).to(device)
        self._classes = torch.from_numpy(np.concatenate([i.classes for i in both])).to(device)
        self._rows = torch.from_numpy(_rows(lesson, options)).to(device)
        self._synthetic = len(lesson.synthetic)
        self._unlabelled = _tensor([lesson.unlabelled]).to(device)
        if self._way == ADAPTATIONS[1]:
            self._own = colours_of(self._pictures[: self._synthetic])
            self._other = colours_of(self._unlabelled)

    def at(self, step: torch.Tensor) -> Batch:
        """The batch of a step, whose number is the only value of `step`, on the device."""
        rows = self._rows.index_select(0, step)[0]
        pictures = self._pictures.index_select(0, rows).float() / 255.0
        classes = self._classes.index_select(0, rows).long()
        if self._way != "none":
            synthetic = (rows < self._synthetic)[:, None, None, None]
            pictures = torch.where(synthetic, self._adapted(rows, pictures), pictures)
        return augmented(pictures, classes, self._choice, self.draws)

    def _adapted(self, rows: torch.Tensor, pictures: torch.Tensor) -> torch.Tensor:
        """Pictures adapted to real ones; what real pictures would be does not matter."""
        device, count = pictures.device, len(self._unlabelled)
        chosen = torch.randint(count, (len(pictures),), generator=self.draws, device=device)
        if self._way == ADAPTATIONS[1]:
            own = self._own.chosen(rows.clamp_max(self._synthetic - 1))
            return with_colours(pictures, own, self._other.chosen(chosen))
        return with_amplitudes(pictures, self._unlabelled.index_select(0, chosen).float() / 255.0)


def class_weights(way: str, *sets: Images) -> torch.Tensor:
    """Weights of the classes in the loss, with a mean of 1 over the pixels.

    Args:
        way: One of `training_options.WEIGHTS`.
        sets: All training images.
    """
    if way == WEIGHTS[0]:
        return torch.ones(len(CLASSES))
    counts = np.sum([_class_counts(images).sum(0) for images in sets], axis=0)
    shares = np.maximum(counts / max(counts.sum(), 1.0), _RAREST)
    power = {"root": -0.5, "inverse": -1.0}[way]
    weights = shares**power
    return torch.from_numpy(weights / (weights * shares).sum() * shares.sum()).float()


def _rows(lesson: Lesson, options: TrainingOptions) -> IntArray:
    """Numbers of the images of each step, steps x batch; real ones follow the synthetic ones."""
    chance = np.random.default_rng(lesson.seed)
    orders = [
        _order(images, first, chance, balanced=options.balanced)
        for images, first in ((lesson.synthetic, 0), (lesson.real, len(lesson.synthetic)))
    ]
    rows = [
        [next(order) for order, count in zip(orders, counts, strict=True) for _ in range(count)]
        for counts in _counts(lesson, options)
    ]
    return np.array(rows, np.int64)


def _counts(lesson: Lesson, options: TrainingOptions) -> Iterator[tuple[int, int]]:
    """Numbers of synthetic and of real images of each step."""
    size, real, synthetic = options.batch, len(lesson.real), len(lesson.synthetic)
    share = real / max(real + synthetic, 1)
    for step in range(lesson.steps):
        if not (real and synthetic):
            count = size if real else 0
        elif options.schedule == "finetune":
            count = 0 if step < lesson.steps // 2 else size
        elif options.batches == "even":
            count = size // 2
        else:
            # The same sum over steps as drawing from all images, without its scatter.
            count = int((step + 1) * size * share) - int(step * size * share)
        yield size - count, count


def _rarity(images: Images) -> FloatArray:
    """Chance of each image to be drawn: higher, the more it has of rare classes."""
    counts = _class_counts(images)
    shares = counts / np.maximum(counts.sum(1, keepdims=True), 1.0)
    weights: FloatArray = (shares / np.maximum(shares.mean(0), _RAREST)).sum(1) + _RAREST
    weights /= weights.sum()
    return weights


def _class_counts(images: Images) -> FloatArray:
    """Pixels of each class in each image, N x C."""
    return np.stack(
        [(images.classes == value).sum((1, 2)) for value in range(len(CLASSES))], axis=1
    ).astype(np.float64)


def _order(
    images: Images, first: int, chance: np.random.Generator, *, balanced: bool
) -> Iterator[int]:
    """Numbers from `first` on: passes in random orders; balanced: draws with replacement."""
    count, weights = len(images), _rarity(images) if balanced and len(images) else None
    while True:
        if weights is None:
            yield from (first + chance.permutation(count)).tolist()
        else:
            yield from (first + chance.choice(count, count, p=weights)).tolist()


def _tensor(sets: list[ByteArray]) -> torch.Tensor:
    """Pictures of N x H x W x 3 as one tensor, N x 3 x H x W."""
    return torch.from_numpy(np.ascontiguousarray(np.moveaxis(np.concatenate(sets), 3, 1)))

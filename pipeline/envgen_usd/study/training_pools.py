"""Batches of real and synthetic images."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch

from envgen_usd.models.array_types import FloatArray
from envgen_usd.study.domain_adaptation import adapted
from envgen_usd.study.labelled_images import Images
from envgen_usd.study.learners import Lesson
from envgen_usd.study.picture_augmentation import Augmentation, augmented
from envgen_usd.study.study_classes import CLASSES
from envgen_usd.study.training_options import TrainingOptions

_RAREST = 1e-3
"""Least share of a class for weights; a smaller value gives rare classes larger weights."""
Batch = tuple[torch.Tensor, torch.Tensor]
"""Pictures, B x 3 x H x W, 0 to 1; classes, B x H x W."""


@dataclass(frozen=True, eq=False)
class _Pool:
    """Images as tensors, and the order in which they come."""

    pictures: torch.Tensor
    classes: torch.Tensor
    order: Iterator[int]
    synthetic: bool

    def draw(self, count: int) -> Batch:
        """The next images: pictures 0 to 1, and classes."""
        indices = [next(self.order) for _ in range(count)]
        return self.pictures[indices].float() / 255.0, self.classes[indices].long()


class Batches:
    """Batches of a lesson, the same for the same seed."""

    def __init__(self, lesson: Lesson, options: TrainingOptions, device: torch.device) -> None:
        """Args: images, how they are drawn and changed, and where the batches are wanted."""
        self._lesson, self._options, self._device = lesson, options, device
        self._draws = torch.Generator().manual_seed(lesson.seed)
        self._chance = np.random.default_rng(lesson.seed)
        choice = options.augmentation
        self._choice = choice if lesson.augmented else Augmentation(flip=choice.flip)
        self._unlabelled = _channels_first(lesson.unlabelled)
        self._pools = [
            self._pool(images, synthetic)
            for images, synthetic in ((lesson.synthetic, True), (lesson.real, False))
            if len(images)
        ]

    def at(self, step: int) -> Batch:
        """The batch of a step, on the device."""
        parts = [pool.draw(count) for pool, count in self._shares(step) if count]
        synthetic = [pool.synthetic for pool, count in self._shares(step) for _ in range(count)]
        pictures = torch.cat([part[0] for part in parts]).to(self._device)
        classes = torch.cat([part[1] for part in parts]).to(self._device)
        if len(self._unlabelled) and self._options.adaptation != "none":
            pictures = self._with_adaptation(pictures, torch.tensor(synthetic))
        return augmented(pictures, classes, self._choice, self._draws)

    def _shares(self, step: int) -> list[tuple[_Pool, int]]:
        """How many images of a batch each pool gives."""
        size = self._options.batch
        if len(self._pools) < 2:
            return [(pool, size) for pool in self._pools]
        synthetic, real = self._pools
        if self._options.schedule == "finetune":
            first = step < self._lesson.steps // 2
            return [(synthetic if first else real, size)]
        if self._options.batches == "even":
            return [(synthetic, size - size // 2), (real, size // 2)]
        # The same sum over steps as drawing from all images, without its scatter.
        share = len(real.pictures) / (len(real.pictures) + len(synthetic.pictures))
        count = int((step + 1) * size * share) - int(step * size * share)
        return [(synthetic, size - count), (real, count)]

    def _pool(self, images: Images, synthetic: bool) -> _Pool:
        weights = _rarity(images) if self._options.balanced else None
        return _Pool(
            _channels_first(images.pictures),
            torch.from_numpy(images.classes),
            _order(len(images), self._chance, weights),
            synthetic,
        )

    def _with_adaptation(self, pictures: torch.Tensor, synthetic: torch.Tensor) -> torch.Tensor:
        indices = torch.randint(len(self._unlabelled), (len(pictures),), generator=self._draws)
        real = self._unlabelled[indices].float().to(self._device) / 255.0
        changed = adapted(self._options.adaptation, pictures, real)
        return torch.where(synthetic.to(self._device)[:, None, None, None], changed, pictures)


def class_weights(way: str, *sets: Images) -> torch.Tensor:
    """Weights of the classes in the loss, with a mean of 1 over the pixels.

    Args:
        way: One of `training_options.WEIGHTS`.
        sets: All training images.
    """
    counts = np.sum([_class_counts(images).sum(0) for images in sets], axis=0)
    shares = np.maximum(counts / max(counts.sum(), 1.0), _RAREST)
    power = {"none": 0.0, "root": -0.5, "inverse": -1.0}[way]
    weights = shares**power
    return torch.from_numpy(weights / (weights * shares).sum() * shares.sum()).float()


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


def _order(count: int, chance: np.random.Generator, weights: FloatArray | None) -> Iterator[int]:
    """Passes over the images, each in another order; with weights, draws with replacement."""
    while True:
        if weights is None:
            yield from chance.permutation(count).tolist()
        else:
            yield from chance.choice(count, count, p=weights).tolist()


def _channels_first(pictures: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(np.moveaxis(pictures, 3, 1)))

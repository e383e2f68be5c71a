"""How far synthetic images are from real ones, beside how far real sequences are from another."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.errors import EnvgenError
from envgen_usd.study.feature_distance import (
    kernel_distance,
    picture_features,
    scaled,
    train_encoder,
)
from envgen_usd.study.labelled_images import Images, LabelledImage, decoded
from envgen_usd.study.set_statistics import SetStatistics, set_distances, set_statistics
from envgen_usd.study.training_options import TrainingOptions

FEATURES = "features (task KID)"
_LEAST = 4
"""Least number of images of a sequence that is compared."""


@dataclass(frozen=True)
class Distance:
    """A distance of image sets or of towns.

    Attributes:
        name: What is compared.
        synthetic: Distance of synthetic to real: images to each real sequence, in the mean.
        real: Distance of real to real: of each sequence to each other one, in the mean.
    """

    name: str
    synthetic: float
    real: float

    @property
    def ratio(self) -> float:
        """How many times as far as real ones; not a number where real ones do not differ."""
        return self.synthetic / self.real if self.real > 0.0 else float("nan")


@dataclass(frozen=True, eq=False)
class Realism:
    """Distances, and the statistics behind them."""

    distances: tuple[Distance, ...]
    real: SetStatistics
    synthetic: SetStatistics
    sequences: tuple[str, ...]


def measure_realism(
    real: Sequence[LabelledImage], synthetic: Sequence[LabelledImage], options: TrainingOptions
) -> Realism:
    """Compares synthetic images with each real sequence, and these with each other.

    Args:
        real: Real images of at least two sequences.
        synthetic: Synthetic images.
        options: Size of the pictures, and the training of the encoder.

    Raises:
        EnvgenError: Fewer than two sequences have enough images, or an image cannot be read.
    """
    groups: dict[str, list[LabelledImage]] = {}
    for image in real:
        groups.setdefault(image.sequence, []).append(image)
    groups = {name: images for name, images in groups.items() if len(images) >= _LEAST}
    if len(groups) < 2 or len(synthetic) < _LEAST:
        raise EnvgenError(
            f"realism: needs two real sequences and synthetic images, {_LEAST} images each; there"
            f" are {len(groups)} such sequences and {len(synthetic)} synthetic images"
        )
    sets = {name: decoded(images, options.size) for name, images in groups.items()}
    frames = decoded(synthetic, options.size)
    theirs = {name: set_statistics(images) for name, images in sets.items()}
    ours, whole = set_statistics(frames), decoded(real, options.size)
    distances = _statistic_distances(theirs, ours)
    distances.append(_feature_distance(sets, frames, whole, options))
    return Realism(tuple(distances), set_statistics(whole), ours, tuple(sets))


def _statistic_distances(
    theirs: Mapping[str, SetStatistics], ours: SetStatistics
) -> list[Distance]:
    synthetic = [set_distances(ours, each) for each in theirs.values()]
    real = [
        set_distances(first, second)
        for name, first in theirs.items()
        for other, second in theirs.items()
        if name < other
    ]
    return [
        Distance(
            name,
            float(np.mean([each[name] for each in synthetic])),
            float(np.mean([each[name] for each in real])),
        )
        for name in synthetic[0]
    ]


def _feature_distance(
    sets: Mapping[str, Images], frames: Images, whole: Images, options: TrainingOptions
) -> Distance:
    """The encoder learns from all real images, so no sequence is stranger to it than another."""
    network = train_encoder(whole, options)
    names = list(sets)
    features = [picture_features(network, sets[name].pictures) for name in names]
    *features, ours = scaled(
        np.concatenate(features), *features, picture_features(network, frames.pictures)
    )
    synthetic = [kernel_distance(ours, each) for each in features]
    real = [
        kernel_distance(features[a], features[b])
        for a in range(len(names))
        for b in range(a + 1, len(names))
    ]
    return Distance(FEATURES, float(np.mean(synthetic)), float(np.mean(real)))

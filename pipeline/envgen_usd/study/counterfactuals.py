"""Synthetic images as they would be without one of their faults."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray
from envgen_usd.seeds import generator
from envgen_usd.study.labelled_images import Images
from envgen_usd.study.set_statistics import SetStatistics, set_statistics
from envgen_usd.study.study_classes import CLASSES, VOID

_SKY = CLASSES.index("sky")
_SKY_SHARE = 0.02
"""Least share of sky of a real picture whose sky is taken."""
_GREY = 115
"""Value of pixels of void where its content is dropped."""
Change = Callable[[Images], Images]


@dataclass(frozen=True, eq=False)
class Counterfactual:
    """A change of the training images, perhaps also of the test images.

    Attributes:
        name: Name, usable as a file name.
        meaning: What is changed.
        train: Changes synthetic images.
        test: Changes real images; None leaves them.
        light: Light is augmented.
    """

    name: str
    meaning: str
    train: Change | None = None
    test: Change | None = None
    light: bool = False


def counterfactuals(real: Images, synthetic: Images, *, light: bool) -> list[Counterfactual]:
    """The changes that a diagnosis measures.

    Args:
        real: Real images, whose colours and skies are taken.
        synthetic: Synthetic images.
        light: Add the augmentation of light; false if all trainings have it.
    """
    theirs, ours = set_statistics(real), set_statistics(synthetic)
    both = [
        value
        for value in range(len(CLASSES))
        if theirs.share[value] > 0.0 and ours.share[value] > 0.0
    ]
    found = [
        Counterfactual(
            f"colour_{CLASSES[value]}",
            f"{CLASSES[value]} has the mean and the deviation of real colours",
            _recolouring(ours, theirs, [value]),
        )
        for value in both
    ]
    found += [
        Counterfactual(
            "colour_all",
            "every class has the mean and the deviation of real colours",
            _recolouring(ours, theirs, both),
        ),
        Counterfactual(
            "void", "void is grey in synthetic and in real pictures", void_grey, void_grey
        ),
    ]
    skies = _real_skies(real)
    if len(skies.pictures) and _SKY in both:
        found.append(
            Counterfactual(
                "sky", "the sky is that of real pictures", lambda i: _sky_swapped(i, skies)
            )
        )
    if light:
        found.append(Counterfactual("light", "sky, exposure and tone are random", light=True))
    return found


def recoloured(
    images: Images, ours: SetStatistics, theirs: SetStatistics, values: Sequence[int]
) -> Images:
    """Moves the colours of classes to the mean and the deviation of another set, by channel.

    Args:
        images: Images that `ours` was measured on.
        ours: Their statistics.
        theirs: Statistics of the other set.
        values: The classes.
    """
    pictures = images.pictures.copy()
    for value in values:
        factor = theirs.deviation[value] / np.maximum(ours.deviation[value], 1e-3)
        shift = theirs.colour[value] - ours.colour[value] * factor
        where = images.classes == value
        pictures[where] = _bytes(pictures[where] * factor + 255.0 * shift)
    return Images(pictures, images.classes)


def void_grey(images: Images) -> Images:
    """Paints void in one grey."""
    where = images.classes == VOID
    pictures: ByteArray = np.where(where[..., None], np.uint8(_GREY), images.pictures)
    return Images(pictures, images.classes)


def _recolouring(ours: SetStatistics, theirs: SetStatistics, values: list[int]) -> Change:
    return lambda images: recoloured(images, ours, theirs, values)


def _real_skies(real: Images) -> Images:
    """The real images with enough sky."""
    enough = (real.classes == _SKY).mean((1, 2)) >= _SKY_SHARE
    return Images(real.pictures[enough], real.classes[enough])


def _sky_swapped(images: Images, skies: Images) -> Images:
    """Gives each image the sky of a real one: its pixels where both have sky, else their rows."""
    pictures = images.pictures.copy()
    chosen = generator(0, "study", "skies").integers(0, len(skies), len(images))
    for number, source in enumerate(chosen.tolist()):
        sky = skies.classes[source] == _SKY
        filled = _rows_of(skies.pictures[source], sky)
        filled[sky] = skies.pictures[source][sky]
        where = images.classes[number] == _SKY
        pictures[number][where] = _bytes(filled[where])
    return Images(pictures, images.classes)


def _rows_of(picture: ByteArray, sky: BoolArray) -> FloatArray:
    """The mean sky colour of each row, H x W x 3; rows without sky take the nearest row's."""
    counts = sky.sum(1)
    rows = np.flatnonzero(counts)
    means = (picture * sky[..., None]).sum(1)[rows] / counts[rows, None]
    nearest = np.abs(np.arange(len(sky))[:, None] - rows).argmin(1)
    return np.repeat(means[nearest][:, None], sky.shape[1], axis=1)


def _bytes(values: FloatArray) -> ByteArray:
    shown: ByteArray = np.clip(np.rint(values), 0, 255).astype(np.uint8)
    return shown

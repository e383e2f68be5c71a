"""Pictures without looks: a random colour for each class. What still helps is geometry alone."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.models.array_types import ByteArray
from envgen_usd.seeds import generator


def flat_pictures(classes: ByteArray, names: Sequence[str], seed: int) -> ByteArray:
    """Colours each class of each image in a random colour, void too.

    Args:
        classes: N x H x W.
        names: Name of each image.
        seed: Number of the repetition; another one gives other colours.

    Returns:
        N x H x W x 3.
    """
    pictures = np.empty((*classes.shape, 3), np.uint8)
    for number, name in enumerate(names):
        chance = generator(seed, "study", "flat", name, number)
        colours = chance.integers(0, 256, (256, 3), dtype=np.uint8)
        pictures[number] = colours[classes[number]]
    return pictures

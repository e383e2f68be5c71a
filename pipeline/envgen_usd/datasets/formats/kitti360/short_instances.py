"""Instance values of 16 bits, ``id * 1000 + n``, as KITTI-360 has them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import IntArray
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR

FACTOR = 1000
"""Factor of the class id; n is below it."""
MOST = FACTOR - 1
"""Largest n."""


@dataclass(frozen=True)
class ShortInstances:
    """Instance values of a frame in 16 bits.

    Attributes:
        image: H x W, ``id * 1000 + n``; n is 0 for classes without instances in KITTI-360, and for
            objects beyond 999 of a class, for which no number is free.
        table: Value on the stage by the value in `image`, for n above 0.
    """

    image: NDArray[np.uint16]
    table: dict[int, int]


def short_instances(values: NDArray[np.uint32]) -> ShortInstances:
    """Converts the instance image of a frame (H x W); depends on nothing but the frame.

    An object keeps its number on the stage where that is at most 999. Beyond, it takes its number
    modulo 999 unless a larger object of the frame has it, and then the least free number.
    """
    shown, inverse, pixels = np.unique(values, return_inverse=True, return_counts=True)
    ids, numbers = np.divmod(shown.astype(np.int64), INSTANCE_FACTOR)
    separate = [entry.id for entry in labels() if entry.kitti_360_has_instances]
    short = np.zeros(len(shown), np.int64)
    for kind in separate:
        those = np.flatnonzero((ids == kind) & (numbers > 0))
        short[those] = _numbers(numbers[those], pixels[those])
    codes = ids * FACTOR + short
    table = {
        int(code): int(value)
        for code, value, number in zip(codes, shown, short, strict=True)
        if number
    }
    image = codes.astype(np.uint16)[inverse].reshape(values.shape)
    return ShortInstances(image, dict(sorted(table.items())))


def _numbers(numbers: IntArray, pixels: IntArray) -> IntArray:
    """Numbers 1 to 999 for the objects of a class; 0 for those that are too many."""
    short = np.zeros(len(numbers), np.int64)
    # Objects whose number fits come first, then the others from the largest to the smallest.
    order = np.lexsort((numbers, -pixels, numbers > MOST))
    wanted = (numbers[order] - 1) % MOST + 1
    _, first = np.unique(wanted, return_index=True)
    short[order[first]] = wanted[first]
    late = np.setdiff1d(np.arange(len(order)), first)
    free = np.setdiff1d(np.arange(1, MOST + 1), wanted)[: len(late)]
    short[order[late[: len(free)]]] = free
    return short

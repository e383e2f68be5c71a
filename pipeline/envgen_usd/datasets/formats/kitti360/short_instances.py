"""Instance values of 16 bits, ``id * 1000 + n``, as KITTI-360 has them."""

from collections import Counter
from collections.abc import Iterable, Mapping
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


def pixels_of(values: NDArray[np.uint32]) -> dict[int, int]:
    """Number of pixels by instance value of an instance image (H x W)."""
    shown, pixels = np.unique(values, return_counts=True)
    return dict(zip(shown.tolist(), pixels.tolist(), strict=True))


def sequence_numbers(frames: Iterable[Mapping[int, int]]) -> dict[int, int]:
    """The number n of each object of a sequence, the same in all of its frames.

    An object keeps its number on the stage where that is at most 999. Beyond, it takes its number
    modulo 999 unless another object has it, and then the least free number; those that are seen
    in more pixels choose first.

    Args:
        frames: Pixels by instance value, for each frame.

    Returns:
        n by instance value; objects beyond 999 of a class are missing.
    """
    pixels: Counter[int] = Counter()
    for each in frames:
        pixels.update(each)
    values = np.array(sorted(pixels), np.int64)
    counts = np.array([pixels[value] for value in values.tolist()], np.int64)
    ids, numbers = np.divmod(values, INSTANCE_FACTOR)
    found: dict[int, int] = {}
    for kind in separate_ids():
        those = np.flatnonzero((ids == kind) & (numbers > 0))
        short = _numbers(numbers[those], counts[those])
        pairs = zip(values[those].tolist(), short.tolist(), strict=True)
        found |= {value: number for value, number in pairs if number}
    return found


def short_instances(values: NDArray[np.uint32], known: Mapping[int, int]) -> ShortInstances:
    """Converts the instance image of a frame (H x W).

    Args:
        values: Instance values.
        known: Numbers of the sequence's objects. An object without one takes a number that is free
            in the frame, the larger objects first.
    """
    shown, inverse, pixels = np.unique(values, return_inverse=True, return_counts=True)
    ids, numbers = np.divmod(shown.astype(np.int64), INSTANCE_FACTOR)
    short = np.array([known.get(value, 0) for value in shown.tolist()], np.int64)
    for kind in separate_ids():
        late = np.flatnonzero((ids == kind) & (numbers > 0) & (short == 0))
        free = np.setdiff1d(np.arange(1, MOST + 1), short[ids == kind])[: len(late)]
        short[late[np.argsort(-pixels[late], kind="stable")][: len(free)]] = free
    codes = ids * FACTOR + short
    table = {
        int(code): int(value)
        for code, value, number in zip(codes, shown, short, strict=True)
        if number
    }
    image = codes.astype(np.uint16)[inverse].reshape(values.shape)
    return ShortInstances(image, dict(sorted(table.items())))


def separate_ids() -> tuple[int, ...]:
    """Ids of the classes that KITTI-360 separates."""
    return tuple(entry.id for entry in labels() if entry.kitti_360_has_instances)


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

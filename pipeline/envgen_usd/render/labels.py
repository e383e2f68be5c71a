"""Label images from what each pixel shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.labels import label, labels, parts
from envgen_usd.models.arrays import ByteArray
from envgen_usd.render.scene import Thing

MAX_NUMBER = 999
"""Greatest number of an object in the 16-bit coding."""
_FACTOR = 1000


@dataclass(frozen=True)
class LabelImages:
    """Labels of one frame, H x W.

    Attributes:
        semantic: Ids of the classes, 8 bit.
        colour: H x W x 3, colours of the classes.
        instance: ``id * 1000 + n`` in 16 bits as in KITTI-360; n is 0 for classes without
            instances, and for the smallest objects of a class of which more than 999 are seen.
        part: Parts of the classes, 8 bit (`envgen_usd.labels.parts`); 0 where nothing says so.
        objects: For each value of `instance` with n > 0, the prim's path.
        unnumbered: Objects that are seen and have n = 0.
    """

    semantic: ByteArray
    colour: ByteArray
    instance: NDArray[np.uint16]
    part: ByteArray
    objects: dict[int, str]
    unnumbered: int


class LabelPainter:
    """Turns indices of things into label images."""

    def __init__(self, things: Sequence[Thing]) -> None:
        """Looks up the class, the part and the object of each thing."""
        whole: dict[tuple[str, str], int] = {}
        objects = [whole.setdefault((t.label, t.path), i) for i, t in enumerate(things)]
        self._things = things
        self._objects = np.array(objects, np.uint32)
        self._ids = np.array([label(thing.label).id for thing in things], np.uint8)
        self._parts = np.array([parts().get(thing.part, 0) for thing in things], np.uint8)
        self._numbers = np.array([thing.number for thing in things], np.int64)
        self._colours = np.zeros((256, 3), np.uint8)
        for entry in labels():
            self._colours[entry.id] = entry.colour

    def paint(self, things: NDArray[np.uint32]) -> LabelImages:
        """Labels of one frame; `things` is H x W."""
        semantic = self._ids[things]
        pixels = np.zeros(len(self._things), np.int64)
        np.add.at(
            pixels, self._objects, np.bincount(things.reshape(-1), minlength=len(self._things))
        )
        numbers = self._frame_numbers(pixels)
        codes = self._ids.astype(np.int64) * _FACTOR + numbers
        seen = np.flatnonzero((pixels > 0) & (self._numbers > 0))
        named = seen[numbers[seen] > 0]
        return LabelImages(
            semantic=semantic,
            colour=self._colours[semantic],
            instance=codes[self._objects].astype(np.uint16)[things],
            part=self._parts[things],
            objects={int(codes[index]): self._things[index].path for index in named.tolist()},
            unnumbered=len(seen) - len(named),
        )

    def object_ids(self, things: NDArray[np.uint32]) -> NDArray[np.uint32]:
        """Index in the things of the object that each pixel shows, whichever its part; H x W."""
        return self._objects[things]

    def _frame_numbers(self, pixels: NDArray[np.int64]) -> NDArray[np.int64]:
        """Numbers 1 to 999 for the objects of a frame; depends on nothing but the frame.

        An object's number on the stage, modulo 999, is its number in every frame in which no
        larger object claims the same one; then it gets the least that is free.
        """
        numbers = np.zeros(len(pixels), np.int64)
        seen = np.flatnonzero((pixels > 0) & (self._numbers > 0))
        for kind in np.unique(self._ids[seen]).tolist():
            those = seen[self._ids[seen] == kind]
            those = those[np.lexsort((those, -pixels[those]))]
            wanted = (self._numbers[those] - 1) % MAX_NUMBER + 1
            _, first = np.unique(wanted, return_index=True)
            numbers[those[first]] = wanted[first]
            late = np.setdiff1d(np.arange(len(those)), first)
            free = np.setdiff1d(np.arange(1, MAX_NUMBER + 1), wanted)[: len(late)]
            numbers[those[late[: len(free)]]] = free
        return numbers

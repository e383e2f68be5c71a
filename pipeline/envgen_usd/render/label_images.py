"""Label images from the scene object of each pixel."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.label_taxonomy import label, labels, parts
from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.render_scene import SceneObject

MAX_NUMBER = 999
"""Largest object number in the 16-bit coding."""
_FACTOR = 1000


@dataclass(frozen=True)
class LabelImages:
    """Labels of a frame, H x W.

    Attributes:
        semantic: Class ids, 8 bit.
        colour: H x W x 3, colours of the classes.
        instance: ``id * 1000 + n`` in 16 bits as in KITTI-360; n is 0 for classes without
            instances, and for the smallest objects of a class with more than 999 visible objects.
        part: Part ids, 8 bit (`label_taxonomy.parts`); 0 without a part label.
        objects: Prim path for each value of `instance` with n > 0.
        unnumbered: Visible objects with n = 0.
    """

    semantic: ByteArray
    colour: ByteArray
    instance: NDArray[np.uint16]
    part: ByteArray
    objects: dict[int, str]
    unnumbered: int


class LabelPainter:
    """Converts indices of scene objects to label images."""

    def __init__(self, scene_objects: Sequence[SceneObject]) -> None:
        """Looks up the class, the part and the object of each scene object."""
        whole: dict[tuple[str, str], int] = {}
        objects = [whole.setdefault((t.label, t.path), i) for i, t in enumerate(scene_objects)]
        self._scene_objects = scene_objects
        self._objects = np.array(objects, np.uint32)
        self._ids = np.array(
            [label(scene_object.label).id for scene_object in scene_objects], np.uint8
        )
        self._parts = np.array(
            [parts().get(scene_object.part, 0) for scene_object in scene_objects], np.uint8
        )
        self._numbers = np.array([scene_object.number for scene_object in scene_objects], np.int64)
        self._colours = np.zeros((256, 3), np.uint8)
        for entry in labels():
            self._colours[entry.id] = entry.colour

    def paint(self, scene_objects: NDArray[np.uint32]) -> LabelImages:
        """Labels of a frame; `scene_objects` is H x W."""
        semantic = self._ids[scene_objects]
        pixels = np.zeros(len(self._scene_objects), np.int64)
        np.add.at(
            pixels,
            self._objects,
            np.bincount(scene_objects.reshape(-1), minlength=len(self._scene_objects)),
        )
        numbers = self._frame_numbers(pixels)
        codes = self._ids.astype(np.int64) * _FACTOR + numbers
        seen = np.flatnonzero((pixels > 0) & (self._numbers > 0))
        named = seen[numbers[seen] > 0]
        return LabelImages(
            semantic=semantic,
            colour=self._colours[semantic],
            instance=codes[self._objects].astype(np.uint16)[scene_objects],
            part=self._parts[scene_objects],
            objects={
                int(codes[index]): self._scene_objects[index].path for index in named.tolist()
            },
            unnumbered=len(seen) - len(named),
        )

    def object_ids(self, scene_objects: NDArray[np.uint32]) -> NDArray[np.uint32]:
        """Index of the object that each pixel shows, without its parts; H x W."""
        return self._objects[scene_objects]

    def _frame_numbers(self, pixels: NDArray[np.int64]) -> NDArray[np.int64]:
        """Numbers 1 to 999 for the objects of a frame; depends on nothing but the frame.

        An object keeps its stage number, modulo 999, unless a larger object of the frame claims it.
        Otherwise it gets the least free number.
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

"""Label images from the scene object of each pixel."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from envgen_usd.label_taxonomy import label, labels, parts
from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.render_scene import SceneObject

MAX_NUMBER = 999
"""Largest object number in the 16-bit coding."""
_FACTOR = 1000


class LabelImages:
    """Labels of a frame, H x W; each image is computed at its first use."""

    def __init__(self, painter: "LabelPainter", scene_objects: NDArray[np.uint32]) -> None:
        """Takes the index of the scene object at each pixel, H x W."""
        self._painter, self._scene_objects = painter, scene_objects

    @cached_property
    def semantic(self) -> ByteArray:
        """Class ids, 8 bit."""
        return self._painter.ids[self._scene_objects]

    @property
    def colour(self) -> ByteArray:
        """H x W x 3, colours of the classes."""
        return self._painter.colours[self.semantic]

    @property
    def instance(self) -> NDArray[np.uint16]:
        """``id * 1000 + n`` in 16 bits as in KITTI-360.

        n is 0 for classes without instances, and for the smallest objects of a class with more than
        999 visible objects.
        """
        codes = self._numbering.codes[self._painter.objects].astype(np.uint16)
        return codes[self._scene_objects]

    @property
    def part(self) -> ByteArray:
        """Part ids, 8 bit (`label_taxonomy.parts`); 0 without a part label."""
        return self._painter.parts[self._scene_objects]

    @property
    def object_ids(self) -> NDArray[np.uint32]:
        """Index of the object that each pixel shows, without its parts."""
        return self._painter.objects[self._scene_objects]

    @property
    def objects(self) -> dict[int, str]:
        """Prim path for each value of `instance` with n > 0."""
        return self._numbering.paths

    @property
    def unnumbered(self) -> int:
        """Number of visible objects with n = 0."""
        return self._numbering.unnumbered

    @cached_property
    def _numbering(self) -> "_Numbering":
        return self._painter.numbering(self._scene_objects)


@dataclass(frozen=True)
class _Numbering:
    """Instance codes of a frame.

    Attributes:
        codes: Value of each scene object in the instance image.
        paths: Prim path for each code of an object with a number.
        unnumbered: Number of visible objects without a number.
    """

    codes: NDArray[np.int64]
    paths: dict[int, str]
    unnumbered: int


class LabelPainter:
    """Converts indices of scene objects to label images.

    Attributes:
        ids: Class id of each scene object.
        parts: Part id of each scene object.
        objects: For each scene object, the index of the object that it is a part of.
        colours: 256 x 3, colours of the class ids.
    """

    def __init__(self, scene_objects: Sequence[SceneObject]) -> None:
        """Looks up the class, the part and the object of each scene object."""
        whole: dict[tuple[str, str], int] = {}
        objects = [whole.setdefault((t.label, t.path), i) for i, t in enumerate(scene_objects)]
        self._scene_objects = scene_objects
        self.objects = np.array(objects, np.uint32)
        self.ids = np.array(
            [label(scene_object.label).id for scene_object in scene_objects], np.uint8
        )
        self.parts = np.array(
            [parts().get(scene_object.part, 0) for scene_object in scene_objects], np.uint8
        )
        self._numbers = np.array([scene_object.number for scene_object in scene_objects], np.int64)
        self.colours = np.zeros((256, 3), np.uint8)
        for entry in labels():
            self.colours[entry.id] = entry.colour

    def paint(self, scene_objects: NDArray[np.uint32]) -> LabelImages:
        """Labels of a frame; `scene_objects` is H x W."""
        return LabelImages(self, scene_objects)

    def numbering(self, scene_objects: NDArray[np.uint32]) -> _Numbering:
        """Instance codes of a frame; `scene_objects` is H x W."""
        pixels = np.zeros(len(self._scene_objects), np.int64)
        counts = np.bincount(scene_objects.reshape(-1), minlength=len(pixels))
        np.add.at(pixels, self.objects, counts)
        numbers = self._frame_numbers(pixels)
        codes = self.ids.astype(np.int64) * _FACTOR + numbers
        seen = np.flatnonzero((pixels > 0) & (self._numbers > 0))
        named = seen[numbers[seen] > 0]
        paths = {int(codes[index]): self._scene_objects[index].path for index in named.tolist()}
        return _Numbering(codes, paths, len(seen) - len(named))

    def _frame_numbers(self, pixels: NDArray[np.int64]) -> NDArray[np.int64]:
        """Numbers 1 to 999 for the objects of a frame; depends on nothing but the frame.

        An object keeps its stage number, modulo 999, unless a larger object of the frame claims it.
        Otherwise it gets the least free number.
        """
        numbers = np.zeros(len(pixels), np.int64)
        seen = np.flatnonzero((pixels > 0) & (self._numbers > 0))
        for kind in np.unique(self.ids[seen]).tolist():
            those = seen[self.ids[seen] == kind]
            those = those[np.lexsort((those, -pixels[those]))]
            wanted = (self._numbers[those] - 1) % MAX_NUMBER + 1
            _, first = np.unique(wanted, return_index=True)
            numbers[those[first]] = wanted[first]
            late = np.setdiff1d(np.arange(len(those)), first)
            free = np.setdiff1d(np.arange(1, MAX_NUMBER + 1), wanted)[: len(late)]
            numbers[those[late[: len(free)]]] = free
        return numbers

"""Label images from the scene object of each pixel."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from envgen_usd.label_taxonomy import label, labels, parts
from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.render_scene import SceneObject

INSTANCE_FACTOR = 10_000_000
"""Factor of the class id in an instance value; a larger factor has room for more objects of a class
on a stage, and for fewer classes in 32 bits."""


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

    @cached_property
    def instance(self) -> NDArray[np.uint32]:
        """``id * INSTANCE_FACTOR + n``, 32 bit: an object has the same value in all frames.

        n counts the objects of a class over the whole stage from 1; it is 0 for classes without
        instances.
        """
        return self._painter.values[self._scene_objects]

    @property
    def part(self) -> ByteArray:
        """Part ids, 8 bit (`label_taxonomy.parts`); 0 without a part label."""
        return self._painter.parts[self._scene_objects]

    @cached_property
    def objects(self) -> dict[int, str]:
        """Prim path for each value of `instance` with n > 0, by value."""
        seen = np.unique(self.instance).tolist()
        return {value: self._painter.paths[value] for value in seen if value % INSTANCE_FACTOR}


class LabelPainter:
    """Converts indices of scene objects to label images.

    Attributes:
        ids: Class id of each scene object.
        parts: Part id of each scene object.
        values: Instance value of each scene object; parts have that of their object.
        paths: Prim path of each object by its instance value.
        colours: 256 x 3, colours of the class ids.
    """

    def __init__(self, scene_objects: Sequence[SceneObject]) -> None:
        """Looks up the class, the part and the number of each scene object."""
        self.ids = np.array([label(each.label).id for each in scene_objects], np.uint8)
        self.parts = np.array([parts().get(each.part, 0) for each in scene_objects], np.uint8)
        numbers = np.array([each.number for each in scene_objects], np.uint32)
        self.values = self.ids.astype(np.uint32) * np.uint32(INSTANCE_FACTOR) + numbers
        named = zip(self.values.tolist(), scene_objects, strict=True)
        self.paths = {value: each.path for value, each in named if each.number}
        self.colours = np.zeros((256, 3), np.uint8)
        for entry in labels():
            self.colours[entry.id] = entry.colour

    def paint(self, scene_objects: NDArray[np.uint32]) -> LabelImages:
        """Labels of a frame; `scene_objects` is H x W."""
        return LabelImages(self, scene_objects)

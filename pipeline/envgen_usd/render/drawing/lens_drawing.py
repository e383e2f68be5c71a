"""Draws frames of a camera with any lens. Needs a current context for its whole life."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import BoolArray, IntArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.lens_models import Pinhole
from envgen_usd.render.cameras.lens_views import lens_views
from envgen_usd.render.drawing.drawn_frame import Frame, FrameRequest
from envgen_usd.render.drawing.render_passes import FrameRenderer
from envgen_usd.render.drawing.silhouettes import MASK_BITS
from envgen_usd.render.opengl.scene_tiles import Packed
from envgen_usd.render.render_scene import Floats, Scene

_VOID = 1
"""Scene object of pixels outside of the image circle (`Scene.scene_objects`)."""


class Renderer(Protocol):
    """Draws the frames of a pinhole camera."""

    def draw(self, request: FrameRequest) -> Frame:
        """Renders the images of a pose."""

    def silhouettes(self, pose: Pose, slots: NDArray[np.uint32]) -> NDArray[np.uint32]:
        """Masks of the pixels that objects would cover alone; see `Silhouettes.masks`."""


MakeRenderer: TypeAlias = Callable[[Scene, Packed, Camera], Renderer]


class FrameDrawing(Protocol):
    """Draws the frames of a camera."""

    @property
    def inside(self) -> BoolArray | None:
        """H x W, True for pixels within the image circle; `None` for all pixels."""

    def draw(self, request: FrameRequest) -> Frame:
        """Renders the images of a pose."""

    def silhouettes(self, pose: Pose, slots: NDArray[np.uint32]) -> IntArray:
        """Counts the pixels that objects would cover if nothing hid them.

        Args:
            pose: Pose of the camera.
            slots: Number of the object of each scene object, from 1; 0 for those without a count.
        """


def frame_drawing(
    scene: Scene, packed: Packed, camera: Camera, renderer: MakeRenderer = FrameRenderer
) -> FrameDrawing:
    """Uploads a scene for a camera, whatever its lens.

    Raises:
        EnvgenError: The lens shows nothing, or needs too large views.
    """
    if isinstance(camera.lens, Pinhole):
        return _PinholeDrawing(renderer(scene, packed, camera))
    return _LensDrawing(scene, packed, camera, renderer)


class _PinholeDrawing:
    """Frames without a lens: what the renderer draws."""

    inside = None

    def __init__(self, renderer: Renderer) -> None:
        """Sets the renderer."""
        self._renderer = renderer
        self.draw = renderer.draw

    def silhouettes(self, pose: Pose, slots: NDArray[np.uint32]) -> IntArray:
        """Pixels that objects would cover if nothing hid them."""
        masks = self._renderer.silhouettes(pose, slots)
        pixels: IntArray = np.bitwise_count(masks).sum(axis=1, dtype=np.int64)
        return pixels


class _LensDrawing:
    """Frames of a lens, sampled from perspective views."""

    def __init__(
        self, scene: Scene, packed: Packed, camera: Camera, renderer: MakeRenderer
    ) -> None:
        """Places the views and uploads the scene."""
        self._views = lens_views(camera)
        self._renderer = renderer(scene, packed, self._views.camera)

    @property
    def inside(self) -> BoolArray:
        """H x W, True for pixels within the image circle."""
        return self._views.inside

    def draw(self, request: FrameRequest) -> Frame:
        """Renders the views of a pose and takes the pixels of the lens from them.

        Labels and depth are those of the nearest sample, colours a mean in linear light. Outside of
        the image circle there is void, black, and a depth of 0.
        """
        frames = [
            self._renderer.draw(replace(request, pose=self._turned(request.pose, turn)))
            for turn in self._views.turns
        ]
        objects = np.stack([frame.scene_objects for frame in frames]).reshape(-1)
        depth = np.stack([frame.depth for frame in frames]).reshape(-1)
        nearest = self._views.nearest
        radiance = np.empty((0, 0, 3), np.float32)
        if request.colour:
            samples = np.stack([frame.radiance for frame in frames]).reshape(-1, 3)
            radiance = self._placed(self._views.weights @ samples, 0.0)
        return Frame(
            radiance,
            self._placed(objects[nearest], _VOID).astype(np.uint32),
            self._placed(depth[nearest] * self._views.depth_factors, 0.0),
            frames[0].white,
            frames[0].rain,
            self._normals(frames),
            self._bodies(frames),
        )

    def silhouettes(self, pose: Pose, slots: NDArray[np.uint32]) -> IntArray:
        """Pixels that objects would cover if nothing hid them, by the samples of the labels."""
        pixels = np.zeros(int(slots.max(initial=0)), np.int64)
        for turn, (words, bits) in zip(self._views.turns, self._mask_places, strict=True):
            masks = self._renderer.silhouettes(self._turned(pose, turn), slots)
            for number in np.flatnonzero(masks.any(axis=1)):
                pixels[number] += int(((masks[number, words] >> bits) & 1).sum())
        return pixels

    @cached_property
    def _mask_places(self) -> list[tuple[NDArray[np.intp], NDArray[np.uint32]]]:
        """Words and bits of the samples of all pixels in the masks of each view."""
        camera = self._views.camera
        view, place = np.divmod(self._views.nearest, camera.width * camera.height)
        row, column = np.divmod(place, camera.width)
        place = (camera.height - 1 - row) * camera.width + column
        words, bits = place // MASK_BITS, (place % MASK_BITS).astype(np.uint32)
        return [(words[view == n], bits[view == n]) for n in range(len(self._views.turns))]

    def _normals(self, frames: Sequence[Frame]) -> Floats | None:
        """Normals of the nearest samples, from the axes of their views to those of the camera."""
        turned = [
            frame.normals @ turn.T.astype(np.float32)
            for frame, turn in zip(frames, self._views.turns, strict=True)
            if frame.normals is not None
        ]
        if not turned:
            return None
        return self._placed(np.stack(turned).reshape(-1, 3)[self._views.nearest], 0.0)

    def _bodies(self, frames: Sequence[Frame]) -> IntArray | None:
        """Moving bodies of the nearest samples."""
        seen = [frame.bodies for frame in frames if frame.bodies is not None]
        if not seen:
            return None
        bodies = np.full(self._views.inside.shape, -1, np.int64)
        bodies[self._views.inside] = np.stack(seen).reshape(-1)[self._views.nearest]
        return bodies

    @staticmethod
    def _turned(pose: Pose, turn: NDArray[np.float64]) -> Pose:
        matrix = pose.matrix.copy()
        matrix[:3, :3] = matrix[:3, :3] @ turn
        return replace(pose, matrix=matrix)

    def _placed(self, values: Floats | NDArray[np.uint32], outside: float) -> Floats:
        """Image with a value for each pixel inside, and another value outside."""
        inside = self._views.inside
        image = np.full((*inside.shape, *values.shape[1:]), outside, values.dtype)
        image[inside] = values
        return image

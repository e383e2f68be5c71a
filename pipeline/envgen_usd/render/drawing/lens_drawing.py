"""Draws frames of a camera with any lens. Needs a current context for its whole life."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import BoolArray, IntArray
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.lens_models import Pinhole
from envgen_usd.render.cameras.lens_views import lens_views
from envgen_usd.render.drawing.render_passes import Frame, FrameRenderer
from envgen_usd.render.lighting.headlamps import Headlamps
from envgen_usd.render.opengl.scene_tiles import Packed
from envgen_usd.render.render_scene import Floats, Scene

_VOID = 1
"""Scene object of pixels outside of the image circle (`Scene.scene_objects`)."""


class Renderer(Protocol):
    """Draws the frames of a pinhole camera."""

    def draw(
        self,
        pose: Pose,
        atmosphere: Atmosphere | None = None,
        *,
        colour: bool = True,
        normals: bool = False,
        headlamps: Headlamps | None = None,
    ) -> Frame:
        """Renders the images of a pose; see `FrameRenderer.draw`."""

    def silhouettes(self, pose: Pose, slots: NDArray[np.uint32]) -> IntArray:
        """Pixels that objects would cover if nothing hid them."""


MakeRenderer: TypeAlias = Callable[[Scene, Packed, Camera], Renderer]


class FrameDrawing(Renderer, Protocol):
    """Draws the frames of a camera."""

    @property
    def inside(self) -> BoolArray | None:
        """H x W, True for pixels within the image circle; `None` for all pixels."""


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
        self.draw, self.silhouettes = renderer.draw, renderer.silhouettes


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

    def draw(
        self,
        pose: Pose,
        atmosphere: Atmosphere | None = None,
        *,
        colour: bool = True,
        normals: bool = False,
        headlamps: Headlamps | None = None,
    ) -> Frame:
        """Renders the views of a pose and takes the pixels of the lens from them.

        Labels and depth are those of the nearest sample, colours a mean in linear light. Outside of
        the image circle there is void, black, and a depth of 0.
        """
        turned = [self._turned(pose, turn) for turn in self._views.turns]
        frames = [
            self._renderer.draw(
                view, atmosphere, colour=colour, normals=normals, headlamps=headlamps
            )
            for view in turned
        ]
        objects = np.stack([frame.scene_objects for frame in frames]).reshape(-1)
        depth = np.stack([frame.depth for frame in frames]).reshape(-1)
        nearest = self._views.nearest
        radiance = np.empty((0, 0, 3), np.float32)
        if colour:
            samples = np.stack([frame.radiance for frame in frames]).reshape(-1, 3)
            radiance = self._placed(self._views.weights @ samples, 0.0)
        return Frame(
            radiance,
            self._placed(objects[nearest], _VOID).astype(np.uint32),
            self._placed(depth[nearest] * self._views.depth_factors, 0.0),
            frames[0].white,
            frames[0].rain,
            self._normals(frames),
        )

    def silhouettes(self, pose: Pose, slots: NDArray[np.uint32]) -> IntArray:
        """Silhouettes are those of views without a lens."""
        raise NotImplementedError("a lens has no silhouettes; `render_frames` refuses them")

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

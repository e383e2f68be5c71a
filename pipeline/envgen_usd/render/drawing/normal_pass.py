"""Draws the normals of surfaces."""

import numpy as np
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.label_pass import LabelledPixels
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.draw_list import DrawList
from envgen_usd.render.render_scene import Floats

_DEPTH_UNIT = 0


class NormalPass:
    """A render target for normals. Needs a current context for its whole life."""

    def __init__(self, camera: Camera, draws: DrawList) -> None:
        """Creates textures of the camera's size."""
        self._draws = draws
        size = camera.width, camera.height
        self._program = gpu.Program("mesh.vert", "normals.frag", geometry="normals.geom")
        self._target = gpu.render_target(size, (gl.GL_RGBA32F,))
        self._depth = gpu.depth_image(size)

    def draw(self, pose: Pose, clip: FloatArray, pixels: LabelledPixels) -> Floats:
        """Geometric normals of the triangles that pixels show, without interpolation or textures.

        Args:
            pose: Pose of the camera.
            clip: 4 x 4, from positions relative to the camera to clip space; the draw list already
                looks from there.
            pixels: What the camera sees; a gap in a crown is leaves or what lies behind, as its
                depth says.

        Returns:
            H x W x 3, unit vectors towards the camera, along its axes (x right, y down, z ahead);
            0 in the sky.
        """
        self._target.bind()
        gl.glClearBufferfv(gl.GL_COLOR, 0, np.zeros(4, np.float32))
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.zeros(1, np.float32))
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthFunc(gl.GL_GREATER)
        gpu.bind_texture(_DEPTH_UNIT, self._depth)
        gpu.fill_depth_image(pixels.depth)
        self._program.use()
        axes = pose.matrix[:3, :3]
        units = {"labelled_depth": _DEPTH_UNIT, **self._draws.units}
        self._program.set(clip=clip, camera_axes=axes, **units)
        self._draws.draw(pixels.seen, lambda _: None)
        normals: Floats = gpu.read_pixels(self._target, 0, gl.GL_RGB, gl.GL_FLOAT)
        return normals

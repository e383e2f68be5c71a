"""Draws the normals of surfaces."""

import numpy as np
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.label_pass import LabelledPixels
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.draw_list import DrawList
from envgen_usd.render.opengl.shader_looks import CutProgram, Looks
from envgen_usd.render.render_scene import Floats


class NormalPass:
    """A render target for normals. Needs a current context for its whole life."""

    def __init__(self, camera: Camera, draws: DrawList, looks: Looks) -> None:
        """Creates textures of the camera's size."""
        self._draws, self._looks = draws, looks
        self._open, self._closed = (
            CutProgram("mesh.vert", "normals.frag", *names, geometry="normals.geom")
            for names in ((), ("OUTLINES",))
        )
        self._target = gpu.render_target((camera.width, camera.height), (gl.GL_RGBA32F,))

    def draw(self, pose: Pose, clip: FloatArray, pixels: LabelledPixels) -> Floats:
        """Geometric normals of the visible triangles, without interpolation or textures.

        Args:
            pose: Pose of the camera.
            clip: 4 x 4, from positions relative to the camera to clip space; the draw list already
                looks from there.
            pixels: What the camera sees, with the gaps in crowns that count to the crown.

        Returns:
            H x W x 3, unit vectors towards the camera, along its axes (x right, y down, z ahead);
            0 in the sky.
        """
        normals = self._drawn(self._open, pose, clip, pixels.seen)
        if pixels.closed is not None and pixels.closed.any():
            closed = self._drawn(self._closed, pose, clip, pixels.seen)
            normals = np.where(pixels.closed[..., None], closed, normals)
        return normals

    def _drawn(self, programs: CutProgram, pose: Pose, clip: FloatArray, seen: BoolArray) -> Floats:
        self._target.bind()
        gl.glClearBufferfv(gl.GL_COLOR, 0, np.zeros(4, np.float32))
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.zeros(1, np.float32))
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthFunc(gl.GL_GREATER)
        axes = pose.matrix[:3, :3]
        programs.set(clip=clip, camera_axes=axes, **self._looks.units, **self._draws.units)
        self._draws.draw(seen, lambda m: self._looks.set_cut(programs, m), alike=self._looks.alike)
        normals: Floats = gpu.read_pixels(self._target, 0, gl.GL_RGB, gl.GL_FLOAT)
        return normals

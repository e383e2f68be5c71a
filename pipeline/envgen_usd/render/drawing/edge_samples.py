"""Smooths edges: a second sample at the corners of pixels, shaded only where surfaces differ.

Each pixel weighs its centre by a half and its four corners by an eighth, as NVIDIA's Quincunx
(2001). A corner whose four pixels show one flat surface takes their colour.
"""

from dataclasses import replace

import numpy as np
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.label_pass import LabelTarget
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.draw_list import DrawList
from envgen_usd.render.opengl.shader_looks import Looks


class EdgeSamples:
    """Samples at the corners of a camera's pixels."""

    def __init__(self, camera: Camera, draws: DrawList, looks: Looks) -> None:
        """Creates textures with a row and a column more than the image."""
        self.camera = replace(
            camera,
            width=camera.width + 1,
            height=camera.height + 1,
            cx=camera.cx + 0.5,
            cy=camera.cy + 0.5,
        )
        size = self.camera.width, self.camera.height
        self._labels = LabelTarget(size, draws, looks)
        depth = self._labels.target.depth
        self.target = gpu.render_target(size, (gl.GL_RGBA16F,), depth)
        self._depth = gpu.render_target(size, (), depth)
        self._resolved = gpu.render_target((camera.width, camera.height), (gl.GL_RGBA16F,))
        self._inner = gpu.Program("screen.vert", "inner_corners.frag")
        self._mean = gpu.Program("screen.vert", "edge_mean.frag")

    def find(self, pixels: gpu.Target, clip: FloatArray, seen: BoolArray) -> BoolArray:
        """Closes the depth buffer of `target` at all corners that need no sample.

        Args:
            pixels: Labels and depth at the pixels' centres.
            clip: 4 x 4, clip matrix of `camera`.
            seen: N, instances at the pixels' centres.

        Returns:
            N, instances at a corner.
        """
        self._labels.clear()
        self._labels.draw(clip, seen)
        _, at_corners = self._labels.labels()
        self._depth.bind()
        gl.glDepthFunc(gl.GL_ALWAYS)
        labels = (*pixels.colours, *self._labels.target.colours)
        names = ("pixel_labels", "pixel_depth", "corner_labels", "corner_depth")
        self._draw_screen(self._inner, dict(zip(names, labels, strict=True)))
        self.target.bind()
        gl.glClearBufferfv(gl.GL_COLOR, 0, np.zeros(4, np.float32))
        return at_corners

    def resolve(self, pixels: gpu.Target) -> gpu.Target:
        """The weighted mean of the pixels' colours and the corners' colours."""
        self._resolved.bind()
        gl.glDisable(gl.GL_DEPTH_TEST)
        self._draw_screen(
            self._mean, {"centres": pixels.colours[0], "corners": self.target.colours[0]}
        )
        return self._resolved

    def _draw_screen(self, program: gpu.Program, textures: dict[str, int]) -> None:
        program.use()
        for unit, (name, texture) in enumerate(textures.items()):
            gpu.bind_texture(unit, texture)
            program.set(**{name: unit})
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)

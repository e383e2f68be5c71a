"""The share of each pixel that leaves, twigs and poles leave open.

A sample at a pixel's centre shows a twig or it does not. So what covers pixels in part is drawn
apart, in front of the nearest surface that covers whole pixels:
1. Slender things without gaps (poles, stems, bars) mark the samples that they cover.
2. Each surface with gaps leaves a share of a pixel open; these shares multiply in any order. Those
   before a slender thing at the pixel's centre count once more for themselves.
"""

from collections.abc import Sequence

import numpy as np
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.draw_list import DrawList
from envgen_usd.render.opengl.shader_looks import CutProgram, Looks
from envgen_usd.render.render_scene import SceneObject

_SLENDER = frozenset({"vegetation", "pole", "fence", "traffic_sign", "traffic_light"})
"""Classes whose things without gaps are slender."""
_DEPTH_UNIT = 2
_SAMPLES = 3
"""Samples of a slender thing along a pixel's side; a larger value is smoother and slower."""


class PartialCover:
    """What covers pixels in part, and the share that it leaves open.

    Attributes:
        slender: N, instances without gaps that cover pixels in part.
        gappy: N, instances with gaps.
    """

    def __init__(
        self,
        size: tuple[int, int],
        draws: DrawList,
        looks: Looks,
        scene_objects: Sequence[SceneObject],
    ) -> None:
        """Creates textures of a width and a height in pixels, for the instances of a scene."""
        self._draws, self._looks = draws, looks
        self.gappy: BoolArray = looks.cut_out[draws.materials]
        slender = np.array([each.label in _SLENDER for each in scene_objects], bool)
        self.slender: BoolArray = draws.of_objects(slender) & ~self.gappy
        self._shares = CutProgram("mesh.vert", "openness.frag")
        largest = int(gl.glGetIntegerv(gl.GL_MAX_TEXTURE_SIZE))
        self._side = max(min(_SAMPLES, largest // max(size)), 1)
        counted = f"SAMPLES {self._side}"
        self._marks = gpu.Program("mesh.vert", "slender.frag", counted)
        self._means = gpu.Program("screen.vert", "slender_mean.frag", counted)
        self._whole, self._slender = (gpu.render_target(size, ()) for _ in range(2))
        self._open = gpu.render_target(size, (gl.GL_RGBA8,))
        width, height = size
        samples = width * self._side, height * self._side
        self._samples = gpu.render_target(samples, (gl.GL_R8,), gpu.NO_DEPTH)

    @property
    def openness(self) -> int:
        """Texture for `part.glsl`: open shares, and the kind of each pixel's nearest surface."""
        return self._open.colours[0]

    def keep_whole(self, target: gpu.Target) -> None:
        """Copies the depth of what covers whole pixels: to test against it, and to read it."""
        _copy_depth(target, self._open)
        _copy_depth(target, self._whole)

    def keep_slender(self, target: gpu.Target) -> None:
        """Copies the depth of what has no gaps."""
        _copy_depth(target, self._slender)

    def draw(self, pixels: gpu.Target, clip: FloatArray, seen: BoolArray) -> None:
        """Finds the open shares.

        Args:
            pixels: Labels and depth of all.
            clip: 4 x 4, from positions relative to the camera to clip space.
            seen: N, instances at the centres of pixels.
        """
        self._mark_slender(clip, seen & self.slender)
        self._begin_shares(pixels.depth)
        gappy = seen & self.gappy
        if not gappy.any():
            return
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthFunc(gl.GL_GREATER)
        gl.glDepthMask(False)
        gl.glEnable(gl.GL_BLEND)
        gl.glBlendFunc(gl.GL_ZERO, gl.GL_ONE_MINUS_SRC_COLOR)
        gpu.bind_texture(_DEPTH_UNIT, self._slender.depth)
        units = {**self._looks.units, **self._draws.units, "slender_depth": _DEPTH_UNIT}
        self._shares.set(clip=clip, **units)
        self._draws.draw(gappy, lambda m: self._looks.set_cut(self._shares, m))
        gl.glDisable(gl.GL_BLEND)
        gl.glDepthMask(True)

    def _mark_slender(self, clip: FloatArray, chosen: BoolArray) -> None:
        """Marks what slender things cover."""
        gl.glDisable(gl.GL_DEPTH_TEST)
        self._samples.bind()
        gl.glClearBufferfv(gl.GL_COLOR, 0, np.ones(4, np.float32))
        if not chosen.any():
            return
        self._marks.use()
        gpu.bind_texture(0, self._whole.depth)
        self._marks.set(clip=clip, whole_depth=0, **self._draws.units)
        alike = np.zeros(len(self._looks.cut_out), np.int64)
        self._draws.draw(chosen, lambda _: None, alike=alike)

    def _begin_shares(self, nearest: int) -> None:
        """Begins with what slender things leave; the target of the shares stays bound."""
        depths = nearest, self._slender.depth, self._whole.depth
        names = "samples", "nearest_depth", "slender_depth", "whole_depth"
        gl.glDisable(gl.GL_DEPTH_TEST)
        self._open.bind()
        self._means.use()
        for unit, texture in enumerate((self._samples.colours[0], *depths)):
            gpu.bind_texture(unit, texture)
        self._means.set(**{name: unit for unit, name in enumerate(names)})
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)


def _copy_depth(source: gpu.Target, to: gpu.Target) -> None:
    kind = gl.GL_TEXTURE_2D
    start, size = (0, 0, 0, 0), (*source.size, 1)
    gl.glCopyImageSubData(source.depth, kind, *start, to.depth, kind, *start, *size)

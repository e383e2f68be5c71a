"""Heights around the camera, seen from above, for the share of visible sky.

The ground and what stands on it have a top, leaves a top and an underside.

They depend on nothing but the place, so squares of the map are drawn once and kept.
"""

from collections import OrderedDict

import numpy as np
from OpenGL import GL as gl  # noqa: N811
from scipy.ndimage import maximum_filter

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.lighting.sun_shadows import ShadowView
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.draw_list import DrawList
from envgen_usd.render.opengl.shader_looks import CutProgram, Looks
from envgen_usd.render.render_scene import Floats

_SQUARE = 64.0
"""Side length of a square, metres."""
_PIXELS = 128
"""Pixels along each side of a square."""
_ACROSS = 5
"""Squares along each side of the window around the camera's surroundings."""
_AHEAD = 80.0
"""Distance of the window's centre from the camera, metres."""
_CELLS = 8
"""Cells along each side of a square, by which squares are chosen."""
_REACH = 9
"""Cells beyond a place that its share of the sky depends on: the shader looks up to 73 m away."""
_LEAST_FOOTPRINT = (_SQUARE / _PIXELS) ** 2
"""Area in plan, square metres, below which an instance (a window, a post) is left out."""
_KEPT = 512
"""Number of squares kept; each takes 128 KB."""


class HeightMap:
    """A window of squares, put together for each frame."""

    def __init__(self, draws: DrawList, looks: Looks) -> None:
        """Creates the window."""
        self._draws, self._looks = draws, looks
        self._programs = CutProgram("mesh.vert", "heights.frag")
        detailed, far = (draws.detailed(np.zeros(3), focal) for focal in (np.inf, 0.0))
        # From above, far crowns are lines: their twigs are upright cards.
        level = np.where(looks.cut_out[draws.materials], detailed, far)
        shown = level & draws.broad(_LEAST_FOOTPRINT)
        self._shown, self._moving = shown & draws.still, shown & ~draws.still
        boxes = draws.boxes[draws.still] if draws.still.any() else draws.boxes
        low, high = boxes[:, 0, 2].min(), boxes[:, 1, 2].max()
        self._middle, self._span = float(low + high) / 2.0, float(high - low) + 2.0
        side = _ACROSS * _PIXELS
        self._window = gpu.render_target((side, side), (gl.GL_RGBA16,), gpu.NO_DEPTH)
        self._squares: OrderedDict[tuple[int, int], int] = OrderedDict()
        self._corner: FloatArray = np.zeros(2)

    @property
    def texture(self) -> int:
        """Texture of the window: tops, tops of leaves, and undersides of leaves.

        Tops are 0 at the top of the range and 1 at its bottom, undersides 1 and 0. Where nothing
        is, all are 1.
        """
        return self._window.colours[0]

    def draw(self, pose: FloatArray, places: Floats) -> None:
        """Draws what is missing around places.

        Args:
            pose: 4 x 4, camera to world.
            places: 3 x M, what the camera sees, relative to it.
        """
        ahead = pose[:2, 2] / max(float(np.linalg.norm(pose[:2, 2])), 1e-9)
        middle = (pose[:2, 3] + _AHEAD * ahead) / _SQUARE
        first = np.round(middle - _ACROSS / 2.0)
        self._corner = first * _SQUARE
        needed = _squares_around(
            places[:2] + (pose[:2, 3] - self._corner).astype(np.float32)[:, None]
        )
        self._window.bind()
        gl.glClearBufferfv(gl.GL_COLOR, 0, np.ones(4, np.float32))
        for row, column in np.argwhere(needed).tolist():
            square = self._square_at((int(first[0]) + column, int(first[1]) + row))
            at = column * _PIXELS, row * _PIXELS
            gl.glCopyImageSubData(
                square, gl.GL_TEXTURE_2D, 0, 0, 0, 0,
                self._window.colours[0], gl.GL_TEXTURE_2D, 0, *at, 0, _PIXELS, _PIXELS, 1,
            )  # fmt: skip
        self._draw_moving()

    def _draw_moving(self) -> None:
        """Draws what moves over the squares, which are kept without it."""
        if not self._moving.any():
            return
        half = _ACROSS * _SQUARE / 2.0
        view = self._view(self._corner + half, half)
        chosen = self._draws.moving_inside(view.clip, view.middle) & self._moving
        if chosen.any():
            self._draw_over(self._window, view, chosen)

    def _draw_over(self, target: gpu.Target, view: ShadowView, chosen: BoolArray) -> None:
        """Draws instances over what is in a target, with back faces."""
        target.bind()
        self._draws.look_from(view.middle)
        self._programs.set(clip=view.clip, **self._looks.units, **self._draws.units)
        gl.glDisable(gl.GL_DEPTH_TEST)
        gl.glEnable(gl.GL_DEPTH_CLAMP)
        gl.glEnable(gl.GL_BLEND)
        gl.glBlendEquation(gl.GL_MIN)
        self._draws.draw(
            chosen,
            lambda m: self._looks.set_cut(self._programs, m),
            alike=self._looks.alike,
            cull=False,
            thin=True,
        )
        gl.glBlendEquation(gl.GL_FUNC_ADD)
        gl.glDisable(gl.GL_BLEND)
        gl.glDisable(gl.GL_DEPTH_CLAMP)

    def uniforms(self, eye: FloatArray) -> dict[str, tuple[float, ...] | FloatArray | float]:
        """Uniforms of a shader whose positions are relative to `eye` (3, world)."""
        side = _ACROSS * _SQUARE
        view = self._view(self._corner + side / 2.0, side / 2.0)
        return {
            "heights_clip": view.clip_from(eye),
            "heights_range": (self._middle - float(eye[2]), self._span),
            "heights_side": side,
        }

    def _square_at(self, key: tuple[int, int]) -> int:
        """Texture of a square."""
        if key not in self._squares:
            if len(self._squares) >= _KEPT:
                gl.glDeleteTextures([self._squares.popitem(last=False)[1]])
            half = _SQUARE / 2.0
            view = self._view(np.array(key) * _SQUARE + half, half)
            target = gpu.render_target((_PIXELS, _PIXELS), (gl.GL_RGBA16,), gpu.NO_DEPTH)
            gl.glClearBufferfv(gl.GL_COLOR, 0, np.ones(4, np.float32))
            inside = self._draws.inside(view.clip, view.middle)
            self._draw_over(target, view, inside & self._shown)
            gl.glDeleteFramebuffers(1, [target.handle])
            self._squares[key] = target.colours[0]
        self._squares.move_to_end(key)
        return self._squares[key]

    def _view(self, middle: FloatArray, reach: float) -> ShadowView:
        clip = np.diag([1.0 / reach, 1.0 / reach, -1.0 / self._span, 1.0])
        clip[2, 3] = 0.5
        place = np.array([middle[0], middle[1], self._middle])
        return ShadowView(place, clip, _SQUARE / _PIXELS)


def _squares_around(places: Floats) -> BoolArray:
    """Rows and columns of the squares that places (2 x M, from the window's corner) depend on."""
    across = _ACROSS * _CELLS
    column, row = np.clip(places * np.float32(_CELLS / _SQUARE), 0, across - 1).astype(np.int32)
    seen = np.bincount(row * across + column, minlength=across * across)
    around = maximum_filter(seen.reshape(across, across), 2 * _REACH + 1)
    squares: BoolArray = around.reshape(_ACROSS, _CELLS, _ACROSS, _CELLS).max(axis=(1, 3)) > 0
    return squares

"""Views of the shadow maps: squares before the camera, seen from the sun or from above."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.opengl.depth_pyramid import DepthPyramid, Rectangles
from envgen_usd.render.render_scene import Floats

DEPTH = 600.0
"""Depth range of shadow maps, metres; casters beyond the front are clamped to it."""


@dataclass(frozen=True)
class Cascade:
    """A square before the camera that a shadow map covers.

    Attributes:
        reach: Half its side length, metres.
        ahead: Distance of its centre from the camera, metres.
        step: Grid size by which the square follows the camera, metres. The square depends on the
            grid cell alone, whatever the earlier frames.
        side: Pixels along each side of the map.
    """

    reach: float
    ahead: float
    step: float
    side: int


CASCADES = (
    Cascade(reach=28.0, ahead=20.0, step=0.0, side=1024),
    Cascade(reach=128.0, ahead=80.0, step=32.0, side=1024),
)
"""The near and the far square of the sun's shadows."""
_SHARP_FOCAL = 560.0
"""Focal length in pixels whose shadows need all pixels of a map; half of it needs half."""
_LEAST_SIDE = 256
"""Least number of pixels along each side of a map."""
_INNER = 0.9
"""Share of a square, from its middle, in which shaders look at no larger square."""
_CELLS = 128
"""Cells along each side of a square by which casters are chosen; more cells choose fewer."""


def cascades_for(focal: float) -> tuple[Cascade, ...]:
    """The cascades, with pixels enough for a camera of a focal length in pixels."""
    halvings = max(int(np.log2(_SHARP_FOCAL / min(focal, _SHARP_FOCAL))), 0)
    return tuple(
        replace(cascade, side=max(cascade.side >> halvings, _LEAST_SIDE)) for cascade in CASCADES
    )


@dataclass(frozen=True)
class ShadowView:
    """View of a shadow map.

    Attributes:
        middle: 3, centre of the square, world.
        clip: 4 x 4, from positions relative to the centre to clip space, depth 0 to 1.
        texel: Side length of a texel, metres.
    """

    middle: FloatArray
    clip: FloatArray
    texel: float

    def spans(self, boxes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Least and largest coordinates of boxes (N x 2 x 3, world) in clip space, 3 x N each."""
        turn = self.clip[:3, :3]
        # A row of memory for each coordinate: four times as fast as a row for each box.
        low, high = np.ascontiguousarray(boxes.transpose(1, 2, 0))
        middle = (low + high) / 2.0
        reach = np.abs(turn) @ (high - middle)
        middle = turn @ (middle - self.middle[:, None]) + self.clip[:3, 3:]
        return middle - reach, middle + reach

    def clip_from(self, eye: FloatArray) -> FloatArray:
        """From positions relative to a camera at `eye` (3) to clip space: 4 x 4."""
        moved = self.clip.copy()
        moved[:3, 3] += self.clip[:3, :3] @ (eye - self.middle)
        return moved


def shadow_view(cascade: Cascade, pose: FloatArray, light_direction: FloatArray) -> ShadowView:
    """View of a cascade for a camera.

    The square moves in steps of whole texels at least, so that shadows do not flicker.

    Args:
        cascade: Cascade.
        pose: 4 x 4, camera to world.
        light_direction: 3, towards the light.
    """
    axes = _light_axes(light_direction)
    texel = 2.0 * cascade.reach / cascade.side
    ahead = pose[:3, 2] * (1.0, 1.0, 0.0)
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-9)
    middle = axes @ (pose[:3, 3] + ahead * cascade.ahead)  # 3, along the light's axes
    grid = max(round(cascade.step / texel), 1) * texel
    middle = np.round(middle / grid) * grid
    clip = np.eye(4)
    clip[:3, :3] = axes / np.array([[cascade.reach], [cascade.reach], [DEPTH]])
    clip[2, 3] = 0.5
    return ShadowView(axes.T @ middle, clip, texel)


def farthest_places(view: ShadowView, places: Floats, eye: FloatArray) -> Floats:
    """The depth of the farthest place in each cell of a view or beside it, -inf without a place.

    Args:
        view: View of the shadow map.
        places: 3 x M, relative to `eye`.
        eye: 3, world.
    """
    lit = _clipped(view, places, eye)
    row, column = _cells(lit, _CELLS)
    outside = (row < 0) | (row >= _CELLS) | (column < 0) | (column >= _CELLS)
    cell = np.where(outside, _CELLS * _CELLS, row * _CELLS + column)
    farthest = np.full(_CELLS * _CELLS + 1, -np.inf, np.float32)
    np.maximum.at(farthest, cell, lit[2])
    # Lookups reach a few texels beyond a place.
    spread: Floats = maximum_filter(farthest[:-1].reshape(_CELLS, _CELLS), 3)
    return spread


def casters(view: ShadowView, boxes: FloatArray, farthest: DepthPyramid) -> BoolArray:
    """Tells which boxes (N x 2 x 3, world) can cast a shadow on the farthest places."""
    low, high = view.spans(boxes)
    above = (low[:2] <= 1.0) & (high[:2] >= -1.0)
    chosen: BoolArray = above[0] & above[1]
    first, last = (_cells(corner[:, chosen], _CELLS).T for corner in (low, high))
    rectangles = Rectangles(first, last, low[2, chosen])
    chosen[chosen] = farthest.leaves_visible(rectangles)
    return chosen


def window(farthest: Floats, side: int) -> tuple[int, int, int, int]:
    """Pixels of a map of `side` pixels with all places: left, bottom, width and height."""
    used = np.isfinite(farthest)
    spans = []
    for axis in (0, 1):
        cells = np.flatnonzero(used.any(axis=axis))
        low, high = (cells[0], cells[-1] + 1) if len(cells) else (0, 0)
        spans.append((int(low) * side // _CELLS, -(-int(high) * side // _CELLS)))
    (left, right), (bottom, top) = spans
    return left, bottom, right - left, top - bottom


def beyond(view: ShadowView, places: Floats, eye: FloatArray) -> Floats:
    """The places (3 x M, relative to `eye`) that a view does not show by itself."""
    x, y, _ = np.abs(_clipped(view, places, eye))
    outer: Floats = places[:, np.maximum(x, y) > _INNER]
    return outer


def _clipped(view: ShadowView, places: Floats, eye: FloatArray) -> Floats:
    clip = view.clip_from(eye).astype(np.float32)
    clipped: Floats = np.einsum("ij,jm->im", clip[:3, :3], places) + clip[:3, 3:]
    return clipped


def _cells(clipped: NDArray[np.floating], cells: int) -> IntArray:
    """Rows and columns (2 x N) of places in clip space (3 x N); -1 and `cells` are outside."""
    scaled = (clipped[1::-1] + 1) * (cells / 2)
    place: IntArray = np.clip(np.floor(scaled, out=scaled), -1, cells, out=scaled).astype(np.int32)
    return place


def _light_axes(light_direction: FloatArray) -> FloatArray:
    """Rows: right, up, and away from the light."""
    away = -light_direction / np.linalg.norm(light_direction)
    helper = np.array([0.0, 1.0, 0.0] if abs(away[1]) < 0.9 else [1.0, 0.0, 0.0])
    right = np.cross(helper, away)
    right = right / np.linalg.norm(right)
    return np.stack((right, np.cross(away, right), away))

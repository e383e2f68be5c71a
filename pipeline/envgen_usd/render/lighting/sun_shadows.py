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
_LEAST_CASTER = 2.0
"""Texels that a caster spans at least; a larger value leaves out more of what shades little."""
_LEAST_RISE = 1.0
"""Texels that a caster rises above what it shades: shaders lift places by as much."""


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

    @property
    def scale(self) -> float:
        """Clip coordinates of a metre across the light's direction."""
        return float(np.linalg.norm(self.clip[0, :3]))

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


@dataclass(frozen=True)
class ShadedPlaces:
    """The places that a view shows, by cells along its two axes; -inf where there are none.

    Attributes:
        farthest: Depth of the farthest place in a cell or beside it, rows x columns.
        lowest: Largest depth below the camera of such a place, metres.
    """

    farthest: Floats
    lowest: Floats

    @classmethod
    def of(cls, view: ShadowView, places: Floats, eye: FloatArray) -> "ShadedPlaces":
        """Sorts places into cells.

        Args:
            view: View of the shadow map.
            places: 3 x M, relative to `eye`.
            eye: 3, world.
        """
        lit = _clipped(view, places, eye)
        row, column = _cells(lit, _CELLS)
        outside = (row < 0) | (row >= _CELLS) | (column < 0) | (column >= _CELLS)
        cell = np.where(outside, _CELLS * _CELLS, row * _CELLS + column)
        return cls(_largest(cell, lit[2]), _largest(cell, -places[2]))


class CasterChoice:
    """Tells what can cast a shadow on places."""

    def __init__(self, view: ShadowView, shaded: ShadedPlaces, eye: FloatArray) -> None:
        """Prepares the choice; `eye` (3, world) is that of the places."""
        self._view, self._height = view, float(eye[2])
        self._farthest, self._lowest = DepthPyramid(shaded.farthest), DepthPyramid(shaded.lowest)

    def of(self, boxes: FloatArray) -> BoolArray:
        """Tells which boxes (N x 2 x 3, world) can cast a shadow on the places.

        What is smaller than a few texels, and what rises less than a texel above all places that
        it can shade, casts none that the map could show.
        """
        view = self._view
        low, high = view.spans(boxes)
        above = (low[:2] <= 1.0) & (high[:2] >= -1.0)
        wide = (high - low)[:2].max(axis=0) >= _LEAST_CASTER * view.texel * view.scale
        chosen: BoolArray = above[0] & above[1] & wide
        first, last = (_cells(corner[:, chosen], _CELLS).T for corner in (low, high))
        depths = Rectangles(first, last, low[2, chosen])
        rise = self._height - boxes[chosen, 1, 2] + _LEAST_RISE * view.texel
        chosen[chosen] = self._farthest.leaves_visible(depths) & self._lowest.leaves_visible(
            Rectangles(first, last, rise)
        )
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


def _largest(cell: IntArray, values: Floats) -> Floats:
    """The largest value of each cell and the cells around it, rows x columns."""
    largest = np.full(_CELLS * _CELLS + 1, -np.inf, np.float32)
    np.maximum.at(largest, cell, values)
    # Lookups reach a few texels beyond a place.
    spread: Floats = maximum_filter(largest[:-1].reshape(_CELLS, _CELLS), 3)
    return spread


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

"""Tells which boxes an image of depths leaves visible, before they are drawn.

The farthest depth within a rectangle is looked up in a pyramid, after N. Greene, M. Kass and
G. Miller, "Hierarchical Z-buffer visibility" (SIGGRAPH 1993).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.cameras.camera_rig import Camera

_ROUNDING = 1.0 - 1e-4
"""Factor of a box's nearest depth, against rounding on the GPU."""


@dataclass(frozen=True)
class Rectangles:
    """Rectangles of pixels that boxes project to.

    Attributes:
        low: N x 2, first row and column.
        high: N x 2, last row and column.
        nearest: N, depth of each box's nearest point.
    """

    low: IntArray
    high: IntArray
    nearest: FloatArray

    def of(self, chosen: BoolArray) -> "Rectangles":
        """The chosen rectangles."""
        return Rectangles(self.low[chosen], self.high[chosen], self.nearest[chosen])


class DepthPyramid:
    """The farthest depths of an image, over blocks of 1, 2, 4, ... pixels a side."""

    def __init__(self, depth: NDArray[np.floating]) -> None:
        """Halves an image (H x W) until a single pixel is left."""
        levels = [depth]
        while max(levels[-1].shape) > 1:
            levels.append(_halved(levels[-1]))
        self._depths = np.concatenate([level.reshape(-1) for level in levels])
        self._widths = np.array([level.shape[1] for level in levels])
        self._starts = np.cumsum([0, *(level.size for level in levels[:-1])])
        self._last = np.array(depth.shape) - 1

    def leaves_visible(self, boxes: Rectangles) -> BoolArray:
        """True for each box that is nearer than the farthest depth in its rectangle."""
        low = np.maximum(boxes.low, 0)
        high = np.minimum(boxes.high, self._last)
        inside = (low <= high).all(axis=1)
        low, high = low[inside], high[inside]
        # Blocks as wide as the rectangle: it touches two of them at most along each axis.
        level = np.ceil(np.log2((high - low).max(axis=1, initial=0) + 1)).astype(np.int64)
        start, width = self._starts[level], self._widths[level]
        (top, left), (bottom, right) = (low >> level[:, None]).T, (high >> level[:, None]).T
        farthest = np.full(len(low), -np.inf)
        for row in (top, bottom):
            for column in (left, right):
                np.maximum(farthest, self._depths[start + row * width + column], out=farthest)
        visible = np.zeros(len(inside), bool)
        visible[inside] = boxes.nearest[inside] * _ROUNDING <= farthest
        return visible


def camera_rectangles(boxes: FloatArray, camera: Camera, pose: FloatArray) -> Rectangles:
    """Pixels that boxes may cover, with a margin of half a pixel at least.

    Args:
        boxes: N x 2 x 3, minimum and maximum corner, world.
        camera: Camera.
        pose: 4 x 4, camera to world.
    """
    sides = np.ascontiguousarray((boxes - pose[:3, 3]).transpose(2, 1, 0))  # axis x 2 x N
    # Eight corners as sums over the axes, for each coordinate of the camera.
    parts = pose[:3, :3].T[:, :, None, None] * sides  # coordinate x axis x 2 x N
    corners = parts[:, 0, :, None, None] + parts[:, 1, None, :, None] + parts[:, 2, None, None]
    x, y, z = corners.reshape(3, 8, -1)
    nearest = z.min(axis=0)
    ahead = np.maximum(z, camera.near)
    columns = camera.fx * x / ahead + camera.cx
    rows = camera.fy * y / ahead + camera.cy
    size = np.array([camera.height, camera.width])
    low = np.stack((rows.min(axis=0), columns.min(axis=0)), axis=1)
    high = np.stack((rows.max(axis=0), columns.max(axis=0)), axis=1)
    beside = nearest < camera.near
    low[beside], high[beside] = 0.0, size
    low, high = np.clip(np.floor(low), -1, size), np.clip(np.ceil(high), -1, size)
    return Rectangles(low.astype(np.int64), high.astype(np.int64), np.maximum(nearest, 0.0))


def _halved(depth: NDArray[np.floating]) -> NDArray[np.floating]:
    """The farthest of 2 x 2 pixels; an odd last row or column counts twice."""
    rows, columns = (n & 1 for n in depth.shape)
    even = np.pad(depth, ((0, rows), (0, columns)), "edge") if rows or columns else depth
    # Whole rows first: their pixels lie side by side.
    down = np.maximum(even[::2], even[1::2])
    halved: NDArray[np.floating] = np.maximum(down[:, ::2], down[:, 1::2])
    return halved

"""Tells which boxes an image of depths leaves visible, before they are drawn.

The farthest depth within a rectangle is looked up in a pyramid, after N. Greene, M. Kass and
G. Miller, "Hierarchical Z-buffer visibility" (SIGGRAPH 1993).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.cameras.camera_rig import Camera

_ROUNDING = 1.0 - 1e-4
"""Factor of a box's nearest depth, against rounding on the GPU."""
_SNAP = 0.02
"""Pixels by which rectangles are enlarged: the GPU moves corners to multiples of 1 / 256."""


@dataclass(frozen=True)
class Rectangles:
    """Pixels whose centres boxes project to; a box between the centres has a last before its first.

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

    @property
    def hold_pixels(self) -> BoolArray:
        """True for the rectangles with a pixel's centre: N."""
        held: BoolArray = np.logical_and.reduce(self.low <= self.high, axis=1)
        return held


class DepthPyramid:
    """The farthest depths of an image, over blocks of 1, 2, 4, ... rows by 1, 2, 4, ... columns.

    Blocks that are wider than high suit what is seen at a grazing angle, as ground and streets.
    """

    def __init__(self, depth: NDArray[np.floating], least: int = 1) -> None:
        """Halves the columns and the rows of an image (H x W) until a single pixel is left.

        Args:
            depth: The image.
            least: Columns of the narrowest blocks, a power of two; a larger value takes less time
                and leaves more visible.
        """
        self._last = np.array(depth.shape) - 1
        self._least = least.bit_length() - 1
        for _ in range(self._least):
            depth = _halved(depth.T).T
        # The images with halved columns stand side by side, so that each row is halved once.
        narrowed = [*_levels(depth.T)]
        levels = [*_levels(np.concatenate(narrowed).T)]
        self._depths = np.concatenate([each.reshape(-1) for each in levels])
        widths = np.array([len(each) for each in narrowed])
        self._lefts, self._width = np.cumsum(widths) - widths, int(widths.sum())
        sizes = np.array([each.size for each in levels])
        self._tops = np.cumsum(sizes) - sizes

    def leaves_visible(self, boxes: Rectangles) -> BoolArray:
        """True for each box that is nearer than the farthest depth in its rectangle."""
        low = np.maximum(boxes.low, 0)
        high = np.minimum(boxes.high, self._last)
        inside = (low <= high).all(axis=1)
        top, left = low[inside].T
        bottom, right = high[inside].T
        # Blocks as large as the rectangle: it touches two of them at most along each axis.
        row, column = _level(bottom - top), np.maximum(_level(right - left), self._least)
        start = self._tops[row] + self._lefts[column - self._least]
        rows = [start + self._width * (down >> row) for down in (top, bottom)]
        farthest = np.full(len(start), -np.inf)
        for across in (left >> column, right >> column):
            for each in rows:
                np.maximum(farthest, self._depths[each + across], out=farthest)
        visible = np.zeros(len(inside), bool)
        visible[inside] = boxes.nearest[inside] * _ROUNDING <= farthest
        return visible


def camera_rectangles(boxes: FloatArray, camera: Camera, pose: FloatArray) -> Rectangles:
    """Pixels whose centres boxes may cover; those of a box beyond the image have no pixel.

    Args:
        boxes: N x 2 x 3, minimum and maximum corner, world.
        camera: Camera.
        pose: 4 x 4, camera to world.
    """
    # Single precision takes half the time; places relative to the camera lose no pixel by it.
    sides = (boxes - pose[:3, 3]).transpose(2, 1, 0).astype(np.float32, "C")  # axis x 2 x N
    # Eight corners as sums over the axes, for each coordinate of the camera.
    parts = pose[:3, :3].T.astype(np.float32)[:, :, None, None] * sides  # coordinate x axis x 2 x N
    corners = parts[:, 0, :, None, None] + parts[:, 1, None, :, None] + parts[:, 2, None, None]
    corners = corners.reshape(3, 8, -1)
    nearest = corners[2].min(axis=0)
    ahead = np.maximum(corners[2], np.float32(camera.near))
    size = np.array([[camera.height], [camera.width]])
    low, high = np.empty((2, 2, len(boxes)), np.float32)
    lens = ((corners[1], camera.fy, camera.cy), (corners[0], camera.fx, camera.cx))
    for axis, (place, focal, middle) in enumerate(lens):
        pixels = np.float32(focal) * place / ahead + np.float32(middle)
        pixels.min(axis=0, out=low[axis])
        pixels.max(axis=0, out=high[axis])
    beside = np.flatnonzero(~(nearest >= camera.near))  # or hidden, without a place
    low[:, beside], high[:, beside] = 0.0, size
    low[:, beside[_beyond(boxes[beside], camera, pose)]] = np.inf
    low, high = np.ceil(low - _SNAP), np.floor(high + _SNAP)
    low, high = np.clip(low, 0, size), np.clip(high, -1, size - 1)
    return Rectangles(low.astype(np.int32).T, high.astype(np.int32).T, np.maximum(nearest, 0.0))


def _beyond(boxes: FloatArray, camera: Camera, pose: FloatArray) -> BoolArray:
    """Boxes (N x 2 x 3, world) beyond a side of the view: N."""
    left, top = camera.cx + 0.5, camera.cy + 0.5
    sides = np.array(
        [
            (camera.fx, 0.0, left),
            (-camera.fx, 0.0, camera.width - left),
            (0.0, camera.fy, top),
            (0.0, -camera.fy, camera.height - top),
            (0.0, 0.0, 1.0),
        ]
    )
    normals = sides @ pose[:3, :3].T
    low, high = boxes[:, 0] - pose[:3, 3], boxes[:, 1] - pose[:3, 3]
    inmost = ((high + low) @ normals.T + (high - low) @ np.abs(normals).T) / 2.0
    within = inmost >= (0.0, 0.0, 0.0, 0.0, camera.near)
    beyond: BoolArray = ~np.logical_and.reduce(within, axis=1)
    return beyond


def _level(span: IntArray) -> IntArray:
    """Halvings after which two blocks hold any pixels whose numbers differ by a span at most."""
    halvings: IntArray = np.frexp(np.maximum(span - 1, 0))[1].astype(np.int64)
    return halvings


def _levels(image: NDArray[np.floating]) -> Iterator[NDArray[np.floating]]:
    """An image, and its halves until a single row is left."""
    yield image
    while len(image) > 1:
        image = _halved(image)
        yield image


def _halved(depth: NDArray[np.floating]) -> NDArray[np.floating]:
    """The farthest of every two rows; an odd last row stays."""
    even = len(depth) & ~1
    halved = np.maximum(depth[:even:2], depth[1:even:2])
    return np.concatenate((halved, depth[even:])) if len(depth) > even else halved

"""Perspective views that cover the field of a lens, and the samples of its pixels in them."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, vstack

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.render_scene import Floats

_FARTHEST = 0.5
"""Largest distance of a label's sample from the centre of its pixel, pixels of the lens.

A larger value draws smaller views, in less time.
"""
_SINGLE = 1.5
"""Largest tangent that a single view covers; a larger value makes wide views instead of six."""
_MARGIN = 3
"""Pixels around the field of a view, for filters."""
_MOST_PIXELS = 8192
"""Largest side of a view, pixels; the drawing doubles it."""
_ROWS = 64
"""Rows of the lens that are worked on at once; a larger value takes more memory."""
_TAPS = (-0.25, 0.25)
"""Places within a pixel, along each side, whose mean is its colour."""


@dataclass(frozen=True)
class LensViews:
    """Views of a lens that share a camera.

    Attributes:
        camera: Pinhole camera of all views.
        turns: V x 3 x 3, from the space of each view to that of the lens.
        inside: H x W, True for pixels within the image circle.
        nearest: P, sample of each pixel inside, as an index into the pixels of all views.
        depth_factors: P, from depth in a view to the depth of the lens.
        weights: P x samples, the share of each sample in the colour of a pixel.
    """

    camera: Camera
    turns: FloatArray
    inside: BoolArray
    nearest: NDArray[np.intp]
    depth_factors: Floats
    weights: csr_array


def lens_views(camera: Camera) -> LensViews:
    """Makes the views of a camera with a lens.

    A lens with a narrow field has a single view along its axis. A wide lens has up to six: two
    halves of the front face of a cube, and half of each face beside it.

    Raises:
        EnvgenError: The lens shows nothing, or its views would be too large to draw.
    """
    faces = _faces(camera)
    low, high, focal, used = _extent(camera, faces)
    if not used.any():
        raise EnvgenError("render: the lens shows nothing: no pixel lies in its image circle")
    faces = _Faces(faces.turns[used], faces.is_front_half[used], faces.is_cube)
    view = _view_camera(camera, low, high, focal)
    parts = [_samples(camera, view, faces, rows) for rows in _row_blocks(camera)]
    inside, nearest, factors, weights = zip(*parts, strict=True)
    return LensViews(
        view,
        faces.turns,
        np.concatenate(inside).reshape(camera.height, camera.width),
        np.concatenate(nearest),
        np.concatenate(factors),
        vstack(weights, format="csr"),
    )


def pixel_directions(camera: Camera, rows: range, shift: tuple[float, float]) -> FloatArray:
    """Unit directions (N x 3) of the pixels of some rows, moved right and down by parts of a pixel.

    A pixel outside of the image circle has NaN.
    """
    u, v = np.meshgrid(np.arange(camera.width) + shift[0], np.array(rows) + shift[1])
    x, y = (u.ravel() - camera.cx) / camera.fx, (v.ravel() - camera.cy) / camera.fy
    return camera.lens.directions(np.column_stack((x, y)))


@dataclass(frozen=True)
class _Faces:
    """Views and what each of them covers.

    Attributes:
        turns: V x 3 x 3, from the space of each view to that of the lens.
        is_front_half: V, True if the view covers the upper half of its face only.
        is_cube: True if the views are faces of a cube, False for a single view of all directions.
    """

    turns: FloatArray
    is_front_half: BoolArray
    is_cube: bool

    def views_of(self, directions: FloatArray) -> NDArray[np.intp]:
        """View of each direction (N x 3); -1 for NaN and where no view lies."""
        if not self.is_cube:
            return np.where(np.isnan(directions[:, 0]), -1, 0)
        right, down, along = np.moveaxis(directions @ self.turns, 2, 0)
        reach = along * (1.0 + 1e-9)
        fits = (along > 0.0) & (np.abs(right) <= reach) & (down >= -reach)
        fits &= (down <= 0.0) | ~self.is_front_half[:, None]
        return np.where(fits.any(axis=0), np.argmax(fits, axis=0), -1)

    def places(self, directions: FloatArray, views: NDArray[np.intp]) -> FloatArray:
        """Places (N x 2) of directions on the image planes of views (N)."""
        local = np.einsum("nij,ni->nj", self.turns[views], directions)
        places: FloatArray = local[:, :2] / local[:, 2:]
        places[views < 0] = np.nan
        return places


def _row_blocks(camera: Camera) -> Iterator[range]:
    for first in range(0, camera.height, _ROWS):
        yield range(first, min(first + _ROWS, camera.height))


def _faces(camera: Camera) -> _Faces:
    """Views that may be needed."""
    widest = 0.0
    for rows in _row_blocks(camera):
        x, y, z = pixel_directions(camera, rows, (0.0, 0.0)).T
        tangents = np.where(z > 0.0, np.hypot(x, y) / np.maximum(z, 1e-9), np.inf)
        widest = max(widest, float(np.max(tangents, initial=0.0, where=~np.isnan(x))))
    if widest <= _SINGLE:
        return _Faces(np.eye(3)[None], np.zeros(1, bool), is_cube=False)
    ahead = np.array([0.0, 0.0, 1.0])
    halves = [(ahead, np.array([0.0, side, 0.0])) for side in (1.0, -1.0)]
    beside = [(np.array([x, y, 0.0]), -ahead) for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    axes = [(np.cross(down, axis), down, axis) for axis, down in halves + beside]
    return _Faces(
        np.stack([np.column_stack(three) for three in axes]), np.arange(6) < 2, is_cube=True
    )


def _extent(camera: Camera, faces: _Faces) -> tuple[FloatArray, FloatArray, float, BoolArray]:
    """Field of the views as tangents, their focal length in pixels, and which are used."""
    low, high, focal = np.full(2, np.inf), np.full(2, -np.inf), 0.0
    used = np.zeros(len(faces.turns), bool)
    for rows in _row_blocks(camera):
        directions = pixel_directions(camera, rows, (0.0, 0.0))
        views = faces.views_of(directions)
        places = faces.places(directions, views)
        low = np.fmin.reduce(places, axis=0, initial=np.inf).clip(max=low)
        high = np.fmax.reduce(places, axis=0, initial=-np.inf).clip(min=high)
        used[np.unique(views[views >= 0])] = True
        right, down = (
            2.0 * (faces.places(pixel_directions(camera, rows, shift), views) - places)
            for shift in ((0.5, 0.0), (0.0, 0.5))
        )
        focal = max(focal, _farthest_sample(right, down) / _FARTHEST)
    return low, high, focal, used


def _farthest_sample(right: FloatArray, down: FloatArray) -> float:
    """Largest distance of a pixel's centre from the nearest sample, in pixels of the lens.

    Args:
        right: N x 2, step of a pixel to the right, in samples.
        down: N x 2, step of a pixel down, in samples.
    """
    area = np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0])
    corners = [np.column_stack((right @ way, down @ way)) for way in ((0.5, 0.5), (0.5, -0.5))]
    # The inverse of the map has the columns (d, -b) and (-c, a) over the area.
    reach = np.maximum(*(np.linalg.norm(corner, axis=1) for corner in corners)) / area
    return float(np.fmax.reduce(reach, initial=0.0))


def _view_camera(camera: Camera, low: FloatArray, high: FloatArray, focal: float) -> Camera:
    """Pinhole camera with a focal length in pixels that covers a field."""
    centre = _MARGIN - low * focal
    width, height = (np.ceil(high * focal + centre) + 1 + _MARGIN).astype(int).tolist()
    if max(width, height) > _MOST_PIXELS:
        raise EnvgenError(
            f"render: a view of the lens would have {width} x {height} pixels; at most"
            f" {_MOST_PIXELS} can be drawn: give the camera fewer pixels or a smaller field"
        )
    cx, cy = centre.tolist()
    return Camera(width, height, focal, focal, cx, cy, camera.mount, camera.near)


def _samples(
    camera: Camera, view: Camera, faces: _Faces, rows: range
) -> tuple[BoolArray, NDArray[np.intp], Floats, csr_array]:
    """Pixels inside, their nearest samples, factors of depth, and weights, of some rows."""
    directions = pixel_directions(camera, rows, (0.0, 0.0))
    inside = ~np.isnan(directions[:, 0])
    directions = directions[inside]
    views = faces.views_of(directions)
    places = faces.places(directions, views)
    pixels = places * view.fx + (view.cx, view.cy)
    whole = np.rint(pixels).astype(np.intp)
    nearest = (views * view.height + whole[:, 1]) * view.width + whole[:, 0]
    factors = np.hypot(1.0, np.linalg.norm(places, axis=1))
    if not camera.lens.has_ranges:
        factors *= directions[:, 2]
    weights = _weights(camera, view, faces, rows, inside)
    return inside, nearest, factors.astype(np.float32), weights


def _weights(
    camera: Camera, view: Camera, faces: _Faces, rows: range, inside: BoolArray
) -> csr_array:
    """Means of samples, interpolated at places within each pixel."""
    columns, shares = [], []
    for shift in product(_TAPS, _TAPS):
        directions = pixel_directions(camera, rows, shift)[inside]
        views = faces.views_of(directions)
        pixels = faces.places(directions, views) * view.fx + (view.cx, view.cy)
        pixels[views < 0] = 0.0
        corner = np.floor(pixels).astype(np.intp)
        near = pixels - corner
        for x, y in product((0, 1), (0, 1)):
            share = np.abs(1 - x - near[:, 0]) * np.abs(1 - y - near[:, 1])
            row, column = corner[:, 1] + y, corner[:, 0] + x
            at = (views * view.height + row) * view.width + column
            columns.append(np.where(views < 0, 0, at))
            shares.append(np.where(views < 0, 0.0, share))
    table = np.column_stack(shares)
    table /= table.sum(axis=1, keepdims=True)
    count, taps = table.shape
    starts = np.arange(0, count * taps + 1, taps, dtype=np.int32)
    samples = np.column_stack(columns).ravel().astype(np.int32)
    size = len(faces.turns) * view.width * view.height
    weights = csr_array((table.astype(np.float32).ravel(), samples, starts), shape=(count, size))
    weights.sum_duplicates()
    weights.eliminate_zeros()
    return weights

"""Planar arrangement of the borders of all strips; its faces partition the surface.

Coordinates are integers in units of `chunks.GRID`, so they compare exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from envgen_usd.chunks import CHUNK_SIZE, GRID
from envgen_usd.geometry.flat_arrays import distinct_rows, spans
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.opendrive.mesh.face_tracing import trace_faces
from envgen_usd.opendrive.mesh.noding import noded
from envgen_usd.opendrive.strips.lane_strips import Strip

_CROSS_EVERY = 12
"""Rows between cross lines; a smaller value gives smaller faces."""
_APART = 5
"""Least distance of vertices in grid units; a larger value gives fewer, less exact triangles."""


@dataclass(frozen=True)
class Faces:
    """Faces of a planar arrangement with F faces, P points, R ring vertices and K rings.

    Attributes:
        points: P x 2, metres, on the grid.
        polygons: F shapely polygons, shells counter-clockwise; other faces fill their holes. The z
            of a corner is its index in `ring_vertices`.
        inner: F x 2, metres, a point inside each face.
        ring_vertices: R, indices into `points`, ring by ring, without repeated last vertex.
        ring_start: K + 1, start of each ring in `ring_vertices`.
        ring_face: K, face of each ring; a face's first ring is its shell.
    """

    points: FloatArray
    polygons: npt.NDArray[np.object_]
    inner: FloatArray
    ring_vertices: IntArray
    ring_start: IntArray
    ring_face: IntArray


@dataclass(frozen=True)
class _Rows:
    """Rows of S strips one after another.

    Attributes:
        left: R x 2, metres.
        right: R x 2, metres.
        start: S + 1, first row of each strip.
        crossed: S, whether rows inside the strip become cross lines.
    """

    left: FloatArray
    right: FloatArray
    start: IntArray
    crossed: BoolArray

    @classmethod
    def of(cls, strips: Sequence[Strip]) -> "_Rows":
        return cls(
            np.concatenate([strip.left[:, :2] for strip in strips]),
            np.concatenate([strip.right[:, :2] for strip in strips]),
            np.cumsum([0, *(len(strip.left) for strip in strips)]),
            np.array([not strip.patch.junction for strip in strips]),
        )

    def followed(self) -> IntArray:
        """Returns the rows that another row of their strip follows."""
        return np.setdiff1d(np.arange(len(self.left)), self.start[1:] - 1, assume_unique=True)


def arrange(strips: Sequence[Strip], marks: Sequence[Strip], more: FloatArray) -> Faces:
    """Intersects all borders and ends of lanes and marks with each other and with chunk borders.

    Args:
        strips: Strips of lanes.
        marks: Strips of marks.
        more: N x 2 x 2, metres, further lines that split the faces.
    """
    rows = _Rows.of([*strips, *marks])
    pieces = _chunk_border_segments(_Rows.of(strips))
    lines = np.concatenate([*_outline_segments(rows), more, pieces])
    ends = np.concatenate([rows.start[:-1], rows.start[1:] - 1])
    corners = np.concatenate([rows.left[ends], rows.right[ends]])
    anchors = np.round(corners / GRID).astype(np.int64)
    anchors = anchors[distinct_rows(anchors)[0]]
    return _faces(*noded(_unique_segments(np.round(lines / GRID)), _APART, anchors))


def _outline_segments(rows: _Rows) -> list[FloatArray]:
    """Returns the segments (N x 2 x 2) of both borders, both ends, and some rows between."""
    inner = rows.followed()
    size = np.diff(rows.start)
    count = np.where(rows.crossed, -(-(size - 1) // _CROSS_EVERY), 1)
    crossing = np.repeat(rows.start[:-1], count) + spans(np.zeros_like(count), count) * _CROSS_EVERY
    crossing = np.concatenate([crossing, rows.start[1:] - 1])
    return [
        np.stack([rows.left[inner], rows.left[inner + 1]], axis=1),
        np.stack([rows.right[inner], rows.right[inner + 1]], axis=1),
        np.stack([rows.left[crossing], rows.right[crossing]], axis=1),
    ]


def _unique_segments(segments: FloatArray) -> IntArray:
    ends: IntArray = segments.reshape(-1, 4).astype(np.int64)
    flip = (ends[:, 0] > ends[:, 2]) | ((ends[:, 0] == ends[:, 2]) & (ends[:, 1] > ends[:, 3]))
    ends[flip] = ends[flip][:, [2, 3, 0, 1]]
    ends = ends[(ends[:, 0] != ends[:, 2]) | (ends[:, 1] != ends[:, 3])]
    ends = ends[np.lexsort(ends.T[::-1])]
    new = np.ones(len(ends), dtype=bool)
    new[1:] = (ends[1:] != ends[:-1]).any(axis=1)
    return ends[new].reshape(-1, 2, 2)


def _chunk_border_segments(rows: _Rows) -> FloatArray:
    """Returns pieces of chunk borders through strips, so that no face crosses a chunk border.

    A piece spans the bounding box of its cell; dangling ends bound no face.
    """
    inner = rows.followed()
    sides = np.stack([rows.left, rows.right], axis=1)
    cells = np.concatenate([sides[inner], sides[inner + 1]], axis=1)
    low, high = cells.min(axis=1), cells.max(axis=1)
    first, last = np.floor(low / CHUNK_SIZE) + 1, np.ceil(high / CHUNK_SIZE)
    pieces = [np.empty((0, 2, 2))]
    for cell, axis in np.argwhere(first < last):
        for border in np.arange(first[cell, axis], last[cell, axis]) * CHUNK_SIZE:
            piece = np.empty((1, 2, 2))
            piece[0, :, axis] = border
            piece[0, :, 1 - axis] = low[cell, 1 - axis], high[cell, 1 - axis]
            pieces.append(piece)
    return np.concatenate(pieces)


def _faces(vertices: IntArray, edges: IntArray) -> Faces:
    rings = trace_faces(vertices, edges)
    points = vertices / round(1 / GRID)
    ring = np.repeat(np.arange(len(rings.face)), np.diff(rings.start))
    corners = np.column_stack([points[rings.vertices], np.arange(len(rings.vertices))])
    polygons = shapely.polygons(shapely.linearrings(corners, indices=ring), indices=rings.face)
    inner = shapely.get_coordinates(shapely.point_on_surface(polygons))
    return Faces(points, polygons, inner, rings.vertices, rings.start, rings.face)

"""Planar arrangement of the borders of all strips; its faces partition the surface.

Coordinates are integers in units of `chunks.GRID`, so they compare exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.chunks import CHUNK_SIZE, GRID
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.opendrive.mesh.noding import noded
from envgen_usd.opendrive.strips.lane_strips import Strip

_CROSS_EVERY = 12
"""Rows between cross lines; a smaller value gives smaller faces."""


@dataclass(frozen=True)
class Faces:
    """Faces of a planar arrangement with F faces, P points, R ring vertices and K rings.

    Attributes:
        points: P x 2, metres, on the grid.
        polygons: F shapely polygons, shells counter-clockwise; other faces fill their holes.
        ring_vertices: R, indices into `points`, ring by ring, without repeated last vertex.
        ring_start: K + 1, start of each ring in `ring_vertices`.
        ring_face: K, face of each ring; a face's first ring is its shell.
    """

    points: FloatArray
    polygons: list[shapely.Polygon]
    ring_vertices: IntArray
    ring_start: IntArray
    ring_face: IntArray


def arrange(strips: Sequence[Strip], marks: Sequence[Strip], more: FloatArray) -> Faces:
    """Intersects all borders and ends of lanes and marks with each other and with chunk borders.

    Args:
        strips: Strips of lanes.
        marks: Strips of marks.
        more: N x 2 x 2, metres, further lines that split the faces.
    """
    lines = [line for strip in (*strips, *marks) for line in _outline_segments(strip)]
    lines.append(np.round(more / GRID))
    lines += [_chunk_border_segments(strip) for strip in strips]
    segments = _unique_segments(np.concatenate(lines))
    polygons = shapely.get_parts(shapely.polygonize(shapely.linestrings(noded(segments) * GRID)))
    return _faces(polygons)


def _outline_segments(strip: Strip) -> list[FloatArray]:
    """Returns the segments (N x 2 x 2) of both borders, both ends, and some rows between."""
    left, right = (np.round(side[:, :2] / GRID) for side in (strip.left, strip.right))
    rows = np.arange(0, len(left), len(left) - 1 if strip.patch.junction else _CROSS_EVERY)
    rows = np.append(rows, len(left) - 1)
    return [
        np.stack([left[:-1], left[1:]], axis=1),
        np.stack([right[:-1], right[1:]], axis=1),
        np.stack([left[rows], right[rows]], axis=1),
    ]


def _unique_segments(segments: FloatArray) -> IntArray:
    ends = segments.reshape(-1, 4).astype(np.int64)
    flip = (ends[:, 0] > ends[:, 2]) | ((ends[:, 0] == ends[:, 2]) & (ends[:, 1] > ends[:, 3]))
    ends[flip] = ends[flip][:, [2, 3, 0, 1]]
    ends = ends[(ends[:, :2] != ends[:, 2:]).any(axis=1)]
    return np.unique(ends, axis=0).reshape(-1, 2, 2)


def _chunk_border_segments(strip: Strip) -> FloatArray:
    """Returns pieces of chunk borders through the strip, so that no face crosses a chunk border.

    A piece spans the bounding box of its cell; dangling ends bound no face.
    """
    sides = np.stack([strip.left[:, :2], strip.right[:, :2]], axis=1)
    cells = np.concatenate([sides[:-1], sides[1:]], axis=1)
    low, high = cells.min(axis=1), cells.max(axis=1)
    first, last = np.floor(low / CHUNK_SIZE) + 1, np.ceil(high / CHUNK_SIZE)
    pieces = [np.empty((0, 2, 2))]
    for cell, axis in np.argwhere(first < last):
        for border in np.arange(first[cell, axis], last[cell, axis]) * CHUNK_SIZE:
            piece = np.empty((1, 2, 2))
            piece[0, :, axis] = border
            piece[0, :, 1 - axis] = low[cell, 1 - axis] - GRID, high[cell, 1 - axis] + GRID
            pieces.append(np.round(piece / GRID))
    return np.concatenate(pieces)


def _faces(polygons: shapely.GeometryType) -> Faces:
    polygons = shapely.orient_polygons(polygons)
    rings, ring_face = shapely.get_rings(polygons, return_index=True)
    coordinates, ring = shapely.get_coordinates(rings, return_index=True)
    last = np.append(ring[1:] != ring[:-1], True)
    coordinates, ring = coordinates[~last], ring[~last]
    keys = np.round(coordinates / GRID).astype(np.int64)
    unique, vertices = np.unique(keys, axis=0, return_inverse=True)
    counts = np.bincount(ring, minlength=len(rings))
    return Faces(
        unique / round(1 / GRID),
        list(polygons),
        vertices.ravel().astype(np.int64),
        np.concatenate([[0], np.cumsum(counts)]),
        ring_face.astype(np.int64),
    )

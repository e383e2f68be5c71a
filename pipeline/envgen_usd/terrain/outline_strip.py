"""Triangulates the ground strip between the grid and the road's outline."""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.terrain.chunk_border import border_edges
from envgen_usd.terrain.grid_nodes import codes_of, places_of
from envgen_usd.terrain.ground_cells import Cells
from envgen_usd.terrain.outline_hem import sew_hem


@dataclass(frozen=True)
class Strip:
    """The triangulated strip.

    Attributes:
        triangles: T x 3, codes of the vertices (`grid_nodes.codes_of`), counter-clockwise.
        codes: N, codes of vertices that lie neither on the grid nor on the outline.
        heights: N, heights of these vertices, metres.
    """

    triangles: IntArray
    codes: IntArray
    heights: FloatArray


def triangulate_strip(chunk: Chunk, outline: Outline, cells: Cells) -> Strip:
    """Triangulates the strip (constrained Delaunay).

    The strip is bounded by (1) sides of clear cells, (2) the chunk's border and (3) the outline.
    These edges have the strip to their left; the hem has the strip on both sides. Their rings
    bound the faces.

    Args:
        chunk: Chunk.
        outline: The whole outline.
        cells: The chunk's cells.

    Raises:
        EnvgenError: The outline crosses a border without a vertex, or intersects itself.
    """
    near = outline.near(chunk.bounds, 1.0)
    inside = _outline_inside(chunk, near)
    hem = sew_hem(chunk, inside, near)
    edges = np.concatenate(
        [
            _sides_of_clear_cells(chunk, cells),
            border_edges(chunk, outline, near, cells.clear),
            np.stack([codes_of(chunk, end[:, :2]) for end in (inside.start, inside.end)], axis=1),
            hem.edges,
            hem.edges[:, ::-1],
        ]
    )
    return Strip(_triangulate(chunk, edges), hem.codes, hem.heights)


def _sides_of_clear_cells(chunk: Chunk, cells: Cells) -> IntArray:
    """Returns sides between clear cells and the strip, E x 2 codes, clockwise around the cell."""
    x, y = chunk.corner_axes()
    clear, strip = np.pad(cells.clear, 1), np.pad(cells.strip, 1)
    sides = []
    for shift, start, end in (
        ((-1, 0), (0, 1), (0, 0)),
        ((0, 1), (1, 1), (0, 1)),
        ((1, 0), (1, 0), (1, 1)),
        ((0, -1), (0, 0), (1, 0)),
    ):
        beyond = np.roll(strip, (-shift[0], -shift[1]), axis=(0, 1))
        row, column = np.nonzero((clear & beyond)[1:-1, 1:-1])
        places = [
            np.stack([x[column + corner[1]], y[row + corner[0]]], axis=1) for corner in (start, end)
        ]
        sides.append(np.stack([codes_of(chunk, place) for place in places], axis=1))
    return np.concatenate(sides)


def _outline_inside(chunk: Chunk, near: Outline) -> Outline:
    """Returns the outline's edges in the chunk, directed with the ground to their left.

    An edge along the border belongs to the chunk with the edge's ground.
    """
    low, high = np.array(chunk.bounds).reshape(2, 2)
    start, end = near.start[:, :2], near.end[:, :2]
    smallest, largest = np.minimum(start, end), np.maximum(start, end)
    inside = np.all((smallest >= low) & (largest <= high), axis=1)
    crossing = ~inside & np.all((smallest < high) & (largest > low), axis=1)
    if np.any(crossing):
        x, y = start[crossing][0]
        raise EnvgenError(
            f"the road's outline crosses the border of chunk {chunk.name} without a vertex, "
            f"in the edge from ({x:.3f}, {y:.3f})"
        )
    middle, along = (start + end) / 2, end - start
    to_ground = np.stack([along[:, 1], -along[:, 0]], axis=1)
    outwards = ((middle == low) & (to_ground < 0)) | ((middle == high) & (to_ground > 0))
    on_border = (smallest == largest) & ((middle == low) | (middle == high))
    keep = inside & ~np.any(on_border & outwards, axis=1)
    return Outline(near.end[keep], near.start[keep])


def _triangulate(chunk: Chunk, edges: IntArray) -> IntArray:
    """Triangulates (T x 3 codes) all faces to the left of directed edges (E x 2 codes)."""
    if not len(edges):
        return np.empty((0, 3), dtype=np.int64)
    lines = shapely.linestrings(places_of(chunk, np.unique(np.sort(edges, axis=1), axis=0)))
    faces = shapely.orient_polygons(shapely.get_parts(shapely.polygonize(lines)), exterior_cw=False)
    shells = shapely.get_exterior_ring(faces)
    first = [shapely.get_coordinates(shapely.get_point(shells, place)) for place in (0, 1)]
    sides = np.stack([codes_of(chunk, points) for points in first], axis=1)
    known = {tuple(edge) for edge in edges.tolist()}
    ours = np.array([tuple(side) in known for side in sides.tolist()], dtype=np.bool_)
    try:
        parts = shapely.get_parts(shapely.constrained_delaunay_triangles(faces[ours]))
    except shapely.errors.GEOSException as error:
        raise EnvgenError(f"the road's outline in chunk {chunk.name} intersects itself") from error
    corners = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]
    (ax, ay), (bx, by) = (np.moveaxis(corners[:, i] - corners[:, 0], -1, 0) for i in (1, 2))
    corners[ax * by < ay * bx] = corners[ax * by < ay * bx][:, ::-1]
    return codes_of(chunk, corners)

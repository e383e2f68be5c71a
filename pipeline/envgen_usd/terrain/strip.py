"""The strip of ground between the grid and the road's outline, without new vertices."""

import numpy as np
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.outline import Outline
from envgen_usd.models.arrays import BoolArray, FloatArray, IntArray
from envgen_usd.terrain.cells import Cells
from envgen_usd.terrain.nodes import codes_of, places_of

DROP_DISTANCE = 0.2
"""Corners on a chunk's border that are nearer to the outline than this are no vertices; less than
`CLEARANCE`, so that a clear cell keeps its corners."""


def triangulate_strip(chunk: Chunk, outline: Outline, cells: Cells) -> IntArray:
    """Triangulates the strip (constrained Delaunay).

    The strip is bounded by (1) sides of clear cells, (2) the chunk's border and (3) the outline.
    Its faces are found as the rings of these edges, which all have the strip to their left.

    Args:
        chunk: Tile.
        outline: The whole outline.
        cells: The chunk's cells.

    Returns:
        T x 3, codes of the vertices (`nodes.codes_of`), counter-clockwise.

    Raises:
        EnvgenError: The outline crosses a border without a vertex, or itself.
    """
    if not cells.strip.any():
        return np.empty((0, 3), dtype=np.int64)
    near = outline.near(chunk.bounds, 1.0)
    edges = np.concatenate(
        [
            _sides_of_clear_cells(chunk, cells),
            _border(chunk, outline, near, cells.clear),
            _outline_inside(chunk, near),
        ]
    )
    return _triangulate(chunk, edges)


def _sides_of_clear_cells(chunk: Chunk, cells: Cells) -> IntArray:
    """Sides between a clear cell and the strip, E x 2 codes, clockwise around the clear cell."""
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


def _border(chunk: Chunk, outline: Outline, near: Outline, clear: BoolArray) -> IntArray:
    """Pieces of the chunk's border that are ground of the strip, counter-clockwise."""
    x, y = chunk.corner_axes()
    low, high = np.array(chunk.bounds).reshape(2, 2)
    pieces = []
    for axis, level, along, backwards, cells in (
        (1, low[1], x, False, clear[0]),
        (0, high[0], y, False, clear[:, -1]),
        (1, high[1], x, True, clear[-1]),
        (0, low[0], y, True, clear[:, 0]),
    ):
        ends = _border_pieces(near, axis, level, along)
        cell = np.searchsorted(along, ends.mean(axis=1)[:, 1 - axis]) - 1
        ends = ends[~cells[cell]]
        codes = codes_of(chunk, ends[_off_road(outline, near, axis, level, ends)])
        pieces.append(codes[:, ::-1] if backwards else codes)
    return np.concatenate(pieces)


def _border_pieces(near: Outline, axis: int, level: float, along: FloatArray) -> FloatArray:
    """Pieces of a border line between vertices, P x 2 x 2 (ends, xy), in ascending order.

    Both chunks at the border find the same pieces.
    """
    corners = np.full((len(along), 2), level)
    corners[:, 1 - axis] = along
    distance, _ = near.nearest(corners, 1.0)
    distance[[0, -1]] = np.inf
    on_line = near.start[near.start[:, axis] == level, 1 - axis]
    on_line = on_line[(on_line >= along[0]) & (on_line <= along[-1])]
    stops = np.unique(np.concatenate([along[distance >= DROP_DISTANCE], on_line]))
    ends = np.full((len(stops) - 1, 2, 2), level)
    ends[:, 0, 1 - axis], ends[:, 1, 1 - axis] = stops[:-1], stops[1:]
    return ends


def _off_road(
    outline: Outline, near: Outline, axis: int, level: float, ends: FloatArray
) -> BoolArray:
    """Pieces of a border line that neither are on the road nor run along its outline."""
    middle = ends.mean(axis=1)
    flat = (near.start[:, axis] == level) & (near.end[:, axis] == level)
    spans = np.sort(np.stack([near.start[flat, 1 - axis], near.end[flat, 1 - axis]]), axis=0)
    place = middle[:, 1 - axis, None]
    along_outline = np.any((spans[0] < place) & (place < spans[1]), axis=1)
    off: BoolArray = ~along_outline & ~outline.encloses(middle)
    return off


def _outline_inside(chunk: Chunk, near: Outline) -> IntArray:
    """Edges of the outline in the chunk, E x 2 codes, turned so that the ground is to the left.

    An edge along the border belongs to the chunk on whose side its ground lies.
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
    return np.stack([codes_of(chunk, end[keep]), codes_of(chunk, start[keep])], axis=1)


def _triangulate(chunk: Chunk, edges: IntArray) -> IntArray:
    """Triangles of all faces to the left of directed edges (E x 2 codes)."""
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
        raise EnvgenError(f"the road's outline in chunk {chunk.name} crosses itself") from error
    corners = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]
    (ax, ay), (bx, by) = (np.moveaxis(corners[:, i] - corners[:, 0], -1, 0) for i in (1, 2))
    corners[ax * by < ay * bx] = corners[ax * by < ay * bx][:, ::-1]
    return codes_of(chunk, corners)

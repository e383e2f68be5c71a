"""The ground of a chunk as a mesh that is stitched to the road."""

import numpy as np
from scipy.ndimage import distance_transform_edt

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk, snap
from envgen_usd.geometry.outline import Outline
from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.ground import GroundMesh, HeightMap
from envgen_usd.models.surface import RoadSurface
from envgen_usd.terrain.cells import Cells, classify_cells
from envgen_usd.terrain.nodes import codes_of, places_of
from envgen_usd.terrain.strip import triangulate_strip


def build_ground(heightmap: HeightMap, surface: RoadSurface) -> GroundMesh:
    """Meshes the ground of one chunk.

    Cells that are clear of the road become quads; the strip between them and the road's outline
    is triangulated without new vertices on either. Ground and road (level 0) together are
    watertight, also
    over the borders of chunks: vertices on a border depend on the outline and the grid alone.

    Args:
        heightmap: Heights at the grid's corners.
        surface: The whole road. Its outline has vertices where it crosses borders of chunks.

    Raises:
        EnvgenError: The outline crosses a border without a vertex, or itself.
    """
    chunk = heightmap.chunk
    outline = Outline.of(surface)
    cells = classify_cells(chunk, outline)
    grid_codes = codes_of(chunk, np.stack(np.meshgrid(*chunk.corner_axes()), axis=-1))
    quads, cell_of_quad = _quads(cells, grid_codes)
    strip = triangulate_strip(chunk, outline, cells)
    codes, corners = np.unique(
        np.concatenate([quads.reshape(-1), strip.triangles.reshape(-1)]), return_inverse=True
    )
    plan = places_of(chunk, codes)
    road = outline.near(chunk.bounds, 0.0).start
    known = [codes_of(chunk, road[:, :2]), strip.codes, grid_codes.ravel()]
    heights = [road[:, 2], strip.heights, snap(heightmap.heights).ravel()]
    return GroundMesh(
        chunk,
        np.column_stack([plan, _first_of(codes, np.concatenate(known), np.concatenate(heights))]),
        np.repeat([4, 3], [len(quads), len(strip.triangles)]),
        corners.astype(np.int64),
        np.concatenate(
            [cell_of_quad, _cells_of(heightmap.chunk, outline, plan[corners[quads.size :]])]
        ),
    )


def _quads(cells: Cells, grid_codes: IntArray) -> tuple[IntArray, IntArray]:
    """Corner codes of the clear cells, Q x 4, and the cell of each."""
    row, column = np.nonzero(cells.clear)
    corners = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)]
    quads = np.stack([grid_codes[corner] for corner in corners], axis=1)
    return quads, row * LANDUSE_CELLS + column


def _first_of(codes: IntArray, known: IntArray, heights: FloatArray) -> FloatArray:
    """Height of each vertex: of the first known one at its place."""
    found, first = np.unique(known, return_index=True)
    result: FloatArray = heights[first[np.searchsorted(found, codes)]]
    return result


def _cells_of(chunk: Chunk, outline: Outline, corners: FloatArray) -> IntArray:
    """Landuse cell of each triangle (3 T x 2 corners), off the road."""
    on_road = outline.encloses_grid(*chunk.cell_centres())
    rows, columns = distance_transform_edt(on_road, return_distances=False, return_indices=True)
    centre = corners.reshape(-1, 3, 2).mean(axis=1) - np.array(chunk.origin)
    column, row = np.clip(centre // CELL_SIZE, 0, LANDUSE_CELLS - 1).astype(np.int64).T
    cells: IntArray = rows[row, column] * LANDUSE_CELLS + columns[row, column]
    return cells.astype(np.int64)

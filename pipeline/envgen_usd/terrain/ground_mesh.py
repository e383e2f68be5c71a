"""Builds the ground mesh of a chunk, stitched to the road."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk, snap
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.ground import GroundMesh, HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.terrain.grid_faces import halved_cells
from envgen_usd.terrain.grid_nodes import codes_of, places_of
from envgen_usd.terrain.ground_cells import classify_cells
from envgen_usd.terrain.joined_cells import joined_faces
from envgen_usd.terrain.outline_strip import triangulate_strip
from envgen_usd.terrain.straight_borders import straighten
from envgen_usd.terrain.water_walls import lower_faces


def build_ground(
    heightmap: HeightMap, outline: Outline, landuse: LanduseMap | None = None
) -> GroundMesh:
    """Builds the ground mesh of a chunk.

    Cells clear of the road become faces; those of a class that lie in a plane share one. A
    triangulation without new vertices fills the strip between these cells and the road's outline.
    Ground and road (level 0) form a watertight surface. Border vertices depend on the outline and
    the grid alone, so neighbouring chunks match. Water lies at its level, with walls where the land
    at it is higher.

    Args:
        heightmap: Heights at the grid's corners.
        outline: Outline of the whole road, with vertices at all crossings with chunk borders.
        landuse: Landuse classes with staircases to smooth. A cut cell becomes two triangles; the
            first has the landuse of the adjacent cell. Vertices on borders between classes move
            onto straight lines, but for those of the road and of the chunk's border. `None`
            stands for a single class.

    Raises:
        EnvgenError: The outline crosses a border without a vertex, or intersects itself.
    """
    chunk = heightmap.chunk
    cells = classify_cells(chunk, outline)
    off_road = _nearest_off_road(chunk, outline)
    looks = None if landuse is None else landuse.looks().ravel()[off_road]
    grid_codes = codes_of(chunk, np.stack(np.meshgrid(*chunk.corner_axes()), axis=-1))
    whole, halves = halved_cells(cells.clear, grid_codes, looks)
    strip = triangulate_strip(chunk, outline, cells)
    used = np.isin(grid_codes, np.concatenate([halves.corners.ravel(), strip.triangles.ravel()]))
    kinds = np.where(whole, 0 if looks is None else looks, -1)
    grid_heights = snap(heightmap.heights)
    quads, fans = joined_faces(kinds, grid_heights, grid_codes, used)
    faces = [quads.corners, fans.corners, halves.corners, strip.triangles]
    codes, corners = np.unique(np.concatenate([f.ravel() for f in faces]), return_inverse=True)
    plan = places_of(chunk, codes)
    road = outline.near(chunk.bounds, 0.0).start
    known = [codes_of(chunk, road[:, :2]), strip.codes, grid_codes.ravel()]
    heights = [road[:, 2], strip.heights, grid_heights.ravel()]
    of_strip = corners[len(corners) - strip.triangles.size :]
    centres = plan[of_strip].reshape(-1, 3, 2).mean(axis=1)
    at = [quads.cells, fans.cells, halves.cells, off_road.ravel()[_cells_at(chunk, centres)]]
    mesh = GroundMesh(
        chunk,
        np.column_stack([plan, _first_of(codes, np.concatenate(known), np.concatenate(heights))]),
        np.repeat([4, 3, 3, 3], [len(f) for f in faces]),
        corners.astype(np.int64),
        np.concatenate(at),
    )
    if landuse is None:
        return mesh
    is_free = np.isin(codes, grid_codes[1:-1, 1:-1])
    water = landuse.classes.ravel()[mesh.face_cell] == LanduseClass.WATER
    at_water = np.zeros(len(codes), dtype=bool)
    at_water[mesh.face_vertices[np.repeat(water, mesh.face_sizes)]] = True
    mesh = _with_straight_borders(mesh, landuse.looks(), heightmap, is_free, at_water)
    return mesh if heightmap.water is None else lower_faces(mesh, water, heightmap.water)


def _with_straight_borders(
    mesh: GroundMesh,
    looks: IntArray,
    heightmap: HeightMap,
    is_free: BoolArray,
    at_water: BoolArray,
) -> GroundMesh:
    """Moves vertices on borders of landuse.

    Args:
        mesh: The mesh.
        looks: Kinds of its cells.
        heightmap: Heights at the new places.
        is_free: V, which vertices may move.
        at_water: V, which vertices keep their heights, since land and water differ there.
    """
    plan = mesh.vertices[:, :2]
    kinds = looks.ravel()[mesh.face_cell]
    starts = np.cumsum(mesh.face_sizes) - mesh.face_sizes
    steps = np.minimum(np.arange(4), mesh.face_sizes[:, None] - 1)
    moved = straighten(plan, mesh.face_vertices[starts[:, None] + steps], kinds, ~is_free)
    changed = (moved != plan).any(axis=1) & ~at_water
    vertices = np.column_stack([moved, mesh.vertices[:, 2]])
    vertices[changed, 2] = snap(_heights_at(heightmap, moved[changed]))
    return replace(mesh, vertices=vertices)


def _heights_at(heightmap: HeightMap, places: FloatArray) -> FloatArray:
    """Bilinear heights at places of the chunk (N x 2), metres."""
    column, row = ((places - np.array(heightmap.chunk.origin)) / CELL_SIZE).T
    heights: FloatArray = map_coordinates(heightmap.heights, (row, column), order=1)
    return heights


def _nearest_off_road(chunk: Chunk, outline: Outline) -> IntArray:
    """Returns for each cell, 255 x 255, the nearest cell (row * 255 + column) off the road."""
    on_road = outline.encloses_grid(*chunk.cell_centres())
    rows, columns = distance_transform_edt(on_road, return_distances=False, return_indices=True)
    nearest: IntArray = rows.astype(np.int64) * LANDUSE_CELLS + columns
    return nearest


def _first_of(codes: IntArray, known: IntArray, heights: FloatArray) -> FloatArray:
    """Returns the height of each vertex: that of the first known vertex with the same code."""
    unique, first = np.unique(known, return_index=True)
    result: FloatArray = heights[first[np.searchsorted(unique, codes)]]
    return result


def _cells_at(chunk: Chunk, places: FloatArray) -> IntArray:
    """Returns the cells (row * 255 + column) of points (N x 2, metres)."""
    steps = np.clip((places - np.array(chunk.origin)) // CELL_SIZE, 0, LANDUSE_CELLS - 1)
    column, row = steps.astype(np.int64).T
    cells: IntArray = row * LANDUSE_CELLS + column
    return cells

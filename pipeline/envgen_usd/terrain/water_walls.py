"""Walls between land and water that lies below it."""

from dataclasses import replace

import numpy as np

from envgen_usd.chunks import CELL_SIZE, HEIGHT_SAMPLES, LANDUSE_CELLS, snap
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.ground import GroundMesh, Water


def lower_faces(mesh: GroundMesh, is_water: BoolArray, water: Water) -> GroundMesh:
    """Returns a mesh whose faces of water lie at its level, with walls up to the land.

    Water has its own vertices, so that it is shaded as level; so have walls. An edge between water
    and land, or between water and the road, gets a wall where their heights differ. On the chunk's
    border, the chunk of the water has the wall.

    Args:
        mesh: Ground without walls; vertices have the height of the land.
        is_water: F, whether a face is water.
        water: Water of the chunk.
    """
    if not is_water.any():
        return mesh
    of_corner = np.repeat(is_water, mesh.face_sizes)
    old = np.unique(mesh.face_vertices[of_corner])
    low = mesh.vertices[old].copy()
    low[:, 2] = _levels(mesh, low, water)
    number = np.arange(len(mesh.vertices))
    number[old] = len(number) + np.arange(len(old))
    corners = np.where(of_corner, number[mesh.face_vertices], mesh.face_vertices)
    start, end, cell = _shore(mesh, is_water, water)
    vertices = np.concatenate([mesh.vertices, low])
    walls = np.stack([number[end], number[start], start, end], axis=1)
    tall = vertices[walls, 2]
    has = np.stack([tall[:, 3] > tall[:, 0], tall[:, 2] > tall[:, 1]], axis=1)
    kept = has.any(axis=1)
    walls, has, cell = walls[kept], has[kept], cell[kept]
    # Seen from the water: from the water's end to its start and up; one end may have no height.
    shown = np.column_stack([np.ones((len(walls), 2), dtype=bool), has[:, ::-1]])
    places = vertices[walls[shown]]
    first = len(vertices)
    vertices = np.concatenate([vertices, places])
    sizes = np.concatenate([mesh.face_sizes, shown.sum(axis=1)])
    corners = np.concatenate([corners, first + np.arange(len(places))])
    used, corners = np.unique(corners, return_inverse=True)
    return replace(
        mesh,
        vertices=vertices[used],
        face_sizes=sizes,
        face_vertices=corners.astype(np.int64),
        face_cell=np.concatenate([mesh.face_cell, cell]),
        walls=len(walls),
    )


def _levels(mesh: GroundMesh, places: FloatArray, water: Water) -> FloatArray:
    """Level of the water at vertices of it, metres, never above them."""
    steps = (places[:, :2] - np.array(mesh.chunk.origin)) / CELL_SIZE
    column, row = np.clip(np.round(steps).astype(np.int64), 0, HEIGHT_SAMPLES - 1).T
    levels = snap(water.levels[row, column])
    found: FloatArray = np.where(np.isnan(levels), places[:, 2], np.minimum(levels, places[:, 2]))
    return found


def _shore(
    mesh: GroundMesh, is_water: BoolArray, water: Water
) -> tuple[IntArray, IntArray, IntArray]:
    """Start, end and landuse cell of the edges of water that end at land, water to the left."""
    face = np.repeat(np.arange(len(mesh.face_sizes)), mesh.face_sizes)
    first = np.cumsum(mesh.face_sizes) - mesh.face_sizes
    start = mesh.face_vertices
    following = np.arange(1, len(start) + 1)
    following[first + mesh.face_sizes - 1] = first
    end = start[following]
    own = is_water[face]
    count = len(mesh.vertices)
    codes = np.minimum(start, end) * count + np.maximum(start, end)
    values, times = np.unique(codes[own], return_counts=True)
    shared = values[times == 2]
    alone = own & ~np.isin(codes, shared)
    start, end, cell = start[alone], end[alone], mesh.face_cell[face[alone]]
    closed = ~_open_border(mesh, start, end, water)
    return start[closed], end[closed], cell[closed]


def _open_border(mesh: GroundMesh, start: IntArray, end: IntArray, water: Water) -> BoolArray:
    """Which edges lie on the chunk's border with water, or with nothing, behind it."""
    south_west = np.array(mesh.chunk.origin)
    corners = np.concatenate(mesh.chunk.corner_axes())[[0, HEIGHT_SAMPLES - 1, HEIGHT_SAMPLES, -1]]
    low, high = corners[[0, 2]], corners[[1, 3]]
    ends = mesh.vertices[np.stack([start, end]), :2]
    middle = (ends.mean(axis=0) - south_west) // CELL_SIZE
    column, row = np.clip(middle, 0, LANDUSE_CELLS - 1).astype(np.int64).T
    result = np.zeros(len(start), dtype=bool)
    for side, (axis, line, along) in enumerate(
        ((1, low[1], column), (1, high[1], column), (0, low[0], row), (0, high[0], row))
    ):
        there = (ends[..., axis] == line).all(axis=0)
        result |= there & (water.beyond[side, along] | ~water.known[side])
    return result

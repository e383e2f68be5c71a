"""Lifts the faces of the arrangement to their heights, as a mesh without gaps."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from envgen_usd.chunks import GRID
from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.border_loops import trace_loops
from envgen_usd.geometry.flat_arrays import distinct_rows
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.junctions import Junction
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.mesh.arrangement import Faces
from envgen_usd.opendrive.mesh.half_edges import half_edges
from envgen_usd.opendrive.mesh.kerbs import build_walls, saddles
from envgen_usd.opendrive.mesh.overlap_removal import Cover
from envgen_usd.opendrive.mesh.surface_seams import Seams, find_seams
from envgen_usd.opendrive.mesh.vertex_heights import VertexHeights
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.strip_index import Cells

_SPAN = 1 << 32
"""Larger than any range of heights in grid units."""
_SMALLEST_STEP = 10
"""Largest height step in grid units that is levelled; larger steps get kerbs."""
_FACES = 2048
"""Faces that are triangulated at a time; a larger value costs memory."""


@dataclass(frozen=True)
class Mesh:
    """A triangulated level of the road surface; attributes as in `RoadSurface`."""

    vertices: FloatArray
    triangles: IntArray
    triangle_patch: IntArray
    patches: tuple[Patch, ...]
    outline: tuple[IntArray, ...]
    smoothed: Mapping[str, float] = field(default_factory=dict)
    """Largest height differences of connecting roads in metres, by junction id."""


@dataclass(frozen=True, eq=False)
class CornerHeights:
    """Heights of the corners of the faces.

    Attributes:
        z: Height at each ring vertex of each face in grid units; 0 for faces without a lane.
        smoothed: As of a `Mesh`.
    """

    z: IntArray
    smoothed: Mapping[str, float]


def corner_heights(
    faces: Faces,
    cover: Cover,
    strips: Sequence[Strip],
    cells: Cells,
    junctions: Sequence[Junction] = (),
) -> CornerHeights:
    """Gives each face the heights of its lane at its corners; nearly equal heights are merged.

    Args:
        faces: The arrangement.
        cover: Assignment of the faces to lanes.
        strips: Strips of lanes.
        cells: Spatial index of the strips.
        junctions: Junctions with an elevation grid.
    """
    heights = VertexHeights(faces.points, strips, cells, junctions)
    face = _face_of_corner(faces)
    z = np.zeros(len(face), dtype=np.int64)
    chosen = np.flatnonzero((cover.patch >= 0)[face])
    vertex = faces.ring_vertices[chosen]
    exact = heights.base[vertex] + heights.of_lane(vertex, cover.lane[face[chosen]])
    z[chosen] = _merged(vertex, np.round(exact / GRID).astype(np.int64))
    return CornerHeights(z, heights.smoothed)


def lift(faces: Faces, cover: Cover, heights: CornerHeights) -> Mesh:
    """Lifts the covered faces to the heights of their corners, closes steps, and triangulates.

    The ground meets the border at the lowest height of a vertex. Walls close all edges with
    different heights on both sides.

    Args:
        faces: The arrangement.
        cover: Assignment of the faces to lanes.
        heights: Heights of the corners.
    """
    covered, corner_z = cover.patch >= 0, heights.z.copy()
    edges = half_edges(faces, covered)
    seams = find_seams(edges, corner_z)
    while doubtful := saddles(seams):
        _flatten(faces, corner_z, doubtful, covered)
        seams = find_seams(edges, corner_z)
    walls, wall_edge = build_walls(seams)
    flat, flat_face = _triangulate(faces, corner_z, covered)
    patches, wall_patch = _kerbs(cover, seams, wall_edge)
    corners = np.concatenate([flat, walls]).reshape(-1, 2)
    keys, number = np.unique(_codes(*corners.T), return_inverse=True)
    vertices = np.column_stack([faces.points[keys // _SPAN], keys % _SPAN - _SPAN // 2])
    vertices[:, 2] /= round(1 / GRID)
    return Mesh(
        vertices,
        number.reshape(-1, 3).astype(np.int64),
        np.concatenate([cover.patch[flat_face], wall_patch]),
        patches,
        _outline(faces, seams, keys),
        heights.smoothed,
    )


def smoothed_junctions(meshes: Iterable[Mesh]) -> Iterator[Issue]:
    """Yields an issue for each junction whose connecting roads disagree in height."""
    for mesh in meshes:
        for junction, height in sorted(mesh.smoothed.items()):
            yield Issue(
                "junction.heights",
                Severity.WARNING,
                f"junction[id={junction}]",
                f"its connecting roads disagree in height by up to {height:.3f} m",
                "joined to a smooth surface",
            )


def _face_of_corner(faces: Faces) -> IntArray:
    return np.repeat(faces.ring_face, np.diff(faces.ring_start))


def _merged(vertex: IntArray, z: IntArray) -> IntArray:
    """Merges nearly equal heights at a vertex into the lowest of them."""
    order = np.lexsort((z, vertex))
    vertex, sorted_z = vertex[order], z[order]
    starts = np.ones(len(order), dtype=bool)
    starts[1:] = (np.diff(vertex) != 0) | (np.diff(sorted_z) > _SMALLEST_STEP)
    group = np.maximum.accumulate(np.where(starts, np.arange(len(order)), 0))
    merged = np.empty_like(z)
    merged[order] = sorted_z[group]
    return merged


def _flatten(faces: Faces, corner_z: IntArray, vertices: list[int], covered: BoolArray) -> None:
    """Levels all heights at the given vertices, in place."""
    chosen = covered[_face_of_corner(faces)] & np.isin(faces.ring_vertices, vertices)
    corner = np.flatnonzero(chosen)
    vertex = faces.ring_vertices[corner]
    lowest = np.full(len(faces.points), np.iinfo(np.int64).max)
    np.minimum.at(lowest, vertex, corner_z[corner])
    corner_z[corner] = lowest[vertex]


def _triangulate(faces: Faces, corner_z: IntArray, covered: BoolArray) -> tuple[IntArray, IntArray]:
    """Triangulates by constrained Delaunay: T x 3 x (vertex, height), and the face of each."""
    chosen = np.flatnonzero(covered)
    corners, owners = [np.empty((3, 0), np.int64)], [np.empty(0, np.int64)]
    for first in range(0, len(chosen), _FACES):
        few = chosen[first : first + _FACES]
        collections = shapely.constrained_delaunay_triangles(faces.polygons[few])
        rings, owner = shapely.get_coordinates(collections, include_z=True, return_index=True)
        corners.append(rings[:, 2].reshape(-1, 4).T[:3].astype(np.int64))
        owners.append(few[owner[::4]])
    corner = np.concatenate(corners, axis=1)
    vertex = faces.ring_vertices.take(corner)
    x, y = (column.take(vertex) for column in faces.points.T)
    turn = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])
    corner = np.where(turn < 0, corner[::-1], corner)
    triangles = np.stack([faces.ring_vertices.take(corner), corner_z.take(corner)])
    return triangles.T, np.concatenate(owners)


def _kerbs(cover: Cover, seams: Seams, wall_edge: IntArray) -> tuple[tuple[Patch, ...], IntArray]:
    """Returns the patches including those of walls, and the patch of each wall triangle."""
    left_up = (seams.left.sum(axis=1) >= seams.right.sum(axis=1)) | (seams.opposite < 0)
    upper = np.where(left_up, seams.face, seams.opposite)
    index = {patch: k for k, patch in enumerate(cover.patches)}
    patch_of = np.empty(len(wall_edge), dtype=np.int64)
    for k, owner in enumerate(cover.patch[upper[wall_edge]].tolist()):
        above = cover.patches[owner]
        kerb = replace(above, id=f"{above.id}_kerb", kind="kerb", colour="", mark_type="")
        patch_of[k] = index.setdefault(kerb, len(index))
    return tuple(index), patch_of


def _outline(faces: Faces, seams: Seams, keys: IntArray) -> tuple[IntArray, ...]:
    """Returns the loops of mesh vertices between ground and surface."""
    border = seams.opposite < 0
    edges = np.column_stack([seams.start[border], seams.end[border]])
    ground = np.zeros(len(faces.points), dtype=np.int64)
    ground[edges] = seams.right[border]
    return tuple(
        np.searchsorted(keys, _codes(loop, ground[loop]))
        for loop in trace_loops(edges, faces.points)
    )


def _codes(vertex: IntArray, z: IntArray) -> IntArray:
    """Returns a number for each vertex of the arrangement at a height in grid units."""
    return vertex * _SPAN + (z + _SPAN // 2)


def join_levels(meshes: Sequence[tuple[int, Mesh]]) -> tuple[Mesh, IntArray]:
    """Joins meshes of several levels with shared vertices.

    Args:
        meshes: Pairs of level and mesh; a level may have several separate meshes.

    Returns:
        The joined mesh with the outline of level 0, and the level of each triangle.
    """
    patches = dict.fromkeys(patch for _, mesh in meshes for patch in mesh.patches)
    index = {patch: k for k, patch in enumerate(patches)}
    points = np.concatenate([mesh.vertices for _, mesh in meshes])
    first, vertex = distinct_rows(np.round(points / GRID).astype(np.int64))
    triangles, meaning, levels = [], [], []
    outline: tuple[IntArray, ...] = ()
    offset = 0
    for level, mesh in meshes:
        number = vertex[offset : offset + len(mesh.vertices)]
        offset += len(mesh.vertices)
        triangles.append(number[mesh.triangles])
        meaning.append(np.array([index[patch] for patch in mesh.patches])[mesh.triangle_patch])
        levels.append(np.full(len(mesh.triangles), level))
        if level == 0:
            outline += tuple(number[loop] for loop in mesh.outline)
    joined = Mesh(
        points[first],
        np.concatenate(triangles),
        np.concatenate(meaning),
        tuple(patches),
        outline,
    )
    return joined, np.concatenate(levels)

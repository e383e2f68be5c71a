"""Merges the meshes of a region that are placed a few times: by look, within square tiles.

The meshes of a batch are joined, so that each step is a single operation on long arrays. A group
holds the triangles of a look and a tile. A region is merged by itself, so that what was merged can
be kept in a file.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.packed_layout import GROUP, VERTEX
from envgen_usd.render.render_scene import Geometry, Merged, Use

MERGED_USES = 3
"""Number of placements above which a mesh is instanced; a larger value merges more meshes."""
TILE = 16.0
"""Side length of a tile, metres; a larger value gives fewer draws and culls less."""
GRID = 4096.0
"""Merged points are multiples of 1 / 4096 m, so that points shared by two tiles stay equal."""
_SPLIT_TRIANGLES = 32
"""Triangles above which a mesh larger than a tile is split; a larger value splits fewer meshes."""
_BATCH = 50_000
"""Points of the meshes that are merged at once; a larger value takes more memory."""
_SHIFT = 32
"""Bits of a vertex's number in a key of group and vertex."""

_Key = tuple[bool, int, int, int]
"""Group: double-sided, material, and cell of its tile along x and y."""


def is_merged(use: Use) -> bool:
    """True if the placements of a mesh are merged with other meshes."""
    return len(use.matrices) <= MERGED_USES and use.level is None


class _Placed(NamedTuple):
    """A placement: the geometry, 4 x 4 to world coordinates, and the index of its label."""

    geometry: Geometry
    matrix: FloatArray
    scene_object: int


def merge(geometries: Sequence[Geometry], uses: Sequence[Use]) -> Merged:
    """Merges the placements of `uses` that are to be merged (`is_merged`), in their order."""
    placed = [
        _Placed(geometries[use.geometry], matrix, name)
        for use in uses
        if is_merged(use)
        for matrix, name in zip(use.matrices, use.scene_objects.tolist(), strict=True)
    ]
    numbers: dict[_Key, int] = {}
    parts = [_part(_joined(batch), numbers) for batch in _batches(placed)]
    groups = np.zeros(len(numbers), GROUP)
    low, high = groups["box"].transpose(1, 0, 2)
    low[:], high[:] = np.inf, -np.inf
    for part in parts:
        first = groups["vertices"][part.groups]
        part.indices[:] += np.repeat(first, part.index_counts).astype(np.uint32)
        groups["vertices"][part.groups] += part.vertex_counts
        groups["corners"][part.groups] += part.index_counts
        low[part.groups] = np.minimum(low[part.groups], part.boxes[:, 0])
        high[part.groups] = np.maximum(high[part.groups], part.boxes[:, 1])
    keys = np.array(list(numbers), np.int64).reshape(-1, 4)
    groups["double_sided"], groups["material"], groups["cell"] = keys[:, 0], keys[:, 1], keys[:, 2:]
    groups["box"][..., :2] += TILE * keys[:, None, 2:]
    return Merged(
        vertices=_gathered(parts, "vertices", _starts(groups["vertices"]), VERTEX),
        indices=_gathered(parts, "indices", _starts(groups["corners"]), np.dtype(np.uint32)),
        groups=groups,
    )


@dataclass
class _Part:
    """Vertices and corners of a batch by group; groups ascend, boxes are relative to their tile."""

    groups: IntArray
    vertices: NDArray[np.void]
    vertex_counts: IntArray
    indices: NDArray[np.uint32]
    index_counts: IntArray
    boxes: FloatArray


@dataclass(frozen=True)
class _Joined:
    """The placed meshes of a batch in one.

    Attributes:
        placed: N, the placements.
        points: P x 3, world.
        triangles: T x 3, counted over all meshes.
        point_starts: N + 1, first point of each mesh.
        triangle_counts: N.
        turns: N, True where the placement turns or scales the mesh.
    """

    placed: Sequence[_Placed]
    points: FloatArray
    triangles: IntArray
    point_starts: IntArray
    triangle_counts: IntArray
    turns: BoolArray


def _batches(placed: Sequence[_Placed]) -> Iterator[Sequence[_Placed]]:
    first = total = 0
    for number, each in enumerate(placed):
        total += len(each.geometry.points)
        if total > _BATCH:
            yield placed[first : number + 1]
            first, total = number + 1, 0
    if first < len(placed):
        yield placed[first:]


def _joined(placed: Sequence[_Placed]) -> _Joined:
    matrices = np.stack([each.matrix for each in placed])
    axes, shifts = matrices[:, :3, :3], matrices[:, :3, 3]
    turns = (axes != np.eye(3)).any(axis=(1, 2))
    meshes = [each.geometry for each in placed]
    counts = [len(mesh.triangles) for mesh in meshes]
    starts = _starts([len(mesh.points) for mesh in meshes])
    points = [
        mesh.points @ axes[number].T if turned else mesh.points
        for number, (mesh, turned) in enumerate(zip(meshes, turns.tolist(), strict=True))
    ]
    triangles = np.concatenate([mesh.triangles for mesh in meshes]).astype(np.int64)
    triangles += np.repeat(starts[:-1], counts)[:, None]
    mirrored = np.repeat(np.linalg.det(axes) < 0, counts)
    if mirrored.any():
        triangles[mirrored] = triangles[mirrored, ::-1]
    return _Joined(
        placed=placed,
        points=np.concatenate(points) + np.repeat(shifts, np.diff(starts), axis=0),
        triangles=triangles,
        point_starts=starts,
        triangle_counts=np.array(counts),
        turns=turns,
    )


def _part(joined: _Joined, numbers: dict[_Key, int]) -> _Part:
    """Sorts the triangles of a batch by group, and gives each group vertices of its own."""
    found, local, cells = _groups(joined, numbers)
    order = np.argsort(local.astype(np.min_scalar_type(len(found))), kind="stable")
    corner, group = joined.triangles[order].reshape(-1), np.repeat(local[order], 3)
    vertex, of_group, index = _compact(corner, group, len(joined.points))
    vertex_counts = np.bincount(of_group, minlength=len(found))
    starts = _starts(vertex_counts)[:-1]
    positions = joined.points[vertex]
    positions[:, :2] -= np.repeat(TILE * cells, vertex_counts, axis=0)
    positions = (np.round(positions * GRID) / GRID).astype(np.float32)
    vertices = _vertices(joined)[vertex]
    vertices["position"] = positions
    columns = [np.ascontiguousarray(column) for column in positions.T]
    low = [np.minimum.reduceat(column, starts) for column in columns]
    high = [np.maximum.reduceat(column, starts) for column in columns]
    return _Part(
        groups=found,
        vertices=vertices,
        vertex_counts=vertex_counts,
        indices=(index - starts[group]).astype(np.uint32),
        index_counts=np.bincount(group, minlength=len(found)),
        boxes=np.stack((np.stack(low, axis=1), np.stack(high, axis=1)), axis=1).astype(np.float64),
    )


def _groups(joined: _Joined, numbers: dict[_Key, int]) -> tuple[IntArray, IntArray, IntArray]:
    """Groups of a batch; new ones are numbered.

    Returns:
        Numbers of the groups, ascending, for each triangle the place among them, and their cells.
    """
    cells = _cells(joined)  # T x 2
    low = cells.min(axis=0)
    width, height = (cells.max(axis=0) - low + 1).tolist()
    mesh = np.repeat(np.arange(len(joined.placed)), joined.triangle_counts)
    key = (mesh * height + cells[:, 1] - low[1]) * width + cells[:, 0] - low[0]
    runs = np.flatnonzero(np.diff(key, prepend=-1))
    pairs = np.unique(key[runs])
    rows, x = np.divmod(pairs, width)
    mesh_of_pair, y = np.divmod(rows, height)
    places = np.stack((x, y), axis=1) + low
    looks = [(each.geometry.double_sided, each.geometry.material) for each in joined.placed]
    named = zip(mesh_of_pair.tolist(), places.tolist(), strict=True)
    number = [numbers.setdefault((*looks[mesh], *cell), len(numbers)) for mesh, cell in named]
    found, first, local = np.unique(number, return_index=True, return_inverse=True)
    place = local[np.searchsorted(pairs, key[runs])]
    return found, np.repeat(place, np.diff(runs, append=len(key))), places[first]


def _cells(joined: _Joined) -> IntArray:
    """Cell of each triangle, T x 2: its own in large meshes, else that of the mesh."""
    starts, counts = joined.point_starts[:-1], joined.triangle_counts
    columns = [np.ascontiguousarray(joined.points[:, axis]) for axis in range(2)]
    low = np.stack([np.minimum.reduceat(column, starts) for column in columns], axis=1)
    high = np.stack([np.maximum.reduceat(column, starts) for column in columns], axis=1)
    split = (counts > _SPLIT_TRIANGLES) & ((high - low).max(axis=1) > 1.5 * TILE)
    cells = np.repeat(np.floor((low + high) / 2 / TILE).astype(np.int64), counts, axis=0)
    apart = np.flatnonzero(np.repeat(split, counts))
    a, b, c = joined.triangles[apart].T
    for axis, column in enumerate(columns):
        middle = (column[a] + column[b] + column[c]) / 3
        cells[apart, axis] = np.floor(middle / TILE).astype(np.int64)
    return cells


def _compact(corner: IntArray, group: IntArray, count: int) -> tuple[IntArray, IntArray, IntArray]:
    """Gives each group vertices of its own.

    Args:
        corner: C, point of each corner.
        group: C, group of each corner.
        count: Number of points.

    Returns:
        The point and the group of each vertex, by group and point, and the vertex of each corner.
    """
    # Nearly all points lie in a single group; only the others need a search.
    main = np.full(count, -1, np.int64)
    main[corner] = group
    used = np.flatnonzero(main >= 0)
    shared = np.flatnonzero(main[corner] != group)
    shared_keys = (group[shared] << _SHIFT) + corner[shared]
    keys = np.concatenate(((main[used] << _SHIFT) + used, np.unique(shared_keys)))
    keys.sort()
    point, of_group = keys & ((1 << _SHIFT) - 1), keys >> _SHIFT
    place = np.zeros(count, np.int64)
    is_main = np.flatnonzero(main[point] == of_group)
    place[point[is_main]] = is_main
    index = place[corner]
    index[shared] = np.searchsorted(keys, shared_keys)
    return point, of_group, index


def _vertices(joined: _Joined) -> NDArray[np.void]:
    """All points as vertices without positions."""
    meshes = [each.geometry for each in joined.placed]
    normals = [
        turned_normals(each.geometry.normals, each.matrix) if turned else each.geometry.normals
        for each, turned in zip(joined.placed, joined.turns.tolist(), strict=True)
    ]
    vertices = np.zeros(len(joined.points), VERTEX)
    vertices["normal"][:, :3] = np.round(np.concatenate(normals) * 32767.0)
    vertices["uv"] = np.concatenate([mesh.uvs for mesh in meshes])
    vertices["colour"] = np.concatenate([mesh.colours for mesh in meshes])
    objects = np.array([each.scene_object for each in joined.placed], np.uint32)
    vertices["scene_object"] = np.repeat(objects, np.diff(joined.point_starts))
    return vertices


def turned_normals(normals: NDArray[np.float32], matrix: FloatArray) -> NDArray[np.float32]:
    """Normals in the world: through the inverse transpose."""
    turned = normals @ np.linalg.pinv(matrix[:3, :3])
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    result: NDArray[np.float32] = (turned / np.maximum(length, 1e-30)).astype(np.float32)
    return result


def _gathered(
    parts: Iterable[_Part], name: str, starts: IntArray, kind: np.dtype[Any]
) -> NDArray[Any]:
    """Joins an array of the parts by group, and takes it from the parts."""
    joined = np.empty(int(starts[-1]), kind)
    free = starts[:-1].copy()
    for part in parts:
        values = getattr(part, name)
        counts = part.vertex_counts if name == "vertices" else part.index_counts
        sources, places = _starts(counts).tolist(), free[part.groups].tolist()
        for place, (first, end) in zip(places, pairwise(sources), strict=True):
            joined[place : place + end - first] = values[first:end]
        free[part.groups] += counts
        setattr(part, name, None)
    return joined


def _starts(counts: Sequence[int] | IntArray) -> IntArray:
    """0 and the running totals of counts."""
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))

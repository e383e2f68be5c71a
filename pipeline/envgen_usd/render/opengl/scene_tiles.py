"""Packs a scene for the GPU: few, large draws that are culled by tile.

Single-use meshes are merged by material within square tiles. Frequent meshes keep a single copy of
their triangles and are drawn as instances. Each merged mesh is an instance too.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.opengl.merged_tiles import TILE, Merged, Placed, TileTable, merge
from envgen_usd.render.opengl.packed_layout import COMMAND, INSTANCE, VERTEX, State
from envgen_usd.render.render_scene import Geometry, Scene, Use, extent

MERGED_USES = 3
"""Number of placements above which a mesh is instanced; a larger value merges more meshes."""


@dataclass(frozen=True)
class Packed:
    """Arrays for the GPU.

    Attributes:
        vertices: V of `VERTEX`; positions relative to a tile, or to a prototype.
        indices: Corners of all triangles, relative to the draw's base vertex.
        instances: N of `INSTANCE`, numbered in the order of the commands; rows of the matrix to the
            tile.
        boxes: N x 2 x 3, minimum and maximum corner of each instance, world.
        commands: D of `COMMAND`, sorted by state.
        states: State of each draw, D.
        origins: T x 3, origins of the tiles, world.
        places: N x 3, points whose distance decides the level of detail, world.
        sizes: N, metres: above 0 for the detailed level, below 0 for the far one, 0 without levels.
        footprints: N, area that each instance's box covers in plan, square metres; infinite for
            merged meshes.
        reach: Distance from the camera within which instances are drawn, metres.
    """

    vertices: NDArray[np.void]
    indices: NDArray[np.uint32]
    instances: NDArray[np.void]
    boxes: FloatArray
    commands: NDArray[np.void]
    states: tuple[State, ...]
    origins: FloatArray
    places: FloatArray
    sizes: FloatArray
    footprints: FloatArray
    reach: float = np.inf

    def chosen(self, seen: BoolArray) -> tuple[NDArray[np.void], NDArray[np.void], IntArray]:
        """Returns the selected instances with their commands.

        Args:
            seen: N, True for the instances to draw.

        Returns:
            The instances, the commands that draw them, and the index of each command's state.
        """
        starts = self.commands["base_instance"].astype(np.int64)
        counts = np.add.reduceat(seen.astype(np.int64), starts)
        kept = np.flatnonzero(counts)
        commands = self.commands[kept].copy()
        commands["instances"] = counts[kept]
        commands["base_instance"] = np.cumsum(counts[kept]) - counts[kept]
        return self.instances[seen], commands, kept


def pack(scene: Scene, reach: float = np.inf) -> Packed:
    """Packs the geometry of a scene.

    Args:
        scene: Scene, or a part of it.
        reach: Range within which instances are drawn, metres.
    """
    frequent: dict[int, list[Use]] = {}
    placed: list[Placed] = []
    for use in scene.uses:
        if len(use.matrices) > MERGED_USES or use.level:
            frequent.setdefault(use.geometry, []).append(use)
            continue
        geometry = scene.geometries[use.geometry]
        pairs = zip(use.matrices, use.scene_objects.tolist(), strict=True)
        placed += [Placed(geometry, matrix, name, use.region) for matrix, name in pairs]
    tiles = TileTable(float(np.floor(scene.bounds.mean(axis=0)[2] / TILE) * TILE))
    meshes = [scene.geometries[key] for key in frequent]
    room = sum(len(mesh.points) for mesh in meshes), sum(mesh.triangles.size for mesh in meshes)
    merged = merge(placed, tiles, room)
    repeated = [_repeated(scene.geometries[key], uses, tiles) for key, uses in frequent.items()]
    return _packed(merged, repeated, tiles.origins, reach)


@dataclass(frozen=True)
class _Repeated:
    """A geometry with its instances.

    Attributes:
        vertices: V of `VERTEX`, in the space of the geometry.
        indices: Corners of the triangles.
        state: State of the instances that are not mirrored.
        mirrored: N, True for instances that are.
        tiles: N, tile of each instance.
        matrices: N x 4 x 4, to world coordinates.
        scene_objects: N.
        boxes: N x 2 x 3, minimum and maximum corner, world.
        places: N x 3, as in `Packed`.
        sizes: N, as in `Packed`.
        footprints: N, as in `Packed`.
    """

    vertices: NDArray[np.void]
    indices: NDArray[np.uint32]
    state: State
    mirrored: BoolArray
    tiles: IntArray
    matrices: FloatArray
    scene_objects: NDArray[np.uint32]
    boxes: FloatArray
    places: FloatArray
    sizes: FloatArray
    footprints: FloatArray


def _repeated(geometry: Geometry, uses: Sequence[Use], tiles: TileTable) -> _Repeated:
    matrices = np.concatenate([use.matrices for use in uses])
    vertices = np.zeros(len(geometry.points), VERTEX)
    vertices["position"] = geometry.points
    vertices["normal"][:, :3] = np.round(geometry.normals * 32767.0)
    vertices["uv"] = geometry.uvs
    vertices["colour"] = geometry.colours
    volume = np.linalg.det(matrices[:, :3, :3])
    size, middle = _level(uses[0])
    return _Repeated(
        vertices=vertices,
        indices=geometry.triangles.reshape(-1),
        state=State(geometry.double_sided, False, geometry.material),
        mirrored=volume < 0,
        tiles=tiles.tile_of(matrices[:, :2, 3]),
        matrices=matrices,
        scene_objects=np.concatenate([use.scene_objects for use in uses]),
        boxes=geometry.boxes(matrices),
        places=matrices[:, :3, :3] @ middle + matrices[:, :3, 3],
        sizes=size * np.cbrt(np.abs(volume)),
        footprints=_footprints(geometry, matrices),
    )


def _footprints(geometry: Geometry, matrices: FloatArray) -> FloatArray:
    """Area in plan of the geometry's box at each placement, which may stand obliquely: N."""
    low, high = extent(geometry.points)
    x, y = (matrices[:, :2, :3] * (high - low)).transpose(1, 2, 0)  # each edge by 3 x N
    area: FloatArray = np.abs(x * np.roll(y, 1, axis=0) - y * np.roll(x, 1, axis=0)).sum(axis=0)
    return area


def _level(use: Use) -> tuple[float, FloatArray]:
    """Size, below 0 for the far level and 0 without levels, and the point (3) that decides."""
    if use.level is None:
        return 0.0, np.zeros(3)
    return -use.level.size if use.level.far else use.level.size, np.array(use.level.middle)


@dataclass(frozen=True)
class _Draws:
    """Draws with their instances.

    Attributes:
        states: D, state of each draw.
        commands: D of `COMMAND`, without numbers of instances.
        instances: N of `INSTANCE`, draw by draw.
        boxes: N x 2 x 3.
        places: N x 3.
        sizes: N.
        footprints: N.
    """

    states: tuple[State, ...]
    commands: NDArray[np.void]
    instances: NDArray[np.void]
    boxes: FloatArray
    places: FloatArray
    sizes: FloatArray
    footprints: FloatArray


def _packed(
    merged: Merged, repeated: Sequence[_Repeated], origins: FloatArray, reach: float
) -> Packed:
    """Joins all draws, sorted by state; the repeated meshes take the room that was left."""
    draws: list[_Draws] = []
    first = base = 0
    for each in repeated:
        draws += _repeated_draws(each, first, base, origins)
        merged.indices[first : first + len(each.indices)] = each.indices
        merged.vertices[base : base + len(each.vertices)] = each.vertices
        first, base = first + len(each.indices), base + len(each.vertices)
    draws.append(_merged_draws(merged, first, base))
    states = [state for each in draws for state in each.states]
    commands = np.concatenate([each.commands for each in draws])
    order = sorted(range(len(states)), key=states.__getitem__)
    rank = np.argsort(order)
    of_instance = np.argsort(np.repeat(rank, commands["instances"]), kind="stable")
    commands = commands[order]
    commands["base_instance"] = np.cumsum(commands["instances"]) - commands["instances"]
    instances = np.concatenate([each.instances for each in draws])[of_instance]
    instances["number"] = np.arange(len(instances))
    return Packed(
        vertices=merged.vertices,
        indices=merged.indices,
        instances=instances,
        boxes=np.concatenate([each.boxes for each in draws])[of_instance],
        commands=commands,
        states=tuple(states[index] for index in order),
        origins=origins,
        places=np.concatenate([each.places for each in draws])[of_instance],
        sizes=np.concatenate([each.sizes for each in draws])[of_instance],
        footprints=np.concatenate([each.footprints for each in draws])[of_instance],
        reach=reach,
    )


def _repeated_draws(each: _Repeated, first: int, base: int, origins: FloatArray) -> list[_Draws]:
    """A draw for the instances as they are, and one for mirrored ones."""
    instances = np.zeros(len(each.tiles), INSTANCE)
    instances["rows"] = each.matrices[:, :3]
    instances["rows"][:, :, 3] = each.matrices[:, :3, 3] - origins[each.tiles]
    instances["scene_object"] = each.scene_objects
    instances["tile"] = each.tiles
    draws = []
    for side in np.unique(each.mirrored).tolist():
        those = each.mirrored == side
        row = (len(each.indices), np.count_nonzero(those), first, base, 0)
        state = each.state._replace(mirrored=side)
        columns = instances, each.boxes, each.places, each.sizes, each.footprints
        kept = (column[those] for column in columns)
        draws.append(_Draws((state,), np.array([row], COMMAND), *kept))
    return draws


def _merged_draws(merged: Merged, first: int, base: int) -> _Draws:
    """A draw with a single instance for each group."""
    count = len(merged.tiles)
    commands, instances = np.zeros(count, COMMAND), np.zeros(count, INSTANCE)
    commands["count"] = np.diff(merged.index_starts)
    commands["instances"] = 1
    commands["first_index"] = first + merged.index_starts[:-1]
    commands["base_vertex"] = base + merged.vertex_starts[:-1]
    instances["rows"] = np.eye(4)[:3]
    instances["tile"] = merged.tiles
    level = np.zeros((count, 3)), np.zeros(count)
    footprints = np.full(count, np.inf)
    return _Draws(merged.states, commands, instances, merged.boxes, *level, footprints)

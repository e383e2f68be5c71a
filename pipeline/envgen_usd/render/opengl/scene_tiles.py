"""Packs a scene for the GPU: few, large draws that are culled by tile.

Single-use meshes are merged by material within square tiles. Frequent meshes keep a single copy of
their triangles and are drawn as instances. Each merged mesh is an instance too.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.render_scene import Geometry, Scene, Use, extent

TILE = 16.0
"""Side length of a tile, metres; a larger value gives fewer draws and culls less."""
GRID = 4096.0
"""Merged points are multiples of 1 / 4096 m, so that points shared by two tiles stay equal."""
MERGED_USES = 3
"""Number of placements above which a mesh is instanced; a larger value merges more meshes."""
_SPLIT_TRIANGLES = 32
"""Number of triangles above which a mesh larger than a tile is split; a larger value splits fewer.

"""

VERTEX = np.dtype(
    [
        ("position", "<f4", 3),
        ("normal", "<i2", 4),
        ("uv", "<f4", 2),
        ("colour", "u1", 4),
        ("scene_object", "<u4"),
    ]
)
INSTANCE = np.dtype(
    [("rows", "<f4", (3, 4)), ("scene_object", "<u4"), ("tile", "<u4"), ("number", "<u4")]
)
COMMAND = np.dtype(
    [
        ("count", "<u4"),
        ("instances", "<u4"),
        ("first_index", "<u4"),
        ("base_vertex", "<i4"),
        ("base_instance", "<u4"),
    ]
)
"""Layout of OpenGL's DrawElementsIndirectCommand."""


@dataclass(frozen=True, order=True)
class State:
    """State of a draw; draws with equal states share a call."""

    double_sided: bool
    mirrored: bool
    material: int


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
    packer = _Packer(scene)
    frequent: dict[int, list[Use]] = {}
    for use in scene.uses:
        if len(use.matrices) > MERGED_USES or use.level:
            frequent.setdefault(use.geometry, []).append(use)
        else:
            for matrix, scene_object in zip(use.matrices, use.scene_objects.tolist(), strict=True):
                geometry = scene.geometries[use.geometry]
                packer.add_merged(geometry, matrix, scene_object, use.region)
    for number, uses in frequent.items():
        packer.add_instances(scene.geometries[number], uses)
    return replace(packer.packed(), reach=reach)


@dataclass(frozen=True)
class _Draw:
    """Triangles with their instances."""

    state: State
    count: int
    first_index: int
    base_vertex: int
    instances: NDArray[np.void]
    boxes: FloatArray
    places: FloatArray
    sizes: FloatArray


class _Packer:
    def __init__(self, scene: Scene) -> None:
        self._ground = float(np.floor(scene.bounds.mean(axis=0)[2] / TILE) * TILE)
        self._tiles: dict[tuple[int, int], int] = {}
        self._origins: list[FloatArray] = []
        self._merged: dict[tuple[State, int, int], list[tuple[NDArray[np.void], Any]]] = {}
        self._vertices: list[NDArray[np.void]] = []
        self._indices: list[NDArray[np.uint32]] = []
        self._draws: list[_Draw] = []
        self._counts = {"vertices": 0, "indices": 0}

    def add_merged(
        self, geometry: Geometry, matrix: FloatArray, scene_object: int, region: int
    ) -> None:
        points = geometry.points @ matrix[:3, :3].T + matrix[:3, 3]
        mirrored = bool(np.linalg.det(matrix[:3, :3]) < 0)
        triangles = geometry.triangles[:, ::-1] if mirrored else geometry.triangles
        state = State(geometry.double_sided, False, geometry.material)
        normals = _turned(geometry.normals, matrix)
        for tile, chosen in self._tiles_of(points, triangles):
            used, local = _compact(chosen, len(points))
            vertices = _vertices(replace(geometry, normals=normals), used, scene_object)
            shifted = points[used] - self._origins[tile]
            vertices["position"] = np.round(shifted * GRID) / GRID
            self._merged.setdefault((state, tile, region), []).append((vertices, local))

    def add_instances(self, geometry: Geometry, uses: Sequence[Use]) -> None:
        matrices = np.concatenate([use.matrices for use in uses])
        every = np.arange(len(geometry.points))
        vertices = _vertices(geometry, every, 0)
        vertices["position"] = geometry.points
        first, base = self._append(vertices, geometry.triangles)
        tiles = self._tile_of(matrices[:, :2, 3])
        instances = np.zeros(len(tiles), INSTANCE)
        instances["rows"] = matrices[:, :3]
        instances["rows"][:, :, 3] = matrices[:, :3, 3] - np.array(self._origins)[tiles]
        instances["scene_object"] = np.concatenate([use.scene_objects for use in uses])
        instances["tile"] = tiles
        boxes = geometry.boxes(matrices)
        volume = np.linalg.det(matrices[:, :3, :3])
        size, middle = _level(uses[0])
        sizes = size * np.cbrt(np.abs(volume))
        places = matrices[:, :3, :3] @ middle + matrices[:, :3, 3]
        mirrored = volume < 0
        for side in np.unique(mirrored).tolist():
            those = mirrored == side
            state = State(geometry.double_sided, side, geometry.material)
            kept = instances[those], boxes[those], places[those], sizes[those]
            self._draws.append(_Draw(state, geometry.triangles.size, first, base, *kept))

    def packed(self) -> Packed:
        for (state, tile, _), pieces in self._merged.items():
            self._draw_merged(state, tile, pieces)
        self._merged.clear()
        draws = sorted(self._draws, key=lambda draw: draw.state)
        counts = [len(draw.instances) for draw in draws]
        starts = np.cumsum([0, *counts])[:-1]
        rows = [
            (draw.count, count, draw.first_index, draw.base_vertex, start)
            for draw, count, start in zip(draws, counts, starts.tolist(), strict=True)
        ]
        instances = _joined([draw.instances for draw in draws], INSTANCE)
        instances["number"] = np.arange(len(instances))
        return Packed(
            vertices=_joined(self._vertices, VERTEX),
            indices=_joined(self._indices, np.dtype(np.uint32)),
            instances=instances,
            boxes=np.concatenate([draw.boxes for draw in draws]),
            commands=np.array(rows, COMMAND),
            states=tuple(draw.state for draw in draws),
            origins=np.array(self._origins).reshape(-1, 3),
            places=np.concatenate([draw.places for draw in draws]),
            sizes=np.concatenate([draw.sizes for draw in draws]),
        )

    def _draw_merged(
        self, state: State, tile: int, pieces: list[tuple[NDArray[np.void], Any]]
    ) -> None:
        sizes = np.cumsum([0, *(len(vertices) for vertices, _ in pieces)])
        vertices = np.concatenate([part for part, _ in pieces])
        indices = [part + np.uint32(size) for (_, part), size in zip(pieces, sizes, strict=False)]
        first, base = self._append(vertices, np.concatenate(indices))
        instances = np.zeros(1, INSTANCE)
        instances["rows"][0] = np.eye(4)[:3]
        instances["tile"] = tile
        box = np.array(extent(vertices["position"])) + self._origins[tile]
        count = sum(part.size for _, part in pieces)
        level = np.zeros((1, 3)), np.zeros(1)
        self._draws.append(_Draw(state, count, first, base, instances, box[None], *level))

    def _append(self, vertices: NDArray[np.void], triangles: Any) -> tuple[int, int]:  # noqa: ANN401
        first, base = self._counts["indices"], self._counts["vertices"]
        self._vertices.append(vertices)
        self._indices.append(triangles.reshape(-1))
        self._counts["indices"] += triangles.size
        self._counts["vertices"] += len(vertices)
        return first, base

    def _tiles_of(
        self, points: FloatArray, triangles: NDArray[np.uint32]
    ) -> Iterable[tuple[int, NDArray[np.uint32]]]:
        """Tiles of a mesh with the triangles in each."""
        low, high = extent(points[:, :2])
        if len(triangles) <= _SPLIT_TRIANGLES or (high - low).max() <= 1.5 * TILE:
            return [(int(self._tile_of((low + high)[None] / 2)[0]), triangles)]
        tiles = self._tile_of(points[triangles, :2].mean(axis=1))
        order = np.argsort(tiles, kind="stable")
        names, starts = np.unique(tiles[order], return_index=True)
        parts = np.split(triangles[order], starts[1:])
        return zip(names.tolist(), parts, strict=True)

    def _tile_of(self, places: FloatArray) -> IntArray:
        """Tiles that contain points (N x 2); missing tiles are created."""
        cells = np.floor(places / TILE).astype(np.int64)
        low = np.array([column.min() for column in cells.T])
        width = int(cells[:, 0].max() - low[0]) + 1
        keys, cell = np.unique((cells - low) @ (1, width), return_inverse=True)
        numbers = []
        for x, y in (np.stack((keys % width, keys // width), axis=1) + low).tolist():
            if (x, y) not in self._tiles:
                self._tiles[x, y] = len(self._tiles)
                self._origins.append(np.array([x * TILE, y * TILE, self._ground]))
            numbers.append(self._tiles[x, y])
        return np.array(numbers, np.int64)[cell]


def _level(use: Use) -> tuple[float, FloatArray]:
    """Size, below 0 for the far level and 0 without levels, and the point (3) that decides."""
    if use.level is None:
        return 0.0, np.zeros(3)
    return -use.level.size if use.level.far else use.level.size, np.array(use.level.middle)


def _turned(normals: NDArray[np.float32], matrix: FloatArray) -> NDArray[np.float32]:
    """Normals in the world: through the inverse transpose."""
    if np.array_equal(matrix[:3, :3], np.eye(3)):
        return normals
    turned = normals @ np.linalg.pinv(matrix[:3, :3])
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    result: NDArray[np.float32] = (turned / np.maximum(length, 1e-30)).astype(np.float32)
    return result


def _compact(triangles: NDArray[np.uint32], count: int) -> tuple[IntArray, NDArray[np.uint32]]:
    """Points used by the triangles, and the triangles over these points."""
    if triangles.size < count:
        few, corner = np.unique(triangles, return_inverse=True)
        return few.astype(np.int64), corner.astype(np.uint32).reshape(-1, 3)
    used = np.zeros(count, bool)
    used[triangles] = True
    place = (np.cumsum(used) - 1).astype(np.uint32)
    return np.flatnonzero(used), place[triangles]


def _vertices(geometry: Geometry, used: IntArray, scene_object: int) -> NDArray[np.void]:
    vertices = np.zeros(len(used), VERTEX)
    vertices["normal"][:, :3] = np.round(geometry.normals[used] * 32767.0)
    vertices["uv"] = geometry.uvs[used]
    vertices["colour"] = geometry.colours[used]
    vertices["scene_object"] = scene_object
    return vertices


def _joined(parts: list[Any], kind: np.dtype[Any]) -> NDArray[Any]:
    return np.concatenate(parts) if parts else np.empty(0, kind)

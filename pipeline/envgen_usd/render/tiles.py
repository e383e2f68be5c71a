"""Packs a scene for the graphics card: few, large draws that can be culled by place.

Meshes that stand once are merged by material within square tiles. Meshes that stand often keep one
copy of their triangles and are drawn as instances, tile by tile.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.arrays import BoolArray, FloatArray, IntArray
from envgen_usd.render.scene import Geometry, Scene, Use

TILE = 64.0
"""Side of a tile, metres."""
GRID = 4096.0
"""Merged points lie on a grid of 1 / 4096 m, so that points that two tiles share stay equal."""
MERGED_USES = 3
"""A mesh that stands more often than this is drawn as instances."""
_SPLIT_TRIANGLES = 256
"""Meshes with more triangles are cut by tiles where they are larger than one."""

VERTEX = np.dtype(
    [
        ("position", "<f4", 3),
        ("normal", "<i2", 4),
        ("uv", "<f4", 2),
        ("colour", "u1", 4),
        ("thing", "<u4"),
    ]
)
INSTANCE = np.dtype([("rows", "<f4", (3, 4)), ("thing", "<u4"), ("tile", "<u4")])
COMMAND = np.dtype(
    [
        ("count", "<u4"),
        ("instances", "<u4"),
        ("first_index", "<u4"),
        ("base_vertex", "<i4"),
        ("base_instance", "<u4"),
    ]
)
"""As OpenGL's DrawElementsIndirectCommand."""


@dataclass(frozen=True, order=True)
class State:
    """What is set before a draw: draws with equal states go in one call."""

    double_sided: bool
    mirrored: bool
    material: int


@dataclass(frozen=True)
class Packed:
    """Arrays as they go to the graphics card.

    Attributes:
        vertices: V of `VERTEX`; positions relative to a tile, or to a prototype.
        indices: Corners of all triangles, relative to the draw's base vertex.
        instances: N of `INSTANCE`; rows of the matrix to the tile.
        commands: D of `COMMAND`, sorted by state.
        states: State of each draw, D.
        boxes: D x 2 x 3, least and greatest corner, world.
        origins: T x 3, world, of the tiles.
    """

    vertices: NDArray[np.void]
    indices: NDArray[np.uint32]
    instances: NDArray[np.void]
    commands: NDArray[np.void]
    states: tuple[State, ...]
    boxes: FloatArray
    origins: FloatArray


def pack(scene: Scene) -> Packed:
    """Packs everything that a scene draws."""
    packer = _Packer(scene)
    for use in scene.uses:
        geometry = scene.geometries[use.geometry]
        if len(use.matrices) > MERGED_USES:
            packer.add_instances(geometry, use)
        else:
            for matrix, thing in zip(use.matrices, use.things.tolist(), strict=True):
                packer.add_merged(geometry, matrix, thing)
    return packer.packed()


@dataclass(frozen=True)
class _Draw:
    state: State
    command: tuple[int, int, int, int, int]
    box: FloatArray


class _Packer:
    def __init__(self, scene: Scene) -> None:
        self._ground = float(np.floor(scene.bounds.mean(axis=0)[2] / TILE) * TILE)
        self._tiles: dict[tuple[int, int], int] = {}
        self._origins: list[FloatArray] = []
        self._merged: dict[tuple[State, int], list[tuple[NDArray[np.void], Any]]] = {}
        self._vertices: list[NDArray[np.void]] = []
        self._indices: list[NDArray[np.uint32]] = []
        self._instances: list[NDArray[np.void]] = []
        self._draws: list[_Draw] = []
        self._counts = {"vertices": 0, "indices": 0, "instances": 0}

    def add_merged(self, geometry: Geometry, matrix: FloatArray, thing: int) -> None:
        points = geometry.points @ matrix[:3, :3].T + matrix[:3, 3]
        mirrored = bool(np.linalg.det(matrix[:3, :3]) < 0)
        triangles = geometry.triangles[:, ::-1] if mirrored else geometry.triangles
        state = State(geometry.double_sided, False, geometry.material)
        normals = _turned(geometry.normals, matrix)
        for tile, chosen in self._tiles_of(points, triangles):
            used, local = _compact(triangles[chosen], len(points))
            vertices = _vertices(replace(geometry, normals=normals), used, thing)
            shifted = points[used] - self._origins[tile]
            vertices["position"] = np.round(shifted * GRID) / GRID
            self._merged.setdefault((state, tile), []).append((vertices, local))

    def add_instances(self, geometry: Geometry, use: Use) -> None:
        every = np.arange(len(geometry.points))
        vertices = _vertices(geometry, every, 0)
        vertices["position"] = geometry.points
        first, base = self._append(vertices, geometry.triangles)
        mirrored = np.linalg.det(use.matrices[:, :3, :3]) < 0
        tiles = self._tile_of(use.matrices[:, :2, 3])
        order = np.lexsort((tiles, mirrored))
        keys = np.stack((mirrored[order], tiles[order]), axis=1)
        cuts = np.flatnonzero(np.any(np.diff(keys, axis=0) != 0, axis=1)) + 1
        for chosen in np.split(order, cuts):
            tile = int(tiles[chosen[0]])
            moved = use.matrices[chosen].copy()
            moved[:, :3, 3] -= self._origins[tile]
            start = self._append_instances(moved, use.things[chosen], tile)
            self._draws.append(
                _Draw(
                    State(geometry.double_sided, bool(mirrored[chosen[0]]), geometry.material),
                    (geometry.triangles.size, len(chosen), first, base, start),
                    geometry.box(use.matrices[chosen]),
                )
            )

    def packed(self) -> Packed:
        for (state, tile), found in self._merged.items():
            self._draw_merged(state, tile, found)
        self._merged.clear()
        draws = sorted(self._draws, key=lambda draw: draw.state)
        return Packed(
            vertices=_joined(self._vertices, VERTEX),
            indices=_joined(self._indices, np.dtype(np.uint32)),
            instances=_joined(self._instances, INSTANCE),
            commands=np.array([draw.command for draw in draws], COMMAND),
            states=tuple(draw.state for draw in draws),
            boxes=np.array([draw.box for draw in draws]).reshape(-1, 2, 3),
            origins=np.array(self._origins).reshape(-1, 3),
        )

    def _draw_merged(
        self, state: State, tile: int, found: list[tuple[NDArray[np.void], Any]]
    ) -> None:
        sizes = np.cumsum([0, *(len(vertices) for vertices, _ in found)])
        vertices = np.concatenate([part for part, _ in found])
        indices = [part + np.uint32(size) for (_, part), size in zip(found, sizes, strict=False)]
        first, base = self._append(vertices, np.concatenate(indices))
        things = np.zeros(1, np.uint32)
        start = self._append_instances(np.eye(4)[None], things, tile)
        corners = vertices["position"].min(axis=0), vertices["position"].max(axis=0)
        box = np.array(corners, np.float64) + self._origins[tile]
        count = sum(part.size for _, part in found)
        self._draws.append(_Draw(state, (count, 1, first, base, start), box))

    def _append(self, vertices: NDArray[np.void], triangles: Any) -> tuple[int, int]:  # noqa: ANN401
        first, base = self._counts["indices"], self._counts["vertices"]
        self._vertices.append(vertices)
        self._indices.append(triangles.reshape(-1))
        self._counts["indices"] += triangles.size
        self._counts["vertices"] += len(vertices)
        return first, base

    def _append_instances(self, matrices: FloatArray, things: NDArray[np.uint32], tile: int) -> int:
        start = self._counts["instances"]
        found = np.zeros(len(matrices), INSTANCE)
        found["rows"] = matrices[:, :3]
        found["thing"] = things
        found["tile"] = tile
        self._instances.append(found)
        self._counts["instances"] += len(found)
        return start

    def _tiles_of(
        self, points: FloatArray, triangles: NDArray[np.uint32]
    ) -> Iterable[tuple[int, BoolArray | slice]]:
        """Tiles of a mesh with the triangles in each."""
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        if len(triangles) <= _SPLIT_TRIANGLES or (high - low).max() <= 1.5 * TILE:
            return [(int(self._tile_of((low + high)[None] / 2)[0]), slice(None))]
        tiles = self._tile_of(points[triangles, :2].mean(axis=1))
        return [(int(tile), tiles == tile) for tile in np.unique(tiles)]

    def _tile_of(self, places: FloatArray) -> IntArray:
        """Tiles in which places (N x 2) lie; new ones are opened."""
        cells, cell = np.unique(np.floor(places / TILE), axis=0, return_inverse=True)
        numbers = []
        for x, y in cells.astype(np.int64).tolist():
            if (x, y) not in self._tiles:
                self._tiles[x, y] = len(self._tiles)
                self._origins.append(np.array([x * TILE, y * TILE, self._ground]))
            numbers.append(self._tiles[x, y])
        return np.array(numbers, np.int64)[cell.reshape(-1)]


def _turned(normals: NDArray[np.float32], matrix: FloatArray) -> NDArray[np.float32]:
    """Normals in the world: through the transposed inverse."""
    turned = normals @ np.linalg.pinv(matrix[:3, :3])
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    result: NDArray[np.float32] = (turned / np.maximum(length, 1e-30)).astype(np.float32)
    return result


def _compact(triangles: NDArray[np.uint32], count: int) -> tuple[IntArray, NDArray[np.uint32]]:
    """Points that some triangles use, and the triangles over these."""
    used = np.zeros(count, bool)
    used[triangles] = True
    place = (np.cumsum(used) - 1).astype(np.uint32)
    return np.flatnonzero(used), place[triangles]


def _vertices(geometry: Geometry, used: IntArray, thing: int) -> NDArray[np.void]:
    found = np.zeros(len(used), VERTEX)
    found["normal"][:, :3] = np.round(geometry.normals[used] * 32767.0)
    found["uv"] = geometry.uvs[used]
    found["colour"] = geometry.colours[used]
    found["thing"] = thing
    return found


def _joined(parts: list[Any], kind: np.dtype[Any]) -> NDArray[Any]:
    return np.concatenate(parts) if parts else np.empty(0, kind)

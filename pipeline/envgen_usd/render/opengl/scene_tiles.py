"""Packs a scene for the GPU: few, large draws that are culled by tile.

Meshes that are placed a few times are merged (`merged_meshes`). The others keep a single copy of
their triangles and are drawn as instances. Each group of merged meshes is an instance too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.opengl.moving_placements import MovingPlacements, moving_placements
from envgen_usd.render.packed_layout import COMMAND, GROUP, INSTANCE, VERTEX, State
from envgen_usd.render.render_scene import Geometry, Merged, Scene, Use, extent
from envgen_usd.render.stage.merged_meshes import TILE, is_merged, merge


@dataclass(frozen=True)
class Packed:
    """Arrays for the GPU.

    Attributes:
        vertices: V of `VERTEX`; positions relative to a tile, or in the space of a mesh.
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
        movers: N, number of the placement among those of `moving`; -1 for what stands still.
        moving: What moves, placement by placement; `None` if nothing does.
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
    movers: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    moving: MovingPlacements | None = None

    def chosen(self, seen: BoolArray) -> tuple[NDArray[np.void], NDArray[np.void], IntArray]:
        """Returns the selected instances with their commands.

        Args:
            seen: N, True for the instances to draw.

        Returns:
            The instances, the commands that draw them, and the index of each command's state.
        """
        numbers = np.flatnonzero(seen)
        of_command = np.searchsorted(self.commands["base_instance"], numbers, side="right") - 1
        firsts = np.flatnonzero(np.diff(of_command, prepend=-1))
        kept = of_command[firsts]
        commands = self.commands.take(kept)
        commands["instances"] = np.diff(firsts, append=len(numbers))
        commands["base_instance"] = firsts
        return self.instances.take(numbers), commands, kept


def pack(scene: Scene, reach: float = np.inf) -> Packed:
    """Packs the geometry of a scene.

    Args:
        scene: Scene, or a part of it.
        reach: Range within which instances are drawn, metres.
    """
    moving = moving_placements(scene.moving) if scene.moving and scene.moving.uses else None
    uses = [use for use in scene.uses if not is_merged(use)]
    placements = _Placements.of(uses, moving, len(scene.geometries))
    known = (*scene.geometries, *(moving.parts.geometries if moving else ()))
    meshes = [known[kind] for kind in placements.kinds]
    merged = _merged(scene)
    vertices = _vertices(meshes)
    corners = [mesh.triangles.reshape(-1) for mesh in meshes]
    room = len(vertices), sum(map(len, corners))
    columns = _joined((_repeated_draws(meshes, placements), _merged_draws(merged, room)))
    states, commands, instances, shifts = (columns.pop(name) for name in _BY_DRAW)
    order = np.lexsort(states.T[::-1])
    rank = np.argsort(order)
    of_instance = np.argsort(np.repeat(rank, commands["instances"]), kind="stable")
    commands = commands[order]
    counts: IntArray = commands["instances"]
    commands["base_instance"] = np.cumsum(counts) - counts
    instances, shifts = instances[of_instance], shifts[of_instance]
    movers = columns.pop("movers")[of_instance]
    groups = np.where(movers < 0, -1, moving.groups[movers]) if moving else movers
    origins, tiles = _tiles(shifts, groups)
    instances["tile"] = tiles
    instances["rows"][:, :, 3] = shifts - origins[tiles]
    instances["number"] = np.arange(len(instances))
    return Packed(
        vertices=np.concatenate([vertices, *(each.vertices for each in merged)]),
        indices=np.concatenate([*corners, *(each.indices for each in merged)]),
        instances=instances,
        commands=commands,
        states=tuple(State(*row) for row in states[order].tolist()),
        origins=origins,
        reach=reach,
        movers=movers,
        moving=moving,
        **{name: column[of_instance] for name, column in columns.items()},
    )


def _merged(scene: Scene) -> list[Merged]:
    """The merged meshes of all regions, in the order of their numbers."""
    regions: dict[int, list[Use]] = {}
    for use in scene.uses:
        regions.setdefault(use.region, []).append(use)
    known = scene.merged
    return [known.get(n) or merge(scene.geometries, regions[n]) for n in sorted(regions)]


def _vertices(meshes: Sequence[Geometry]) -> NDArray[np.void]:
    """Vertices of meshes, each in its own space."""
    vertices = np.zeros(sum(len(mesh.points) for mesh in meshes), VERTEX)
    first = 0
    for mesh in meshes:
        rows = vertices[first : first + len(mesh.points)]
        rows["position"], rows["uv"], rows["colour"] = mesh.points, mesh.uvs, mesh.colours
        rows["normal"][:, :3] = np.round(mesh.normals * 32767.0)
        first += len(mesh.points)
    return vertices


def _tiles(places: FloatArray, groups: IntArray) -> tuple[FloatArray, IntArray]:
    """Origins of the tiles that hold places (N x 3, metres), T x 3, and the tile of each place.

    Each group of what moves (N; -1 for what stands still) has a tile of its own, which moves.
    """
    cells = np.floor(places[:, :2] / TILE).astype(np.int64)
    keys = (cells[:, 0] << 32) + cells[:, 1]
    moves = groups >= 0
    keys[moves] = np.iinfo(np.int64).max - groups[moves]
    found, first, tiles = np.unique(keys, return_index=True, return_inverse=True)
    origins = np.zeros((len(found), 3))
    origins[:, :2] = TILE * cells[first]
    return origins, tiles


@dataclass(frozen=True)
class _Placements:
    """Placements of the meshes that are not merged, mesh by mesh, mirrored ones last.

    Attributes:
        kinds: Meshes, K indices into the geometries of the scene.
        owners: N, place of the mesh among `kinds`.
        matrices: N x 4 x 4, to world coordinates.
        volumes: N, determinants of the matrices; below 0 for mirrored placements.
        scene_objects: N.
        movers: N, as in `Packed`.
        middles: K x 3, point of each mesh that decides its level of detail.
        sizes: K, above 0 for the detailed level, below 0 for the far one, 0 without levels; metres.
    """

    kinds: tuple[int, ...]
    owners: IntArray
    matrices: FloatArray
    volumes: FloatArray
    scene_objects: NDArray[np.uint32]
    movers: IntArray
    middles: FloatArray
    sizes: FloatArray

    @classmethod
    def of(
        cls, still: Sequence[Use], moving: MovingPlacements | None, first_moving: int
    ) -> "_Placements":
        """The placements of uses.

        Args:
            still: Uses of what stands still.
            moving: What moves.
            first_moving: Number of its first geometry.
        """
        moved = moving.uses_at_start(first_moving) if moving else ()
        uses = (*still, *moved)
        standing = sum(len(use.matrices) for use in still)
        first = {use.geometry: use for use in reversed(uses)}
        kinds = tuple(dict.fromkeys(use.geometry for use in uses))
        rank = {kind: number for number, kind in enumerate(kinds)}
        counts = [len(use.matrices) for use in uses]
        owners = np.repeat(np.array([rank[use.geometry] for use in uses], np.int64), counts)
        matrices = np.concatenate([np.empty((0, 4, 4)), *(use.matrices for use in uses)])
        names = np.concatenate([np.empty(0, np.uint32), *(use.scene_objects for use in uses)])
        volumes = np.linalg.det(matrices[:, :3, :3])
        order = np.lexsort((volumes < 0, owners))
        levels = [_level(first[kind]) for kind in kinds]
        return cls(
            kinds=kinds,
            owners=owners[order],
            matrices=matrices[order],
            volumes=volumes[order],
            scene_objects=names[order],
            movers=np.maximum(order - standing, -1),
            middles=np.array([middle for _, middle in levels]).reshape(-1, 3),
            sizes=np.array([size for size, _ in levels]),
        )


def _level(use: Use) -> tuple[float, tuple[float, float, float]]:
    """Size, below 0 for the far level and 0 without levels, and the point that decides."""
    if use.level is None:
        return 0.0, (0.0, 0.0, 0.0)
    return -use.level.size if use.level.far else use.level.size, use.level.middle


@dataclass(frozen=True)
class _Draws:
    """Draws with their instances.

    Attributes:
        states: D x 3, state of each draw.
        commands: D of `COMMAND`, without the first instance.
        instances: N of `INSTANCE`, draw by draw, without tile, number and translation.
        shifts: N x 3, translations, world, metres.
        boxes: N x 2 x 3, as in `Packed`.
        places: N x 3, as in `Packed`.
        sizes: N, as in `Packed`.
        footprints: N, as in `Packed`.
        movers: N, as in `Packed`.
    """

    states: IntArray
    commands: NDArray[np.void]
    instances: NDArray[np.void]
    shifts: FloatArray
    boxes: FloatArray
    places: FloatArray
    sizes: FloatArray
    footprints: FloatArray
    movers: IntArray


_BY_DRAW = "states", "commands", "instances", "shifts"
"""Columns that `pack` changes besides their order."""


def _joined(draws: Sequence[_Draws]) -> dict[str, NDArray[Any]]:
    names = [field.name for field in fields(_Draws)]
    return {name: np.concatenate([getattr(each, name) for each in draws]) for name in names}


def _repeated_draws(meshes: Sequence[Geometry], placed: _Placements) -> _Draws:
    """A draw for the instances of each mesh as they are, and one for mirrored ones."""
    pairs = 2 * placed.owners + (placed.volumes < 0)
    drawn, counts = np.unique(pairs, return_counts=True)
    mesh, mirrored = np.divmod(drawn, 2)
    looks = np.array([(each.double_sided, each.material) for each in meshes], np.int64)
    points = np.array([len(each.points) for each in meshes], np.int64)
    corners = np.array([each.triangles.size for each in meshes], np.int64)
    commands = np.zeros(len(drawn), COMMAND)
    commands["count"], commands["instances"] = corners[mesh], counts
    commands["first_index"] = (np.cumsum(corners) - corners)[mesh]
    commands["base_vertex"] = (np.cumsum(points) - points)[mesh]
    looks = looks.reshape(-1, 2)[mesh]
    owners, axes, shifts = placed.owners, placed.matrices[:, :3, :3], placed.matrices[:, :3, 3]
    instances = np.zeros(len(owners), INSTANCE)
    instances["rows"][:, :, :3] = axes
    instances["scene_object"] = placed.scene_objects
    low, high = np.array([extent(each.points) for each in meshes]).reshape(-1, 2, 3).swapaxes(0, 1)
    middles = np.einsum("nij,nj->ni", axes, ((low + high) / 2.0)[owners]) + shifts
    edges = axes * (high - low)[owners][:, None]  # of the boxes, in the world: columns
    reach = np.abs(edges).sum(axis=2) / 2.0
    x, y = edges[:, 0], edges[:, 1]
    areas = np.abs(x * np.roll(y, 1, axis=1) - y * np.roll(x, 1, axis=1)).sum(axis=1)
    return _Draws(
        states=np.column_stack((looks[:, 0], mirrored, looks[:, 1])),
        commands=commands,
        instances=instances,
        shifts=shifts,
        boxes=np.stack((middles - reach, middles + reach), axis=1),
        places=np.einsum("nij,nj->ni", axes, placed.middles[owners]) + shifts,
        sizes=placed.sizes[owners] * np.cbrt(np.abs(placed.volumes)),
        footprints=areas,
        movers=placed.movers,
    )


def _merged_draws(merged: Sequence[Merged], room: tuple[int, int]) -> _Draws:
    """A draw with a single instance for each group.

    Args:
        merged: Merged meshes, one after the other in the arrays.
        room: Vertices and corners before them.
    """
    groups = np.concatenate([np.empty(0, GROUP), *(each.groups for each in merged)])
    count = len(groups)
    commands, instances = np.zeros(count, COMMAND), np.zeros(count, INSTANCE)
    corners: IntArray = groups["corners"]
    vertices: IntArray = groups["vertices"]
    commands["count"], commands["instances"] = corners, 1
    commands["first_index"] = room[1] + np.cumsum(corners) - corners
    commands["base_vertex"] = room[0] + np.cumsum(vertices) - vertices
    instances["rows"] = np.eye(4)[:3]
    shifts = np.zeros((count, 3))
    shifts[:, :2] = TILE * groups["cell"]
    return _Draws(
        states=np.column_stack((groups["double_sided"], np.zeros(count, int), groups["material"])),
        commands=commands,
        instances=instances,
        shifts=shifts,
        boxes=groups["box"],
        places=np.zeros((count, 3)),
        sizes=np.zeros(count),
        footprints=np.full(count, np.inf),
        movers=np.full(count, -1),
    )

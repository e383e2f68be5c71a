"""The packed scene holds the triangles of the scene, whatever was merged, split or repeated."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.opengl.scene_tiles import Packed, pack
from envgen_usd.render.render_scene import Geometry, Material, Scene, SceneObject, Use
from envgen_usd.render.stage.merged_meshes import TILE


def grid(side: int, spacing: float, material: int = 0) -> Geometry:
    """A bumpy square of `side` x `side` points around the origin."""
    x, y = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    points = np.stack((x - side / 2, y - side / 2, np.sin(x + 2.0 * y)), axis=-1)
    points = points.reshape(-1, 3) * spacing
    first = (x * side + y)[:-1, :-1].reshape(-1, 1)
    halves = np.array([(0, side, 1), (1, side, side + 1)])
    triangles = (first[:, None] + halves).reshape(-1, 3)
    count = len(points)
    return Geometry(
        points=points,
        normals=np.tile(np.array([0, 0, 1], np.float32), (count, 1)),
        uvs=points[:, :2].astype(np.float32),
        colours=np.full((count, 4), 255, np.uint8),
        triangles=triangles.astype(np.uint32),
        material=material,
        double_sided=False,
    )


def placement(*shift: float, turn: float = 0.0, mirrored: bool = False) -> FloatArray:
    matrix = np.eye(4)
    c, s = np.cos(turn), np.sin(turn)
    matrix[:2, :2] = (c, -s), (s, c)
    matrix[:3, 0] *= -1.0 if mirrored else 1.0
    matrix[:3, 3] = shift
    return matrix


def scene_of(*uses: tuple[Geometry, list[FloatArray], int]) -> Scene:
    """Each placement has a scene object of its own, counted from 2."""
    placed, number = [], 2
    for index, (_, matrices, region) in enumerate(uses):
        names = np.arange(number, number + len(matrices), dtype=np.uint32)
        placed.append(Use(index, np.array(matrices), names, region))
        number += len(matrices)
    return Scene(
        geometries=tuple(geometry for geometry, _, _ in uses),
        uses=tuple(placed),
        materials=(Material(), Material(roughness=0.1)),
        scene_objects=(SceneObject("sky"), SceneObject("void")),
        light=Atmosphere(
            np.array([0.0, 0.0, 1.0]), np.ones(3), np.ones((2, 4, 3), np.float32), 1e4, 0
        ),
        lanes=(),
        bounds=np.array([[-100.0, -100.0, 0.0], [100.0, 100.0, 10.0]]),
    )


def given_triangles(scene: Scene) -> FloatArray:
    """Material, scene object and corners in the world of each triangle: T x 11."""
    rows = []
    for use in scene.uses:
        geometry = scene.geometries[use.geometry]
        for matrix, name in zip(use.matrices, use.scene_objects.tolist(), strict=True):
            points = geometry.points @ matrix[:3, :3].T + matrix[:3, 3]
            turned = np.linalg.det(matrix[:3, :3]) < 0
            corners = points[geometry.triangles[:, ::-1] if turned else geometry.triangles]
            rows.append(described(corners, geometry.material, np.full(len(corners), name)))
    return np.concatenate(rows)


def drawn_triangles(packed: Packed) -> FloatArray:
    """The same of what the commands draw."""
    rows = []
    for command, state in zip(packed.commands, packed.states, strict=True):
        corners, instances = drawn(packed, command)
        for points, name in instances:
            triangles = points.reshape(-1, 3, 3)[:, :: -1 if state.mirrored else 1]
            names = (corners["scene_object"] + name)[::3]
            rows.append(described(triangles, state.material, names))
    return np.concatenate(rows)


def drawn(
    packed: Packed, command: np.void
) -> tuple[NDArray[np.void], list[tuple[FloatArray, int]]]:
    """Vertices of a command, and for each instance their places and its scene object."""
    count, instances, first, base, start = command.tolist()
    corners = packed.vertices[packed.indices[first : first + count].astype(int) + base]
    placed = []
    for instance in packed.instances[start : start + instances]:
        turn = instance["rows"].astype(float)
        points = corners["position"] @ turn[:, :3].T + turn[:, 3]
        placed.append((points + packed.origins[instance["tile"]], int(instance["scene_object"])))
    return corners, placed


def described(corners: FloatArray, material: int, names: NDArray[np.integer]) -> FloatArray:
    """Material, scene object, and corners in their sense of rotation, the least first: T x 11.

    The least corner is that along an oblique line.
    """
    first = np.argmin(corners @ (1.0, 0.618, 0.337), axis=1)
    order = (first[:, None] + np.arange(3)) % 3
    turned = np.take_along_axis(corners, order[:, :, None], axis=1).reshape(-1, 9)
    return np.column_stack((np.full(len(names), material), names, turned))


LARGE = grid(40, 2.017)
SMALL = grid(3, 0.251, material=1)
CASES = {
    "a mesh over many tiles": [(LARGE, [placement(3.003, 5.007, 1.001)], 0)],
    "turned and mirrored": [
        (LARGE, [placement(3.003, 5.007, 1.001, turn=0.4, mirrored=True)], 0),
        (SMALL, [placement(30.003, -5.007, 1.001, mirrored=True)], 0),
    ],
    "small meshes of a tile": [
        (SMALL, [placement(4.003 + n, 5.007, 1.001) for n in range(3)], 0),
        (SMALL, [placement(4.003, 8.007, 1.001)], 0),
    ],
    "instances": [
        (SMALL, [placement(9.003 * n, 5.007, 1, mirrored=n % 2 == 0) for n in range(9)], 0),
        (LARGE, [placement(0.003, 0.007, 1.001)], 0),
    ],
    "many points": [
        (grid(150, 0.517), [placement(n * 7.003, 1.007, 0.003) for n in range(3)], n)
        for n in range(2)
    ],
}


@pytest.mark.parametrize("case", CASES)
def test_all_triangles_are_drawn_where_they_lie(case: str) -> None:
    scene = scene_of(*CASES[case])
    given, found = given_triangles(scene), drawn_triangles(pack(scene))
    distance, nearest = cKDTree(given).query(found)
    assert len(found) == len(given)
    assert distance.max() < 1e-3
    assert len(np.unique(nearest)) == len(given)


@pytest.mark.parametrize("case", CASES)
def test_boxes_hold_what_is_drawn(case: str) -> None:
    packed = pack(scene_of(*CASES[case]))
    places = [points for command in packed.commands for points, _ in drawn(packed, command)[1]]
    ends = np.array([(points.min(axis=0), points.max(axis=0)) for points in places])
    assert np.allclose(ends, packed.boxes, atol=1e-3)


def test_merged_meshes_of_a_tile_share_a_draw_but_not_across_regions() -> None:
    pairs = [(SMALL, [placement(4.0 + n, 5.0, 1.0)], n // 2) for n in range(4)]
    packed = pack(scene_of(*pairs))
    assert len(packed.commands) == 2
    assert packed.commands["count"].tolist() == [2 * SMALL.triangles.size] * 2


def test_tiles_are_as_large_as_said() -> None:
    packed = pack(scene_of((LARGE, [placement(0.0, 0.0, 0.0)], 0)))
    sides = np.ptp(packed.boxes, axis=1)[:, :2]
    assert sides.max() <= TILE + 2 * 2 * 2.017
    assert len(packed.commands) >= (39 * 2.017 / TILE) ** 2


def test_vertices_of_a_draw_are_shared_by_its_triangles() -> None:
    packed = pack(scene_of((LARGE, [placement(0.0, 0.0, 0.0)], 0)))
    assert len(packed.vertices) < 1.5 * len(LARGE.points)

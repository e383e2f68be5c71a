"""Scenes of a few quads, and a lidar without noise."""

from collections.abc import Callable

import numpy as np
import pytest

from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.lidar.lidar_model import LidarModel
from envgen_usd.render.render_scene import Geometry, Level, Material, Scene, SceneObject, Use


class Quads:
    """Collects quads and makes a scene of them."""

    def __init__(self) -> None:
        self.geometries, self.uses = [], []
        self.materials = []
        self.objects = [SceneObject("sky"), SceneObject("void")]

    def material(self, **values):
        self.materials.append(Material(**values))
        return len(self.materials) - 1

    def named(self, label, part="", number=0):
        path = f"/World/{label}{number}" if number else ""
        self.objects.append(SceneObject(label, path, number, part))
        return len(self.objects) - 1

    def quad(self, corners, meant, material=0, *, matrices=None, level=None):
        """Corners 4 x 3, counter-clockwise; texture coordinates go once over the quad."""
        points = np.array(corners, np.float64)
        uvs = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
        normal = np.cross(points[1] - points[0], points[3] - points[0])
        normals = np.tile(normal / np.linalg.norm(normal), (4, 1)).astype(np.float32)
        triangles = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
        colours = np.full((4, 4), 255, np.uint8)
        self.geometries.append(
            Geometry(points, normals, uvs, colours, triangles, material, double_sided=False)
        )
        places = np.eye(4)[None] if matrices is None else np.array(matrices)
        those = np.full(len(places), meant, np.uint32)
        self.uses.append(Use(len(self.geometries) - 1, places, those, level=level))

    def ground(self, meant, height=0.0, half=200.0, material=0):
        flat = [(-half, -half), (half, -half), (half, half), (-half, half)]
        self.quad([(x, y, height) for x, y in flat], meant, material)

    def wall(self, x, meant, material=0, half=50.0):
        """A wall across the x axis."""
        corners = [(x, -half, -half), (x, half, -half), (x, half, half), (x, -half, half)]
        self.quad(corners, meant, material)

    def scene(self) -> Scene:
        if not self.materials:
            self.material()
        dark = np.zeros((1, 2, 3), np.float32)
        light = Atmosphere(np.array([0.0, 0.0, 1.0]), np.zeros(3), dark, 1e5, 0.0)
        bounds = np.array([(-200.0, -200.0, -50.0), (200.0, 200.0, 50.0)])
        return Scene(
            geometries=tuple(self.geometries),
            uses=tuple(self.uses),
            materials=tuple(self.materials),
            scene_objects=tuple(self.objects),
            light=light,
            lanes=(),
            bounds=bounds,
        )


@pytest.fixture
def quads() -> Quads:
    return Quads()


@pytest.fixture
def perfect() -> Callable[..., LidarModel]:
    """A lidar without noise or losses that sees all within its range."""

    def make(**changes) -> LidarModel:
        values = {
            "name": "perfect",
            "elevations": (10.0, 2.0, 0.0, -2.0, -5.0, -10.0, -20.0),
            "columns": 360,
            "rate": 10.0,
            "range": 120.0,
            "dim_range": 10000.0,
            "nearest": 0.0,
        }
        return LidarModel(**{**values, **changes})

    return make


@pytest.fixture
def level() -> type[Level]:
    return Level

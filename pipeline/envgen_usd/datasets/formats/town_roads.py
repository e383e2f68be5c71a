"""The roads of a town's stage, as triangles with classes."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import label
from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.render.render_scene import Scene
from envgen_usd.render.stage.stage_scene import StageScene

SURFACES = ("road", "sidewalk", "parking")
"""Classes of what vehicles and people use."""
REACH = 100.0
"""Distance from the cameras within which roads are read, metres; a larger value reads more."""


@dataclass(frozen=True)
class TownRoads:
    """Triangles of roads.

    Attributes:
        corners: T x 3 x 3, corners of the triangles, world, metres.
        classes: T, class ids.
        low: x and y of the least corner of the whole stage, metres.
    """

    corners: FloatArray
    classes: ByteArray
    low: FloatArray


def read_town_roads(stage: Path, places: FloatArray) -> TownRoads:
    """Reads the roads around cameras.

    Args:
        stage: The stage of a town.
        places: N x 3, places of the cameras, world, metres.

    Raises:
        EnvgenError: The stage is missing or cannot be read.
    """
    if not stage.is_file():
        raise EnvgenError(f"{stage}: is missing; roads are read from the towns of a data set")
    town = StageScene(stage)
    groups = town.places(places, REACH)
    parts = [part for group in groups for part in _surfaces(town.near(places[group], REACH))]
    corners = np.concatenate([np.empty((0, 3, 3)), *(triangles for triangles, _ in parts)])
    classes = np.concatenate([np.empty(0, np.uint8), *(kinds for _, kinds in parts)])
    # Groups of cameras that are near each other share regions.
    _, kept = np.unique(corners.reshape(-1, 9), axis=0, return_index=True)
    kept.sort()
    return TownRoads(corners[kept], classes[kept], town.scene.bounds[0, :2])


def _surfaces(scene: Scene) -> Iterator[tuple[FloatArray, ByteArray]]:
    """Triangles and class ids of the roads of a scene, by mesh."""
    ids = _class_ids(scene, SURFACES)
    for use in scene.uses:
        kinds = ids[use.scene_objects]
        chosen = kinds > 0
        if not chosen.any():
            continue
        geometry = scene.geometries[use.geometry]
        local = geometry.points[geometry.triangles]
        for matrix, kind in zip(use.matrices[chosen], kinds[chosen], strict=True):
            placed = local @ matrix[:3, :3].T + matrix[:3, 3]
            yield placed, np.full(len(placed), kind, np.uint8)


def _class_ids(scene: Scene, names: Collection[str]) -> ByteArray:
    """Class id of each scene object; 0 for other classes."""
    return np.array(
        [label(each.label).id if each.label in names else 0 for each in scene.scene_objects],
        np.uint8,
    )

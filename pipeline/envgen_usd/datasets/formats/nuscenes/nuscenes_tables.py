"""Records of nuScenes' tables: tokens, categories, visibilities, sensors, annotations.

Source: schema_nuscenes.md and schema_nuscenes of nuscenes-devkit 1.2.0.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import FloatArray
from envgen_usd.whole_files import whole_file

CATEGORIES = (
    "noise",
    "animal",
    "human.pedestrian.adult",
    "human.pedestrian.child",
    "human.pedestrian.construction_worker",
    "human.pedestrian.personal_mobility",
    "human.pedestrian.police_officer",
    "human.pedestrian.stroller",
    "human.pedestrian.wheelchair",
    "movable_object.barrier",
    "movable_object.debris",
    "movable_object.pushable_pullable",
    "movable_object.trafficcone",
    "static_object.bicycle_rack",
    "vehicle.bicycle",
    "vehicle.bus.bendy",
    "vehicle.bus.rigid",
    "vehicle.car",
    "vehicle.construction",
    "vehicle.emergency.ambulance",
    "vehicle.emergency.police",
    "vehicle.motorcycle",
    "vehicle.trailer",
    "vehicle.truck",
    "flat.driveable_surface",
    "flat.other",
    "flat.sidewalk",
    "flat.terrain",
    "static.manmade",
    "static.other",
    "static.vegetation",
    "vehicle.ego",
)
"""nuScenes-lidarseg's categories; their places are their indices."""
_CATEGORY = {
    "void": "noise",
    "sky": "noise",
    "road": "flat.driveable_surface",
    "parking": "flat.driveable_surface",
    "sidewalk": "flat.sidewalk",
    "terrain": "flat.terrain",
    "vegetation": "static.vegetation",
    "person": "human.pedestrian.adult",
    "rider": "human.pedestrian.personal_mobility",
    "car": "vehicle.car",
    "truck": "vehicle.truck",
    "bus": "vehicle.bus.rigid",
    "train": "vehicle.bus.bendy",
    "motorcycle": "vehicle.motorcycle",
    "bicycle": "vehicle.bicycle",
}
"""Category of a class; all other classes are ``static.manmade``. The nearest stand for what
nuScenes lacks: trams, and riders without their vehicle."""
_STATES = {
    "vehicle": ("vehicle.moving", "vehicle.stopped", "vehicle.parked"),
    "cycle": ("cycle.with_rider", "cycle.with_rider", "cycle.without_rider"),
    "pedestrian": ("pedestrian.moving", "pedestrian.standing", "pedestrian.standing"),
}
"""NuScenes' attributes of what moves, of what stops, and of what never moves on the stage."""
_STATES_OF = {
    "person": "pedestrian",
    "car": "vehicle",
    "truck": "vehicle",
    "bus": "vehicle",
    "train": "vehicle",
    "motorcycle": "cycle",
    "bicycle": "cycle",
}
_MOVING = 0.2
"""Speed from which an object moves, metres a second."""
_VISIBILITIES = ((0.0, "v0-40"), (0.4, "v40-60"), (0.6, "v60-80"), (0.8, "v80-100"))
"""Least visible share and level; the tokens are 1 to 4."""


def token(*parts: object) -> str:
    """A token of 32 hexadecimal digits that follows from its parts alone."""
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()[:32]


def category_of(name: str) -> str:
    """NuScenes' category of a class of ours."""
    return _CATEGORY.get(name, "static.manmade")


def category_index(name: str) -> int:
    """Index of nuScenes' category of a class of ours."""
    return CATEGORIES.index(category_of(name))


def visibility_token(share: float) -> str:
    """Token of the level of a visible share."""
    return str(sum(share >= least for least, _ in _VISIBILITIES))


def fixed_tables() -> dict[str, list[dict[str, Any]]]:
    """The tables that are the same in all data sets: category, attribute, visibility.

    nuScenes has few static categories, so an attribute names our class of an object. NuScenes' own
    attributes tell whether it moves.
    """
    categories = [
        {"token": token("category", name), "name": name, "description": "", "index": index}
        for index, name in enumerate(CATEGORIES)
    ]
    attributes = [
        {
            "token": attribute_token(entry.name),
            "name": f"class.{entry.name}",
            "description": f"class {entry.name} of envgen-usd, id {entry.id}",
        }
        for entry in labels()
        if entry.has_instances
    ]
    attributes += [
        {"token": attribute_token(name), "name": name, "description": ""}
        for name in dict.fromkeys(name for names in _STATES.values() for name in names)
    ]
    visibilities = [
        {"token": str(number), "level": level, "description": f"visible share {level[1:]} %"}
        for number, (_, level) in enumerate(_VISIBILITIES, 1)
    ]
    return {"category": categories, "attribute": attributes, "visibility": visibilities}


def attribute_token(name: str) -> str:
    """Token of the attribute that names a class."""
    return token("attribute", name)


def attribute_tokens(row: Mapping[str, Any]) -> list[str]:
    """Tokens of our class of an object, and of nuScenes' state of it.

    Args:
        row: Record of `boxes`; `velocity` in metres a second, of what moves on the stage.
    """
    tokens = [attribute_token(row["class"])]
    if row["class"] in _STATES_OF:
        moving, stopped, never = _STATES[_STATES_OF[row["class"]]]
        state = never
        if "velocity" in row:
            state = moving if float(np.linalg.norm(row["velocity"])) >= _MOVING else stopped
        tokens.append(attribute_token(state))
    return tokens


def pose_record(matrix: FloatArray) -> dict[str, list[float]]:
    """Translation in metres and rotation (w, x, y, z) of a rigid motion, 4 x 4."""
    x, y, z, w = Rotation.from_matrix(matrix[:3, :3]).as_quat(canonical=True).tolist()
    return {"translation": matrix[:3, 3].tolist(), "rotation": [w, x, y, z]}


def box_record(box: dict[str, Any], origin: FloatArray) -> dict[str, list[float]]:
    """Translation, size (width, length, height) and rotation of a world box of `boxes`.

    Args:
        box: `box_3d` of a record.
        origin: x and y of the map's origin on the stage, metres.
    """
    x, y, z = box["centre"]
    length, width, height = box["size"]
    half = box["yaw"] / 2.0
    return {
        "translation": [x - float(origin[0]), y - float(origin[1]), z],
        "size": [width, length, height],
        "rotation": [float(np.cos(half)), 0.0, 0.0, float(np.sin(half))],
    }


def linked(rows: Sequence[dict[str, Any]]) -> None:
    """Sets `prev` and `next` of rows that follow each other; empty at the ends."""
    for number, row in enumerate(rows):
        row["prev"] = rows[number - 1]["token"] if number else ""
        row["next"] = rows[number + 1]["token"] if number + 1 < len(rows) else ""


def write_table(folder: Path, name: str, rows: Iterable[dict[str, Any]]) -> None:
    """Writes a table, a row a line.

    Raises:
        EnvgenError: The file cannot be written.
    """
    with whole_file(folder / f"{name}.json") as part, part.open("w", encoding="utf-8") as file:
        file.write("[")
        for number, row in enumerate(rows):
            file.write(",\n" if number else "\n")
            file.write(json.dumps(row))
        file.write("\n]\n")

"""Writes the landuse layer of a chunk: opinions on the terrain's materials and labels."""

from pathlib import Path

import numpy as np
from pxr import Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.prim_authoring import add_prim, add_subset, set_class, set_label, set_uv
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.errors import EnvgenError
from envgen_usd.layers.payload_files import find_materials, local, plan_uv
from envgen_usd.layers.wall_uv import wall_uv
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import GroundMesh
from envgen_usd.models.landuse import (
    QUAY_WALL,
    ROW_UNIT,
    STAND_INS,
    WALL_MATERIAL,
    LanduseClass,
    LanduseMap,
)

_LABELS = {
    LanduseClass.SQUARE: "sidewalk",
    LanduseClass.ROAD_END: "road",
    **dict.fromkeys(
        (
            LanduseClass.ACCESS,
            LanduseClass.PARKING,
            LanduseClass.SHOP,
            LanduseClass.GARAGES,
            LanduseClass.QUAY,
        ),
        "parking",
    ),
}
"""Label of each landuse class other than terrain; a paved way is a driveway.

Squares are sidewalk, as Cityscapes has pedestrian zones. What goes on behind the end of a road is
road, as nobody can see where the file ends.
"""


def write_landuse(
    ground: GroundMesh, landuse: LanduseMap, profile: Profile, catalogue: Catalogue, path: Path
) -> None:
    """Writes GeomSubsets of ``/Terrain/Ground``, each with the material and label of a class.

    Args:
        ground: Ground of the chunk, as in its terrain layer.
        landuse: Landuse of the chunk.
        profile: Environment; gives the material of each class.
        catalogue: Asset library.
        path: .usdc file, written atomically.

    Raises:
        EnvgenError: The environment gives no material for a class, or an unknown material.
    """
    classes = landuse.classes.reshape(-1)[ground.face_cell]
    # Slivers of ground in cells that the road almost fills get the class of the adjacent land.
    classes = np.where(classes == LanduseClass.ROAD, np.uint8(LanduseClass.VERGE), classes)
    is_wall, wall = ground.is_wall, profile.ground_materials.get(QUAY_WALL, WALL_MATERIAL)
    kinds = np.unique(classes[~is_wall])
    used = {LanduseClass(value): profile_material(profile, value) for value in kinds}
    layer = new_layer("Terrain")
    root = add_prim(layer, "Terrain", specifier=Sdf.SpecifierOver)
    where = f"environment {profile.country}/{profile.area}, ground_materials"
    walls = [wall] if ground.walls else []
    materials = find_materials([*used.values(), *walls], catalogue, where)
    mesh = add_prim(root, "Ground", specifier=Sdf.SpecifierOver)
    sizes = np.ones(len(LanduseClass))
    for value, material in used.items():
        sizes[value] = materials[material].size
        faces = np.flatnonzero((classes == value) & ~is_wall)
        subset = add_subset(mesh, value.name.lower(), faces, material)
        set_label(subset, "part", value.name.lower())
        label = _label(value, material, profile)
        if label:
            set_class(subset, label)
    if walls:
        subset = add_subset(mesh, QUAY_WALL, np.flatnonzero(is_wall), wall)
        set_label(subset, "part", "wall")
        set_class(subset, "wall")
    angles = np.zeros(len(classes)) if landuse.rows is None else _angles(ground, landuse)
    face_sizes = np.where(is_wall, materials[wall].size if walls else 1.0, sizes[classes])
    _set_uv(mesh, ground, face_sizes, angles)
    write_layer(layer, path)


def _label(kind: LanduseClass, material: str, profile: Profile) -> str:
    """Label of a class; empty for terrain. A verge that is paved as sidewalks are is sidewalk."""
    if kind == LanduseClass.VERGE and material in profile.road.sidewalk_materials:
        return "sidewalk"
    return _LABELS.get(kind, "")


def profile_material(profile: Profile, value: int) -> str:
    """Material of a landuse class.

    Raises:
        EnvgenError: The environment gives no material.
    """
    kind = LanduseClass(value)
    name = kind.name.lower()
    if name not in profile.ground_materials and kind in STAND_INS:
        name = STAND_INS[kind].name.lower()
    if name not in profile.ground_materials:
        raise EnvgenError(
            f"environment {profile.country}/{profile.area}: ground_materials lacks '{name}'"
        )
    return profile.ground_materials[name]


def _angles(ground: GroundMesh, landuse: LanduseMap) -> FloatArray:
    """Direction of the rows of each face, radians from +x; rows of textures run along u."""
    assert landuse.rows is not None
    rows: IntArray = landuse.rows.reshape(-1)[ground.face_cell]
    angles: FloatArray = rows.astype(np.float64) * ROW_UNIT
    return angles


def _set_uv(mesh: Sdf.PrimSpec, ground: GroundMesh, sizes: FloatArray, angles: FloatArray) -> None:
    """Texture coordinates; faceVarying only where sizes or directions of textures differ."""
    points = local(ground.vertices, ground.chunk)
    if len(np.unique(sizes)) == 1 and not angles.any() and not ground.walls:
        set_uv(mesh, plan_uv(points, ground.chunk, float(sizes[0])), at_corners=False)
        return
    corner_sizes, corner_angles = (np.repeat(of, ground.face_sizes) for of in (sizes, angles))
    uv = plan_uv(points[ground.face_vertices], ground.chunk, corner_sizes, corner_angles)
    if ground.walls:
        of_wall = np.repeat(ground.is_wall, ground.face_sizes)
        uv[of_wall] = wall_uv(ground) / corner_sizes[of_wall][:, None]
    set_uv(mesh, uv, at_corners=True)

"""Writes the buildings layer of a chunk: a component for each building."""

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pxr import Gf, Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.polygon_mesh import Mesh, flat_normals, weld
from envgen_usd.assets.prim_authoring import (
    add_mesh,
    add_prim,
    add_subset,
    apply_schemas,
    prim_names,
    set_attribute,
    set_class,
    set_collider,
    set_custom,
    set_display_colour,
    set_extents_hint,
    set_label,
    set_pose,
    union_extent,
)
from envgen_usd.assets.stage_schemas import BUILDING
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.chunks import GRID, Chunk
from envgen_usd.geometry.flat_arrays import join
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.layers.building_parts import (
    CLASSES,
    building_pivot,
    buildings_by_name,
    shell_polygons,
)
from envgen_usd.layers.payload_files import find_materials, local, surface_uv
from envgen_usd.layers.sill_strips import sill_periods, with_sill_strips
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.figure_types import heaviest
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.seeds import generator

PARTS = {
    "WallSurface": "wall",
    "RoofSurface": "roof",
    "GroundSurface": "ground",
    "OuterFloorSurface": "floor",
    "OuterCeilingSurface": "ceiling",
    "WindowSurface": "window",
    "DoorSurface": "door",
}
"""Token in the `part` taxonomy of each surface class."""
CONSTRUCTIONS = {"Bridge": "bridge", "Tunnel": "tunnel"}
"""Token in the `part` taxonomy for all surfaces of bridges and tunnels."""
OPENING_MATERIALS = {"window": "glass", "door": "wood"}


@dataclass(frozen=True, order=True)
class _Look:
    """Faces that share part label and material; they become a GeomSubset."""

    part: str
    material: str


class _Piece(NamedTuple):
    """Triangles of a look.

    Attributes:
        corners: 3 T x 3, metres, road frame.
        sills: 3 T, height of the sill above, metres; NaN for none.
    """

    corners: FloatArray
    sills: FloatArray


def write_buildings(
    city: City, chunk: Chunk, profile: Profile, catalogue: Catalogue, path: Path
) -> None:
    """Writes ``/Buildings`` with a component for each building, at its pivot.

    Args:
        city: City of the chunk.
        chunk: Tile.
        profile: Environment; gives materials that the city lacks.
        catalogue: Asset library.
        path: .usdc file, written atomically.

    Raises:
        EnvgenError: A material is missing from the library.
    """
    layer = new_layer("Buildings")
    root = add_prim(layer, "Buildings", "Xform", kind="group")
    tops = buildings_by_name(city)
    looks = {name: _group_faces(top, profile) for name, top in tops.items()}
    used = {look.material for groups in looks.values() for look in groups}
    where = f"buildings of chunk {chunk.name} (environment {profile.country}/{profile.area})"
    materials = find_materials(used, catalogue, where)
    sizes = {name: material.size for name, material in materials.items()}
    boxes = []
    for name, top in tops.items():
        prim = add_prim(root, name, "Xform", kind="component")
        pivot = building_pivot(top, chunk)
        set_pose(prim, translate=pivot)
        rng = generator(0, "sills", top.id)
        pieces = {look: _piece(found, look, profile, rng) for look, found in looks[name].items()}
        boxes.append(_add_shell(prim, pieces, pivot, chunk, sizes))
        set_display_colour(prim.nameChildren["Shell"], _tint(top.id))
        set_class(prim, CLASSES[top.kind])
        apply_schemas(prim, BUILDING)
        set_custom(prim, _facts(top, profile))
        height = round(float(np.ptp(boxes[-1][:, 2])), 3)
        kind = Sdf.ValueTypeNames.Float
        set_attribute(prim, "userProperties:height", kind, height, custom=True)
    set_extents_hint(root, union_extent(boxes))
    write_layer(layer, path)


def _tint(name: str) -> Gf.Vec3f:
    """Factor of the colours of a building's walls and roofs: age, dirt and make differ."""
    rng = generator(0, "tint", name)
    grey = 0.80 * np.exp(rng.normal(0.0, 0.24))
    tint = np.clip(grey * np.exp(rng.normal(0.0, 0.045, 3)), 0.3, 1.0)
    return Gf.Vec3f(*(float(value) for value in tint))


def _facts(building: CityObject, profile: Profile) -> dict[str, str]:
    facts = {
        "area_type": profile.area,
        "category": building.kind.lower(),
        "country": profile.country,
        "gml_id": building.id,
        "segmentation_class": CLASSES[building.kind],
    }
    for name in ("function", "roofType", "storeysAboveGround"):
        if name in building.attributes:
            facts[name] = str(building.attributes[name])
    return facts


def _group_faces(building: CityObject, profile: Profile) -> dict[_Look, list[Polygons]]:
    """The most detailed polygons of a building and its parts, by look."""
    groups: dict[_Look, list[Polygons]] = defaultdict(list)
    construction = CONSTRUCTIONS.get(building.kind, "")
    plain = _Look("wall", heaviest(profile.buildings.materials))
    for surface, polygons in shell_polygons(building):
        look = plain if surface is None else _look(surface, profile, construction)
        groups[look].append(polygons)
    return groups


def _look(surface: ThematicSurface, profile: Profile, construction: str) -> _Look:
    part = construction or PARTS.get(surface.kind, "wall")
    if surface.material:
        return _Look(part, surface.material)
    if part in OPENING_MATERIALS:
        return _Look(part, OPENING_MATERIALS[part])
    rules = profile.buildings
    return _Look(part, heaviest(rules.roof_materials if part == "roof" else rules.materials))


def _piece(
    groups: list[Polygons], look: _Look, profile: Profile, rng: np.random.Generator
) -> _Piece:
    """The triangles of a look, walls with strips below sills."""
    share = profile.wear.sills if look.part == "wall" else 0.0
    cut, sills = with_sill_strips(join(groups), share, rng)
    triangles, owner = triangulate(cut)
    return _Piece(cut.points[triangles.reshape(-1)], np.repeat(sills[owner], 3))


def _add_shell(
    prim: Sdf.PrimSpec,
    groups: dict[_Look, _Piece],
    pivot: FloatArray,
    chunk: Chunk,
    sizes: dict[str, float],
) -> FloatArray:
    """Adds the mesh with its subsets; returns the building's bounding box in the chunk's frame."""
    looks = sorted(groups)
    pieces = [groups[look] for look in looks]
    counts = [len(piece.sills) // 3 for piece in pieces]
    points = local(np.concatenate([piece.corners for piece in pieces]), chunk)
    side = np.repeat([sizes[look.material] for look in looks], [3 * count for count in counts])
    sills = np.nan_to_num(np.concatenate([piece.sills for piece in pieces]) - pivot[2])
    mesh = add_mesh(prim, "Shell", _shell(points - pivot, side, sills))
    set_collider(mesh)
    start = 0
    for name, look, count in zip(_subset_names(looks), looks, counts, strict=True):
        faces = np.arange(start, start + count)
        set_label(add_subset(mesh, name, faces, look.material), "part", look.part)
        start += count
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _subset_names(looks: list[_Look]) -> list[str]:
    names = prim_names(f"{look.part}_{look.material}" for look in looks)
    return [names[f"{look.part}_{look.material}"] for look in looks]


def _shell(corners: FloatArray, texture: FloatArray, sills: FloatArray) -> Mesh:
    """A faceted mesh from a triangle soup, with coincident vertices welded.

    Args:
        corners: 3 T x 3, metres in the frame of the building.
        texture: 3 T, sides of the textures, metres.
        sills: 3 T, height of the sill above, metres; 0 for none.
    """
    points, index = weld(corners, np.arange(len(corners)), GRID)
    sizes = np.full(len(corners) // 3, 3)
    normals = flat_normals(corners, sizes, np.arange(len(corners)))
    # A height of -1e-16 would lie in the period below.
    uv = np.round(surface_uv(corners, normals, np.zeros(3)) / texture[:, None], 9)
    level = np.abs(normals[:, 2]) > 1e-3
    uv[:, 0] -= np.floor(uv[:, 0].min())
    uv[level, 1] -= np.floor(uv[level, 1].min(initial=0.0))
    return Mesh(points, sizes, index, normals, uv + sill_periods(sills))

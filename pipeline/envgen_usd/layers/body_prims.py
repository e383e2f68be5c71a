"""Authors features with explicit geometry: barriers, hedges, gantries."""

import numpy as np
from pxr import Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.polygon_mesh import Mesh, flat_normals, weld
from envgen_usd.assets.prim_authoring import (
    add_mesh,
    set_class,
    set_collider,
    set_label,
    set_surface,
)
from envgen_usd.chunks import GRID, Chunk
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.label_taxonomy import parts
from envgen_usd.layers.payload_files import local, surface_uv
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.models.polygon_arrays import Polygons

BODY_KINDS = ("CityFurniture", "PlantCover", "SolitaryVegetationObject", "GenericOccupiedSpace")
_CLASSES = {
    "PlantCover": "vegetation",
    "SolitaryVegetationObject": "vegetation",
    "beam": "guard_rail",
    "fence": "fence",
    "gantry": "pole",
    "guard_rail": "guard_rail",
    "jersey": "wall",
    "pole": "pole",
    "rail": "terrain",
    "railing": "fence",
    "street_light": "pole",
    "traffic_light": "traffic_light",
    "traffic_sign": "traffic_sign",
    "wall": "wall",
}
"""Class label by CityGML class or by template; other bodies are static."""


def find_bodies(city: City) -> dict[str, CityObject]:
    """Returns the features that are drawn by their explicit geometry, by id."""
    return {
        thing.id: thing
        for thing in city.of_kind(*BODY_KINDS)
        if thing.placement is None and _polygons(thing)
    }


def body_material(feature: CityObject) -> str:
    """Material of a body: from its surfaces or attributes, or else the default of its class."""
    named = next((surface.material for surface in feature.surfaces if surface.material), "")
    plant = body_class(feature) == "vegetation"
    return named or str(feature.attributes.get("material", "grass" if plant else "concrete"))


def body_class(feature: CityObject) -> str:
    """Token of a body in the `class` taxonomy."""
    template = str(feature.attributes.get("template", ""))
    return _CLASSES.get(feature.kind, _CLASSES.get(template, "static"))


def _part(feature: CityObject) -> str:
    """Token of a body in the `part` taxonomy; features of other programs get ``body``."""
    template = str(feature.attributes.get("template", ""))
    return template if template in parts() else "body"


def _polygons(feature: CityObject) -> list[Polygons]:
    """The most detailed geometry of a feature."""
    if feature.surfaces:
        finest = max(surface.lod for surface in feature.surfaces)
        at_finest = [surface.polygons for surface in feature.surfaces if surface.lod == finest]
    else:
        names = sorted(name for name in feature.geometry if name.startswith("lod"))
        at_finest = [feature.geometry[names[-1]]] if names else []
    return [polygons for polygons in at_finest if len(polygons)]


def add_body(
    root: Sdf.PrimSpec, name: str, feature: CityObject, chunk: Chunk, catalogue: Catalogue
) -> FloatArray:
    """Adds a mesh with flat faces; returns its bounding box, 2 x 3, in the road frame."""
    corners = np.concatenate([p.points[triangulate(p)[0].reshape(-1)] for p in _polygons(feature)])
    points, index = weld(corners, np.arange(len(corners)), GRID)
    sizes = np.full(len(corners) // 3, 3)
    normals = flat_normals(corners, sizes, np.arange(len(corners)))
    material = body_material(feature)
    size = catalogue.materials[material].size
    foot = np.array([0.0, 0.0, corners[:, 2].min()])
    uv = surface_uv(local(corners, chunk), normals, foot) / size
    mesh = Mesh(local(points, chunk), sizes, index, normals, uv)
    prim = add_mesh(root, name, mesh, kind="component", double_sided=True)
    set_collider(prim)
    set_surface(prim, material)
    set_class(prim, body_class(feature))
    set_label(prim, "part", _part(feature))
    return np.stack([points.min(axis=0), points.max(axis=0)])

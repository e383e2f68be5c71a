"""Authors things that come with their own geometry: barriers, hedges, gantries."""

import numpy as np
from pxr import Sdf

from envgen_usd.assets.catalogue import Catalogue
from envgen_usd.assets.mesh import Mesh, flat_normals, weld
from envgen_usd.assets.prims import add_mesh, bind_material, set_class, set_label
from envgen_usd.chunks import GRID, Chunk
from envgen_usd.geometry.triangulate import triangulate
from envgen_usd.labels import parts
from envgen_usd.layers.payload import local, surface_uv
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import City, CityObject
from envgen_usd.models.polygons import Polygons

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
    "railing": "fence",
    "street_light": "pole",
    "traffic_light": "traffic_light",
    "traffic_sign": "traffic_sign",
    "wall": "wall",
}
"""Class by CityGML class or by template; everything else is static."""


def find_bodies(city: City) -> dict[str, CityObject]:
    """Returns the features that are shown by their own geometry, by id."""
    return {
        thing.id: thing
        for thing in city.of_kind(*BODY_KINDS)
        if thing.placement is None and _polygons(thing)
    }


def body_material(thing: CityObject) -> str:
    """Material of a body: as its surfaces or its attribute say, or else one that fits its class."""
    named = next((surface.material for surface in thing.surfaces if surface.material), "")
    plant = body_class(thing) == "vegetation"
    return named or str(thing.attributes.get("material", "grass" if plant else "concrete"))


def body_class(thing: CityObject) -> str:
    """Token of a body in the `class` taxonomy."""
    template = str(thing.attributes.get("template", ""))
    return _CLASSES.get(thing.kind, _CLASSES.get(template, "static"))


def _part(thing: CityObject) -> str:
    """Token of a body in the `part` taxonomy; a foreign file's things are bodies."""
    template = str(thing.attributes.get("template", ""))
    return template if template in parts() else "body"


def _polygons(thing: CityObject) -> list[Polygons]:
    """The most detailed geometry of a thing."""
    if thing.surfaces:
        finest = max(surface.lod for surface in thing.surfaces)
        found = [surface.polygons for surface in thing.surfaces if surface.lod == finest]
    else:
        names = sorted(name for name in thing.geometry if name.startswith("lod"))
        found = [thing.geometry[names[-1]]] if names else []
    return [polygons for polygons in found if len(polygons)]


def add_body(  # noqa: PLR0913, PLR0917 - what a body consists of
    root: Sdf.PrimSpec,
    name: str,
    thing: CityObject,
    chunk: Chunk,
    catalogue: Catalogue,
    material: Sdf.Path,
) -> FloatArray:
    """Adds a mesh with flat faces; returns its box, 2 x 3, in the road frame."""
    corners = np.concatenate([p.points[triangulate(p)[0].reshape(-1)] for p in _polygons(thing)])
    points, index = weld(corners, np.arange(len(corners)), GRID)
    sizes = np.full(len(corners) // 3, 3)
    normals = flat_normals(corners, sizes, np.arange(len(corners)))
    size = catalogue.materials[body_material(thing)].size
    uv = surface_uv(local(corners, chunk), normals, np.zeros(3)) / size
    mesh = Mesh(local(points, chunk), sizes, index, normals, uv)
    prim = add_mesh(root, name, mesh, kind="component", double_sided=True)
    bind_material(prim, material)
    set_class(prim, body_class(thing))
    set_label(prim, "part", _part(thing))
    return np.stack([points.min(axis=0), points.max(axis=0)])

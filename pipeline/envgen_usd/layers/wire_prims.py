"""Authors wires, which a city model holds as curves, as thin tubes."""

import numpy as np
from pxr import Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.polygon_mesh import Mesh
from envgen_usd.assets.prim_authoring import add_mesh, set_class, set_label, set_surface
from envgen_usd.chunks import Chunk
from envgen_usd.layers.payload_files import find_materials, local
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.city_model import City, CityObject

CURVES = "lod2MultiCurve"
"""Property of the city model that holds wires."""
MATERIAL = "metal_dark"
"""Material of wires."""
_TEMPLATE = "wire"
_RADIUS = 0.02
"""Radius of an insulated bundle of conductors, metres; a larger value is seen farther away."""
_SIDES = 3
"""Corners of a wire's cross-section; more show a rounder wire and draw slower."""


def find_wires(city: City) -> dict[str, CityObject]:
    """Returns the features of a city that are wires, by id."""
    return {
        feature.id: feature
        for feature in city.of_kind("CityFurniture")
        if feature.attributes.get("template") == _TEMPLATE
        and any(len(line) > 1 for line in feature.curves.get(CURVES, ()))
    }


def add_wires(
    root: Sdf.PrimSpec, name: str, feature: CityObject, chunk: Chunk, catalogue: Catalogue
) -> FloatArray:
    """Adds the wires of a span as closed tubes; returns their box, 2 x 3, in the road frame.

    Their class is ``static``: the taxonomy, as Cityscapes' and KITTI-360's, has none for wires.
    """
    find_materials({MATERIAL}, catalogue, f"wires of chunk {chunk.name}")
    lines = [line for line in feature.curves[CURVES] if len(line) > 1]
    tubes = [_tube(local(line, chunk)) for line in lines]
    starts = np.cumsum([0, *(len(points) for points, _, _ in tubes)])
    faces = [
        np.where(quads < 0, quads, quads + start)
        for (_, _, quads), start in zip(tubes, starts, strict=False)
    ]
    corners = np.concatenate(faces)
    sizes = (corners >= 0).sum(axis=1)
    points = np.concatenate([points for points, _, _ in tubes])
    normals = np.concatenate([normals for _, normals, _ in tubes])
    flat = corners[corners >= 0]
    mesh = Mesh(points, sizes, flat, normals, np.zeros((len(points), 2)), False, False)
    prim = add_mesh(root, name, mesh, kind="component")
    set_surface(prim, MATERIAL)
    set_class(prim, "static")
    set_label(prim, "part", "wire")
    every = np.concatenate(lines)
    box: FloatArray = np.stack([every.min(axis=0) - _RADIUS, every.max(axis=0) + _RADIUS])
    return box


def _tube(line: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Points and normals of a tube along a line (N x 3), and its faces, F x 4, padded with -1."""
    along = np.gradient(line, axis=0)
    side = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(line))])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(along / np.linalg.norm(along, axis=1, keepdims=True), side)
    turn = np.linspace(0.0, 2 * np.pi, _SIDES, endpoint=False) + np.pi / 2
    normals = np.cos(turn)[:, None] * side[:, None] + np.sin(turn)[:, None] * up[:, None]
    points = line[:, None] + _RADIUS * normals
    ring, corner = np.meshgrid(np.arange(len(line) - 1), np.arange(_SIDES), indexing="ij")
    beside = (corner + 1) % _SIDES
    quads = np.stack(
        [ring * _SIDES + corner, ring * _SIDES + beside, (ring + 1) * _SIDES + beside,
         (ring + 1) * _SIDES + corner], axis=-1,
    ).reshape(-1, 4)  # fmt: skip
    order = np.arange(_SIDES)
    caps = np.full((2, 4), -1)
    caps[0, :_SIDES] = order[::-1]
    caps[1, :_SIDES] = (len(line) - 1) * _SIDES + order
    return points.reshape(-1, 3), normals.reshape(-1, 3), np.concatenate([quads, caps])

"""Bodies of bridges and tubes of tunnels as constructions."""

import numpy as np

from envgen_usd.geometry.flat_arrays import take
from envgen_usd.geometry.polygon_planes import polygon_normals
from envgen_usd.models.array_types import IntArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.models.road_surface import Patch

BODY = "deck"
"""Kind of the patches that carry or cover a road but are not its surface."""
_MATERIAL = "concrete"
_LOD = 2
_UPRIGHT = 0.5
"""Sine of the largest slope of a wall; a larger value classifies more faces as walls."""
_TUNNEL = "tunnel_"
_KINDS = ("WallSurface", "OuterFloorSurface", "OuterCeilingSurface")


def make_body(name: str, patch: Patch, polygons: Polygons) -> CityObject:
    """Returns a ``Bridge`` or a ``Tunnel`` with walls, floors and ceilings.

    Args:
        name: gml:id.
        patch: Patch of kind `BODY`.
        polygons: Its piece of the surface.
    """
    kind = "Tunnel" if patch.id.startswith(_TUNNEL) else "Bridge"
    up = polygon_normals(polygons)[:, 2]
    looks: IntArray = np.where(up > _UPRIGHT, 1, np.where(up < -_UPRIGHT, 2, 0)).astype(np.int64)
    surfaces = tuple(
        ThematicSurface(
            f"{name}_{_KINDS[look]}",
            _KINDS[look],
            take(polygons, np.flatnonzero(looks == look)),
            _LOD,
            _MATERIAL,
        )
        for look in np.unique(looks).tolist()
    )
    facts: dict[str, Attribute] = {"opendrive_kind": kind.lower()}
    if patch.road:
        facts["opendrive_road"] = patch.road
    if patch.junction:
        facts["opendrive_junction"] = patch.junction
    return CityObject(name, kind, facts, surfaces)

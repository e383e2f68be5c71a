"""Buildings from objects: a block over the outline, or over length and width (13.1, 13.3)."""

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import CityObject, ThematicSurface
from envgen_usd.models.polygons import Polygons
from envgen_usd.models.road import Road
from envgen_usd.opendrive.features.instances import Instance
from envgen_usd.opendrive.features.outlines import corners, heights
from envgen_usd.opendrive.features.solids import counter_clockwise, flat_triangles

STOREY = 3.0
"""Metres a storey."""
_FLAT_ROOF = "1000"


def building(name: str, road: Road, instance: Instance, default_height: float) -> CityObject | None:
    """A building with walls, a flat roof and a ground surface.

    Args:
        name: Its id.
        road: The road that it belongs to.
        instance: Where it stands.
        default_height: Metres, where the file gives no height.

    Returns:
        The building; none where its outline has no area or crosses itself.
    """
    ring, tall = _footprint(road, instance)
    if len(ring) < 3 or not len(flat_triangles(ring[:, :2])):
        return None
    height = round(float(tall.max()) or default_height, 3)
    base = float(snap(ring[:, 2].min()))
    low = np.column_stack([snap(ring[:, :2]), np.full(len(ring), base)])
    high = low + np.array([0.0, 0.0, height])
    walls = np.stack([low, np.roll(low, -1, axis=0), np.roll(high, -1, axis=0), high], axis=1)
    surfaces = [
        _surface(f"{name}_wall_{number}", "WallSurface", wall, "plaster")
        for number, wall in enumerate(walls)
    ]
    surfaces += [
        _surface(f"{name}_roof", "RoofSurface", high, "bitumen"),
        _surface(f"{name}_ground", "GroundSurface", low[::-1], "concrete"),
    ]
    return CityObject(
        name,
        "Building",
        {
            "class": "1000",
            "roofType": _FLAT_ROOF,
            "storeysAboveGround": max(round(height / STOREY), 1),
            "height": height,
        },
        tuple(surfaces),
        solid_lod=2,
    )


def _footprint(road: Road, instance: Instance) -> tuple[FloatArray, FloatArray]:
    thing = instance.thing
    for outline in thing.outlines:
        if outline.outer and outline.closed:
            ring, tall = corners(road, instance, outline), heights(instance, outline)
            return counter_clockwise(ring, tall)
    u, v = max(thing.length, thing.radius) / 2, max(thing.width, thing.radius) / 2
    local = np.array([(-u, -v, 0.0), (u, -v, 0.0), (u, v, 0.0), (-u, v, 0.0)])
    return counter_clockwise(instance.stand.places(local), np.full(4, thing.height))


def _surface(name: str, kind: str, ring: FloatArray, material: str) -> ThematicSurface:
    return ThematicSurface(name, kind, Polygons.of_rings([snap(ring)]), 2, material)

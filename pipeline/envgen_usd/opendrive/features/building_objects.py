"""Buildings from objects: a block over the outline, or over length and width (13.1, 13.3)."""

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.geometry.flat_arrays import take
from envgen_usd.geometry.polygon_planes import polygon_normals
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.models.road import Road
from envgen_usd.models.road_feature import RoadFeature
from envgen_usd.models.road_objects import RoadObject
from envgen_usd.opendrive.features.object_instances import Instance
from envgen_usd.opendrive.features.object_kinds import Kind
from envgen_usd.opendrive.features.object_outlines import corners, heights
from envgen_usd.opendrive.features.swept_solids import (
    counter_clockwise,
    flat_triangles,
    polygons,
)

_STEEP = 0.5
"""Sine of the largest slope of a wall; a larger value classifies more faces as walls."""


def building(id_: str, road: Road, instance: Instance, kind: Kind) -> RoadFeature | None:
    """Returns a building with walls, a flat roof and a ground face.

    Args:
        id_: Id of the feature.
        road: The object's road.
        instance: The object with its pose.
        kind: Kind of the object, with the height for objects without a height.

    Returns:
        The building; `None` if its outline has no area or intersects itself.
    """
    ring, tall = _footprint(road, instance)
    if len(ring) < 3 or not len(flat_triangles(ring[:, :2])):
        return None
    height = round(float(tall.max()) or kind.height, 3)
    base = float(snap(ring[:, 2].min()))
    low = np.column_stack([snap(ring[:, :2]), np.full(len(ring), base)])
    high = low + np.array([0.0, 0.0, height])
    walls = np.stack([low, np.roll(low, -1, axis=0), np.roll(high, -1, axis=0), high], axis=1)
    parts = {"wall": list(walls), "roof": [high], "ground": [low[::-1]]}
    return RoadFeature(
        id=id_,
        road=road.id,
        source=instance.road_object,
        kind=kind.template,
        template=kind.template,
        pose=None,
        size=(0.0, 0.0, height),
        parts={name: Polygons.of_rings(list(map(snap, rings))) for name, rings in parts.items()},
    )


def swept_building(
    id_: str, road: Road, road_object: RoadObject, kind: Kind, body: FloatArray
) -> RoadFeature:
    """Returns a building along the road; its faces are walls, roof and ground by their slope.

    Args:
        id_: Id of the feature.
        road: The object's road.
        road_object: The object.
        kind: Kind of the object.
        body: T x 3 x 3, triangles of the closed body, metres.
    """
    faces = polygons([body])
    up = polygon_normals(faces)[:, 2]
    chosen = {"wall": abs(up) <= _STEEP, "roof": up > _STEEP, "ground": up < -_STEEP}
    return RoadFeature(
        id=id_,
        road=road.id,
        source=road_object,
        kind=kind.template,
        template=kind.template,
        pose=None,
        size=(0.0, 0.0, round(float(np.ptp(faces.points[:, 2])), 3)),
        parts={name: take(faces, np.flatnonzero(rows)) for name, rows in chosen.items()},
    )


def _footprint(road: Road, instance: Instance) -> tuple[FloatArray, FloatArray]:
    road_object = instance.road_object
    for outline in road_object.outlines:
        if outline.outer and outline.closed:
            ring, tall = corners(road, instance, outline), heights(instance, outline)
            return counter_clockwise(ring, tall)
    u, v = (
        max(road_object.length, road_object.radius) / 2,
        max(road_object.width, road_object.radius) / 2,
    )
    local = np.array([(-u, -v, 0.0), (u, -v, 0.0), (u, v, 0.0), (-u, v, 0.0)])
    return counter_clockwise(instance.pose.places(local), np.full(4, road_object.height))

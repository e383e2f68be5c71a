"""Parking bays: on lanes, and beside them as additional surface (1.8.1, 13.7)."""

from collections.abc import Iterator

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Origin
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.features.lying_instances import lying_instances
from envgen_usd.opendrive.features.object_kinds import FLAT, kind_of
from envgen_usd.opendrive.features.object_outlines import outer_rings
from envgen_usd.opendrive.strips.lane_strips import Strip, triangle_strip
from envgen_usd.opendrive.surface_ids import origin_id

_LEAST_AREA = 0.5
"""Area in square metres below which a bay is left out."""


def bay_strips(road: Road) -> Iterator[tuple[float, Strip]]:
    """Yields the parking bays of a road as triangles at the heights of their corners.

    Yields:
        s of the object, and a triangle.
    """
    for number, road_object in enumerate(road.objects):
        kind = kind_of(road_object)
        if kind.template != FLAT or kind.name != "parking":
            continue
        origin = Origin(road.id, "object", number, road_object.id)
        for place, instance in enumerate(lying_instances(road, road_object)):
            for part, ring in enumerate(outer_rings(road, instance)):
                patch = _patch(f"{origin_id(origin)}_{place}_bay_{part}", road, origin)
                for strip in _bay(ring, patch):
                    yield instance.road_object.s, strip


def _bay(ring: FloatArray, patch: Patch) -> Iterator[Strip]:
    area = shapely.Polygon(ring)
    if not area.is_valid or area.area < _LEAST_AREA:
        return
    for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(area)):
        corner = shapely.get_coordinates(triangle, include_z=True)[:3]
        corner[:, 2] = _heights_at(ring, corner[:, :2])
        yield triangle_strip(corner, patch)


def _heights_at(ring: FloatArray, places: FloatArray) -> FloatArray:
    apart = np.hypot(*(places[:, None] - ring[None, :, :2]).T).T
    heights: FloatArray = ring[np.argmin(apart, axis=1), 2]
    return heights


def _patch(name: str, road: Road, origin: Origin) -> Patch:
    return Patch(
        id=name,
        kind="parking",
        lane_type="parking",
        road=road.id,
        junction=road.junction,
        origin=origin,
    )

"""Parking bays: on lanes, and beside them as additional surface (1.8.1, 13.7)."""

from collections.abc import Iterator

from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Origin
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.features.lying_instances import lying_instances
from envgen_usd.opendrive.features.object_kinds import FLAT, kind_of
from envgen_usd.opendrive.features.object_outlines import outer_rings
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.triangle_strips import ring_strips
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
                for strip in ring_strips(ring, _LEAST_AREA, patch):
                    yield instance.road_object.s, strip


def _patch(name: str, road: Road, origin: Origin) -> Patch:
    return Patch(
        id=name,
        kind="parking",
        lane_type="parking",
        road=road.id,
        junction=road.junction,
        origin=origin,
    )

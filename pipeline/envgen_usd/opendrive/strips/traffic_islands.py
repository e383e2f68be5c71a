"""Traffic islands as raised parts of the road surface (1.8.1, 13.1 and 13.3)."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Origin, Outline
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.features.lying_instances import lying_instances
from envgen_usd.opendrive.features.object_instances import Instance
from envgen_usd.opendrive.features.object_kinds import FLAT, kind_of
from envgen_usd.opendrive.features.object_outlines import heights, outer_rings
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.triangle_strips import ring_strips
from envgen_usd.opendrive.surface_ids import origin_id

_PLANTED = frozenset(("grass", "soil"))
_LEAST_AREA = 0.05
"""Area in square metres below which an island is left out."""


def island_strips(road: Road) -> Iterator[tuple[float, Strip]]:
    """Yields the traffic islands of a road as triangles at the heights of their outlines.

    Yields:
        s of the object, and a triangle.
    """
    for number, road_object in enumerate(road.objects):
        kind = kind_of(road_object)
        if kind.template != FLAT or kind.name != "island":
            continue
        origin = Origin(road.id, "object", number, road_object.id)
        for place, instance in enumerate(lying_instances(road, road_object)):
            for strip in _island(road, instance, origin, place):
                yield instance.road_object.s, strip


def _island(road: Road, instance: Instance, origin: Origin, place: int) -> Iterator[Strip]:
    outlines = [
        each for each in instance.road_object.outlines if each.outer and len(each.points) > 2
    ]
    rings = outer_rings(road, instance)
    tall = [heights(instance, each) for each in outlines] or [
        np.full(len(ring), instance.road_object.height) for ring in rings
    ]
    for number, (ring, height) in enumerate(zip(rings, tall, strict=True)):
        name = f"{origin_id(origin)}_{place}_island_{number}"
        patch = replace(_patch(name, road, outlines[number] if outlines else None), origin=origin)
        yield from ring_strips(ring, _LEAST_AREA, patch, height)


def _patch(name: str, road: Road, outline: Outline | None) -> Patch:
    fill = outline.fill.lower() if outline else ""
    return Patch(
        id=name,
        kind="island",
        lane_type="median" if fill in _PLANTED else "sidewalk",
        road=road.id,
        junction=road.junction,
        material="" if fill in _PLANTED else fill,
    )

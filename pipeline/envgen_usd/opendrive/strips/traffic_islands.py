"""Traffic islands as raised parts of the road surface (1.8.1, 13.1 and 13.3)."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Origin, Outline
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.features.lying_instances import lying_instances
from envgen_usd.opendrive.features.object_instances import Instance
from envgen_usd.opendrive.features.object_kinds import FLAT, kind_of
from envgen_usd.opendrive.features.object_outlines import heights, outer_rings
from envgen_usd.opendrive.strips.lane_strips import Strip, triangle_strip
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
        area = shapely.Polygon(ring[:, :2])
        if not area.is_valid or area.area < _LEAST_AREA:
            continue
        name = f"{origin_id(origin)}_{place}_island_{number}"
        patch = replace(_patch(name, road, outlines[number] if outlines else None), origin=origin)
        for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(area)):
            corner = shapely.get_coordinates(triangle)[:3]
            nearest = _nearest(ring, corner)
            yield triangle_strip(
                np.column_stack([corner, ring[nearest, 2]]), patch, height[nearest]
            )


def _nearest(ring: FloatArray, places: FloatArray) -> FloatArray:
    apart = np.linalg.norm(places[:, None] - ring[None, :, :2], axis=2)
    nearest: FloatArray = apart.argmin(axis=1)
    return nearest


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

"""Zebra crossings for the cross paths of junctions (1.8.1, 12.5)."""

from collections.abc import Iterable, Iterator

import numpy as np
import shapely

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.geometry.lane_borders import lane_borders
from envgen_usd.opendrive.geometry.road_frame import road_points
from envgen_usd.opendrive.geometry.section_grids import inside_section
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.paint_shapes import painted, zebra
from envgen_usd.opendrive.surface_ids import nc_name

_STEP = 1.0
"""Metres between rows of a crossing road; a smaller value follows curves closer."""
_MARKED = 2.0
"""Metres from a crosswalk object; nearer cross paths use that object's marking."""


def cross_path_strips(network: RoadNetwork) -> Iterator[Strip]:
    """Yields stripes along each crossing road, unless an object in the file marks the crossing.

    Yields:
        Triangles of paint.
    """
    taken = shapely.multipoints(_crosswalks(network))
    for junction in network.junctions.values():
        for record in junction.extra:
            road = network.roads.get(record.attributes.get("crossingRoad", ""))
            if record.tag != "crossPath" or road is None or not road.sections:
                continue
            area, along = _area(road)
            if not area.is_valid or area.distance(taken) < _MARKED:
                continue
            patch = Patch(
                id=f"junction_{nc_name(junction.id)}_crossing_{nc_name(road.id)}",
                kind="crosswalk",
                lane_type="driving",
                road=road.id,
                junction=road.junction,
                colour="white",
            )
            yield from painted(zebra(area, along), patch)


def cross_path_issues(strips: Iterable[Strip]) -> Iterator[Issue]:
    """Yields an issue for each crossing road with such stripes."""
    for road in sorted({strip.patch.road for strip in strips}):
        text = "a cross path without a crosswalk object"
        action = "painted as a zebra crossing"
        yield Issue("road.cross_path", Severity.INFO, f"road[id={road}]", text, action)


def _crosswalks(network: RoadNetwork) -> FloatArray:
    """Returns the positions of the file's crosswalks, N x 2, metres, road frame."""
    places = [
        road_points(road, np.array([road_object.s]), road_object.t)[0, :2]
        for road in network.roads.values()
        for road_object in road.objects
        if road_object.type.lower() == "crosswalk"
    ]
    return np.array(places).reshape(-1, 2)


def _area(road: Road) -> tuple[shapely.Polygon, FloatArray]:
    """Returns the lanes of a crossing road in plan, and its unit direction from start to end."""
    left, right = [], []
    for section in road.sections:
        count = max(int(np.ceil((section.end - section.s) / _STEP)), 1)
        s = inside_section(section, np.linspace(section.s, section.end, count + 1))
        t = lane_borders(road, section, s).t
        left.append(road_points(road, s, t[:, 0])[:, :2])
        right.append(road_points(road, s, t[:, -1])[:, :2])
    sides = np.concatenate(left), np.concatenate(right)
    along = sides[0][-1] - sides[0][0]
    area = shapely.Polygon(np.concatenate([sides[0], sides[1][::-1]]))
    return area, along / max(float(np.hypot(*along)), 1e-9)

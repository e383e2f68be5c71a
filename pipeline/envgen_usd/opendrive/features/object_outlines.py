"""Outlines and skeletons of objects in the road frame (13.3, 13.4)."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.kept_records import Record
from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Outline, RoadObject
from envgen_usd.opendrive.document.number_attributes import read
from envgen_usd.opendrive.features.object_instances import Instance
from envgen_usd.opendrive.features.roadside_poses import points_beside
from envgen_usd.opendrive.features.swept_solids import curtain, prism, tube

ROUND = 16
"""Sides of a bounding cylinder; a larger value gives a rounder body."""
THIN = 0.03
"""Radius in metres of a skeleton without a radius; a larger value gives thicker tubes."""


def corners(road: Road, instance: Instance, outline: Outline) -> FloatArray:
    """Returns the lower corners of an outline in the road frame, N x 3, metres."""
    if outline.in_road:
        s, t, dz = outline.points.T
        return points_beside(road, s, t, dz)
    return instance.pose.places(outline.points)


def outer_rings(road: Road, instance: Instance) -> list[FloatArray]:
    """Returns the outer outlines in the road frame, N x 3 each, or the rectangle or circle."""
    road_object = instance.road_object
    outer = [each for each in road_object.outlines if each.outer and len(each.points) > 2]
    if outer:
        return [corners(road, instance, each) for each in outer]
    plan = _bounding_plan(road_object)
    return [instance.pose.places(np.column_stack([plan, np.zeros(len(plan))]))] if len(plan) else []


def heights(instance: Instance, outline: Outline) -> FloatArray:
    """Returns the height of the body at each corner of an outline, N, metres."""
    if outline.heights.any():
        return outline.heights
    return np.full(len(outline.heights), instance.road_object.height)


def outline_bodies(road: Road, instance: Instance, height: float) -> list[FloatArray]:
    """Returns bodies over the outer outlines with a height; triangles, T x 3 x 3 each, metres.

    Args:
        road: The object's road.
        instance: The object with its pose.
        height: Metres, for outlines and objects without a height.
    """
    bodies = []
    for outline in instance.road_object.outlines:
        tall = heights(instance, outline)
        if not tall.any():
            tall = np.full(len(tall), height)
        if not outline.outer or not (tall > 0).any():
            continue
        ring = corners(road, instance, outline)
        if outline.closed and len(ring) > 2:
            bodies.append(prism(ring, tall))
        else:
            bodies.append(curtain(ring, tall))
    return bodies


def bounding_bodies(instance: Instance) -> list[FloatArray]:
    """Returns the bounding box or cylinder of an object (13.1); empty without sizes."""
    plan, height = _bounding_plan(instance.road_object), instance.road_object.height
    if height <= 0 or not len(plan):
        return []
    ring = instance.pose.places(np.column_stack([plan, np.zeros(len(plan))]))
    return [prism(ring, np.full(len(ring), height))]


def _bounding_plan(road_object: RoadObject) -> FloatArray:
    """Returns the object's rectangle or circle in its own frame, N x 2; empty without sizes."""
    u, v = road_object.length / 2, road_object.width / 2
    if u > 0 and v > 0:
        return np.array([(u, -v), (u, v), (-u, v), (-u, -v)])
    angle = np.arange(ROUND) * (2 * np.pi / ROUND)
    circle = road_object.radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return circle if road_object.radius > 0 else circle[:0]


def skeleton_bodies(road: Road, instance: Instance) -> list[FloatArray]:
    """Returns tubes along the polylines of an object's skeleton; triangles, T x 3 x 3 each."""
    return [
        tube(line[place : place + 2], radius[place : place + 2])
        for line, radius in _polylines(road, instance)
        for place in range(len(line) - 1)
        if np.linalg.norm(line[place + 1] - line[place]) > 1e-3
    ]


def _polylines(road: Road, instance: Instance) -> Iterator[tuple[FloatArray, FloatArray]]:
    for skeleton in instance.road_object.extra:
        if skeleton.tag == "skeleton":
            for line in skeleton.children:
                if len(line.children) > 1:
                    points = [_vertex(road, instance, vertex) for vertex in line.children]
                    radius = [_value(vertex, "radius") or THIN for vertex in line.children]
                    yield np.array(points), np.array(radius)


def _vertex(road: Road, instance: Instance, vertex: Record) -> FloatArray:
    if vertex.tag == "vertexRoad":
        s, t, dz = (np.array([_value(vertex, name)]) for name in ("s", "t", "dz"))
        beside: FloatArray = points_beside(road, s, t, dz)[0]
        return beside
    local = np.array([[_value(vertex, name) for name in ("u", "v", "z")]])
    point: FloatArray = instance.pose.places(local)[0]
    return point


def _value(record: Record, name: str) -> float:
    return read(record.attributes.get(name, "0")) or 0.0

"""Outlines and skeletons of objects in the road frame (13.3, 13.4)."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.records import Record
from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Outline
from envgen_usd.opendrive.elements.numbers import read
from envgen_usd.opendrive.features.instances import Instance
from envgen_usd.opendrive.features.poses import points_beside
from envgen_usd.opendrive.features.solids import curtain, prism, tube

THIN = 0.03
"""Radius in metres of a skeleton that gives none."""


def corners(road: Road, instance: Instance, outline: Outline) -> FloatArray:
    """Corners of an outline in the road frame, N x 3, at their lower end."""
    if outline.in_road:
        s, t, dz = outline.points.T
        return points_beside(road, s, t, dz)
    return instance.stand.places(outline.points)


def outer_rings(road: Road, instance: Instance) -> list[FloatArray]:
    """Outer outlines in the road frame, N x 3 each, or the object's rectangle."""
    thing = instance.thing
    outer = [each for each in thing.outlines if each.outer and len(each.points) > 2]
    if outer:
        return [corners(road, instance, each) for each in outer]
    if thing.length <= 0 or thing.width <= 0:
        return []
    u, v = thing.length / 2, thing.width / 2
    local = np.array([[u, -v, 0.0], [u, v, 0.0], [-u, v, 0.0], [-u, -v, 0.0]])
    return [instance.stand.places(local)]


def heights(instance: Instance, outline: Outline) -> FloatArray:
    """Height of the body at each corner of an outline, N."""
    if outline.heights.any():
        return outline.heights
    return np.full(len(outline.heights), instance.thing.height)


def outline_bodies(road: Road, instance: Instance) -> list[FloatArray]:
    """Bodies over the outer outlines that have a height; triangles, T x 3 x 3 each."""
    bodies = []
    for outline in instance.thing.outlines:
        tall = heights(instance, outline)
        if not outline.outer or not (tall > 0).any():
            continue
        ring = corners(road, instance, outline)
        if outline.closed and len(ring) > 2:
            bodies.append(prism(ring, tall))
        else:
            bodies.append(curtain(ring, tall))
    return bodies


def skeleton_bodies(road: Road, instance: Instance) -> list[FloatArray]:
    """Tubes along the polylines of an object's skeleton."""
    return [
        tube(line[place : place + 2], radius[place : place + 2])
        for line, radius in _polylines(road, instance)
        for place in range(len(line) - 1)
        if np.linalg.norm(line[place + 1] - line[place]) > 1e-3
    ]


def _polylines(road: Road, instance: Instance) -> Iterator[tuple[FloatArray, FloatArray]]:
    for skeleton in instance.thing.extra:
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
    point: FloatArray = instance.stand.places(local)[0]
    return point


def _value(record: Record, name: str) -> float:
    return read(record.attributes.get(name, "0")) or 0.0

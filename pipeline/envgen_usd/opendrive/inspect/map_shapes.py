"""Map of a network as coloured shapes: lanes, marks, objects, signals and issues."""

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.models.road_feature import RoadFeature
from envgen_usd.models.road_marks import RMS_MARKS, MarkRules
from envgen_usd.opendrive.features.object_instances import instances
from envgen_usd.opendrive.features.object_kinds import FLAT, kind_of
from envgen_usd.opendrive.features.object_outlines import corners
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.geometry.road_frame import road_points
from envgen_usd.opendrive.geometry.section_grids import SectionGrid, section_grids
from envgen_usd.opendrive.strips.cross_path_strips import cross_path_strips
from envgen_usd.opendrive.strips.lane_layer_marks import layer_mark_strips
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.object_paint import paint_strips
from envgen_usd.opendrive.strips.road_mark_strips import mark_strips
from envgen_usd.opendrive.strips.signal_paint import signal_paint_strips

LANE_COLOURS = {
    "driving": "#8a8d91",
    "entry": "#8a8d91",
    "exit": "#8a8d91",
    "onRamp": "#8a8d91",
    "offRamp": "#8a8d91",
    "connectingRamp": "#8a8d91",
    "bidirectional": "#97908a",
    "bus": "#a5857d",
    "taxi": "#a5857d",
    "parking": "#9fb2c4",
    "biking": "#b98a80",
    "sidewalk": "#e3d8c6",
    "walking": "#e3d8c6",
    "curb": "#bdb6aa",
    "shoulder": "#c4c6c0",
    "stop": "#c4c6c0",
    "border": "#d3d6cb",
    "median": "#b6cda0",
    "none": "#e4eadb",
    "rail": "#8f7f9b",
    "tram": "#8f7f9b",
}
"""Fill colour of each lane type; other types have `OTHER_LANE`."""
OTHER_LANE = "#d7cbe0"
SEVERITY_COLOURS = {
    Severity.INFO: "#1f77b4",
    Severity.WARNING: "#e08a00",
    Severity.ERROR: "#d62728",
}
_TOLERANCE = 0.1
"""Chord error of lanes in metres; a larger value draws coarser curves."""
_MARK = {"white": "#ffffff", "standard": "#ffffff", "yellow": "#f2c618"}
_THINGS = {"tree": "#3f7d3a", "bush": "#6a9a4f", "traffic_sign": "#c2185b"}
_LIGHT, _OTHER_THING, _BODY, _FLAT = "#d35400", "#4a5a78", "#6b4f3a", "#cfe0f2"


@dataclass(frozen=True)
class Shape:
    """A shape on the map.

    Attributes:
        points: N x 2, metres; a single point for a dot or a pin.
        colour: Colour as ``#rrggbb``.
        kind: ``area``, ``paint`` (an area, drawn at least a hairline wide), ``line``, ``dot`` or
            ``pin``.
        width: Metres of a line; 0 for a hairline.
        title: Text that names the shape.
    """

    points: FloatArray
    colour: str
    kind: str
    width: float = 0.0
    title: str = ""


def map_shapes(network: RoadNetwork, rules: MarkRules = RMS_MARKS) -> list[Shape]:
    """Returns the shapes of a network, in drawing order from below.

    Args:
        network: The roads.
        rules: Sizes of marks that the file leaves open.
    """
    areas: list[Shape] = []
    paint: list[Shape] = []
    for road in network.roads.values():
        for grid in section_grids([road], _TOLERANCE):
            for shape in _section(grid, rules):
                (areas if shape.kind == "area" else paint).append(shape)
        paint += [_mark(strip) for _, strip in layer_mark_strips(road, _TOLERANCE, rules)]
    # Paving lies below, so that the lanes of connecting roads stay visible in junctions.
    areas.sort(key=lambda shape: shape.colour == LANE_COLOURS["driving"])
    flat = list(_flat_objects(network))
    features = [_feature(each) for each in road_features(network)]
    pins = [pin for issue in network.issues if (pin := _pin(issue, network)) is not None]
    painted = [_mark(strip) for strip in _painted(network, rules)]
    return [*areas, *paint, *flat, *painted, *features, *pins]


def _section(grid: SectionGrid, rules: MarkRules) -> Iterator[Shape]:
    title = f"road {grid.road.id}, section {grid.index}"
    for column, lane in enumerate(grid.borders.lanes):
        sides = grid.points[:, column, :2], grid.points[::-1, column + 1, :2]
        colour = LANE_COLOURS.get(lane.type, OTHER_LANE)
        text = f"{title}, lane {lane.id}: {lane.type}"
        yield Shape(np.concatenate(sides), colour, "area", title=text)
    for strip in mark_strips(grid, rules):
        yield _mark(strip)


def _mark(strip: Strip) -> Shape:
    colour = strip.patch.colour
    shown = _MARK.get(colour, colour if colour in {"red", "blue"} else "#ffffff")
    ring = np.concatenate([strip.left[:, :2], strip.right[::-1, :2]])
    return Shape(ring, shown, "paint", title=strip.patch.mark_type or strip.patch.kind)


def _flat_objects(network: RoadNetwork) -> Iterator[Shape]:
    """Yields flat objects on the road: crosswalks, parking bays, stop lines, ..."""
    for road in network.roads.values():
        for road_object in road.objects:
            if road_object.outlines and kind_of(road_object).template == FLAT:
                for instance in instances(road, road_object):
                    title = f"object {road_object.id}: {road_object.type} {road_object.name}"
                    for outline in road_object.outlines:
                        ring = corners(road, instance, outline)[:, :2]
                        yield Shape(ring, _FLAT, "area", title=title)


def _painted(network: RoadNetwork, rules: MarkRules) -> Iterator[Strip]:
    """Yields stripes, arrows and stop lines of objects, signals and cross paths."""
    for road in network.roads.values():
        strips = itertools.chain(paint_strips(road, rules), signal_paint_strips(road))
        yield from (strip for _, strip in strips if strip.patch.kind != "road_surface")
    yield from cross_path_strips(network)


def _feature(feature: RoadFeature) -> Shape:
    title = f"{feature.id}: {feature.source.name or feature.kind}"
    if feature.pose is not None:
        template = feature.template
        colour = _LIGHT if "light" in template else _THINGS.get(template, _OTHER_THING)
        return Shape(feature.plan(), colour, "dot", title=title)
    if "ground" in feature.parts:
        return Shape(feature.parts["ground"].points[:, :2], _BODY, "area", title=title)
    points = feature.plan()
    if len(points) == 0:
        points = np.zeros((1, 2))
    return Shape(points, _BODY, "line", title=title)


def _pin(issue: Issue, network: RoadNetwork) -> Shape | None:
    place = _place(issue.where, network)
    if place is None:
        return None
    title = f"line {issue.line}: {issue.kind}: {issue.message}"
    return Shape(place[None], SEVERITY_COLOURS[issue.severity], "pin", title=title)


def _place(where: str, network: RoadNetwork) -> FloatArray | None:
    """Returns the position (2) of a road's element or a junction's centre; otherwise `None`."""
    road_id, junction = _id("road", where), _id("junction", where)
    road = network.roads.get(road_id or "")
    if road is not None:
        s = np.array([_s_of(where, road)])
        point: FloatArray = road_points(road, s)[0, :2]
        return point
    starts = [
        (each.plan_view.x[0], each.plan_view.y[0])
        for each in network.roads.values()
        if junction is not None and each.junction == junction
    ]
    return np.array(starts).mean(axis=0) if starts else None


def _id(tag: str, where: str) -> str | None:
    match = re.match(rf"{tag}\[id=(.*?)\](?:/|$)", where)
    return match[1] if match else None


def _s_of(where: str, road: Road) -> float:
    geometry = re.search(r"/geometry\[(\d+)\]", where)
    if geometry and int(geometry[1]) <= len(road.plan_view.s):
        return float(road.plan_view.s[int(geometry[1]) - 1])
    section = re.search(r"/laneSection\[(\d+)\]", where)
    if section and int(section[1]) <= len(road.sections):
        return road.sections[int(section[1]) - 1].s
    if "/link/" in where and "laneSection" not in where:
        return road.length if where.endswith("successor") else 0.0
    return road.length / 2

"""Actions of OpenSCENARIO on entities: positions, routes, speeds, lanes and trajectories."""

import math
from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np
from lxml import etree

from envgen_usd.models.array_types import FloatArray
from envgen_usd.traffic.open_scenario.scenario_entity import Course, Entity, Shape, transition
from envgen_usd.traffic.open_scenario.scenario_file import number, only_child
from envgen_usd.traffic.open_scenario.scenario_lanes import LanePlace
from envgen_usd.traffic.open_scenario.scenario_positions import Placed, Positions
from envgen_usd.traffic.open_scenario.scenario_triggers import Clock

_REACH = 3000.0
"""Metres of lanes ahead that a way holds; a larger value lets long drives go on."""
_CORNER = 2.0
"""Metres before and after a corner of a polyline in which an entity turns."""
_OFFSET_TIME = 3.0
"""Seconds of a change of the lane offset without a greatest acceleration."""

Running = Callable[[], bool]
"""Tells whether an action still runs."""


def _over() -> bool:
    return False


class Actions:
    """Carries out actions."""

    def __init__(self, positions: Positions, clock: Clock) -> None:
        """Takes where positions are, and the time."""
        self._positions = positions
        self._clock = clock
        self._skipped = positions.file.skipped

    def start(self, action: etree._Element, entity: Entity) -> Running:
        """Starts a private action (Action/PrivateAction or a child of Private).

        Returns:
            Whether it still runs, to be asked in each step.
        """
        kind = only_child(action)
        if kind is None:
            return _over
        if kind.tag in {"LongitudinalAction", "LateralAction", "RoutingAction"}:
            inner = only_child(kind)
            if inner is None:
                return _over
            kind = inner
        known: Mapping[str, Callable[[etree._Element, Entity], Running]] = {
            "TeleportAction": self._teleport,
            "SpeedAction": self._speed,
            "LaneChangeAction": self._change_lane,
            "LaneOffsetAction": self._shift,
            "AssignRouteAction": self._assign_route,
            "AcquirePositionAction": self._acquire,
            "FollowTrajectoryAction": self._follow,
        }
        if kind.tag not in known:
            self._skipped.add(kind, kind.tag)
            return _over
        return known[kind.tag](kind, entity)

    def _teleport(self, kind: etree._Element, entity: Entity) -> Running:
        placed = self._positions.placed(kind.find("Position"))
        if placed:
            self.put(entity, placed)
        return _over

    def put(self, entity: Entity, placed: Placed) -> None:
        """Puts an entity to a place; on a lane it follows that lane from now on."""
        entity.x, entity.y, entity.heading, entity.z = placed.x, placed.y, placed.heading, math.nan
        entity.is_there, entity.at_end = True, False
        entity.course = entity.shifting = entity.path = None
        entity.is_backwards = placed.is_backwards
        if placed.place and entity.facts.kind != "pedestrian":
            self._set_path(entity, placed.place)
            if entity.path:
                entity.z = entity.path.pose(0.0, 0.0)[2]

    def _set_path(self, entity: Entity, place: LanePlace) -> None:
        back = entity.is_backwards
        entity.path = self._positions.lanes.path(place, _REACH, entity.targets, back=back)
        entity.along = 0.0
        entity.offset = -place.offset if back else place.offset

    def _speed(self, kind: etree._Element, entity: Entity) -> Running:
        target = only_child(kind.find("SpeedActionTarget"))
        if target is None:
            return _over
        value = number(target, "value")
        if target.tag == "RelativeTargetSpeed":
            if target.get("continuous") in {"true", "1"}:
                self._skipped.add(target, "a continuous RelativeTargetSpeed", "its first value")
            other = self._positions.entity(target).speed
            factor = target.get("speedTargetValueType", "delta") == "factor"
            value = other * value if factor else other + value
        dynamics = kind.find("SpeedActionDynamics")
        shape = transition(dynamics, entity.speed, value, entity.speed)
        if shape.span <= 0.0 or shape.kind == "step":
            entity.speed, entity.speeding = value, None
            return _over
        entity.speeding = (shape, self._clock.time, entity.travelled)
        mine = entity.speeding
        return lambda: entity.speeding is mine

    def _change_lane(self, kind: etree._Element, entity: Entity) -> Running:
        place = self._positions.on_map(entity)
        target = only_child(kind.find("LaneChangeTarget"))
        if place is None or target is None or entity.is_backwards:
            self._skipped.add(kind, "a LaneChangeAction of an entity that follows no lane")
            return _over
        lanes = self._positions.lanes
        if target.tag == "RelativeTargetLane":
            other = self._positions.entity(target)
            origin = place if other is entity else self._positions.on_map(other) or place
            there = lanes.beside(
                LanePlace(origin.lane, origin.along), round(number(target, "value"))
            )
            lane = there.lane.lane if there else place.lane.lane
        else:
            lane = round(number(target, "value"))
        new = lanes.at(place.lane.road, lane, lanes.s_of(place))
        if new is None or new.lane.lane != lane:
            self._skipped.add(kind, f"a change to lane {lane}, which road {place.lane.road} lacks")
            return _over
        return self._to_lane(kind, entity, new)

    def _to_lane(self, kind: etree._Element, entity: Entity, new: LanePlace) -> Running:
        x, y, _, heading = self._positions.lanes.path(new, 1.0).pose(0.0, 0.0)
        left = (entity.y - y) * math.cos(heading) - (entity.x - x) * math.sin(heading)
        target = number(kind, "targetLaneOffset", 0.0)
        self._set_path(entity, LanePlace(new.lane, new.along, left))
        dynamics = kind.find("LaneChangeActionDynamics")
        shape = transition(dynamics, left, target, entity.speed)
        return self._begin_shift(entity, shape)

    def _begin_shift(self, entity: Entity, shape: Shape) -> Running:
        if shape.span <= 0.0 or shape.kind == "step":
            entity.offset, entity.shifting = shape.end, None
            return _over
        entity.shifting = (shape, self._clock.time, entity.travelled)
        mine = entity.shifting
        return lambda: entity.shifting is mine

    def _shift(self, kind: etree._Element, entity: Entity) -> Running:
        target = only_child(kind.find("LaneOffsetTarget"))
        if target is None or entity.path is None:
            self._skipped.add(kind, "a LaneOffsetAction of an entity that follows no lane")
            return _over
        value = number(target, "value")
        lane, _ = entity.path.lane_at(entity.along)
        value = value if self._positions.lanes.follows_s(lane) else -value
        if target.tag == "RelativeTargetLaneOffset":
            value += self._positions.entity(target).offset
        span = _OFFSET_TIME
        for dynamics in kind.iterfind("LaneOffsetActionDynamics"):
            shape_name = dynamics.get("dynamicsShape", "sinusoidal")
            limit = number(dynamics, "maxLateralAcc", 0.0)
            if shape_name == "step":
                span = 0.0
            elif limit > 0.0:
                # A sine of length T has the greatest acceleration pi² / 2 times way / T².
                span = math.pi * math.sqrt(abs(value - entity.offset) / (2.0 * limit))
        return self._begin_shift(entity, Shape(entity.offset, value, span, "sinusoidal"))

    def _assign_route(self, kind: etree._Element, entity: Entity) -> Running:
        route = kind.find("Route")
        if route is None:
            reference = kind.find("CatalogReference")
            route = (
                self._positions.file.catalogue_entry(reference) if reference is not None else None
            )
        if route is None:
            return _over
        placed = [
            self._positions.placed(each.find("Position")) for each in route.iterfind("Waypoint")
        ]
        self._route(entity, [each for each in placed if each])
        return _over

    def _acquire(self, kind: etree._Element, entity: Entity) -> Running:
        placed = self._positions.placed(kind.find("Position"))
        if placed is None:
            return _over
        self._route(entity, [placed])
        return lambda: (
            entity.is_there and math.hypot(entity.x - placed.x, entity.y - placed.y) > 5.0
        )

    def _route(self, entity: Entity, places: list[Placed]) -> None:
        """Sets where an entity goes; people, and those off the lanes, go straight."""
        on_lanes = [each.place for each in places if each.place]
        if entity.path and on_lanes:
            entity.targets = on_lanes
            place = self._positions.on_map(entity)
            if place:
                self._set_path(entity, place)
            return
        points = [(entity.x, entity.y), *((each.x, each.y) for each in places)]
        if math.hypot(points[1][0] - points[0][0], points[1][1] - points[0][1]) < 0.1:
            points = points[1:]
        if len(points) > 1:
            self._on_course(entity, points, None, None)

    def _follow(self, kind: etree._Element, entity: Entity) -> Running:
        trajectory = kind.find("Trajectory")
        trajectory = kind.find("TrajectoryRef/Trajectory") if trajectory is None else trajectory
        reference = kind.find("TrajectoryRef/CatalogReference")
        reference = kind.find("CatalogReference") if reference is None else reference
        if trajectory is None and reference is not None:
            trajectory = self._positions.file.catalogue_entry(reference)
        line = trajectory.find("Shape/Polyline") if trajectory is not None else None
        if line is None:
            self._skipped.add(kind, "a trajectory that is no Polyline")
            return _over
        vertices = list(line.iterfind("Vertex"))
        placed = [self._positions.placed(vertex.find("Position")) for vertex in vertices]
        kept = [(v, p) for v, p in zip(vertices, placed, strict=True) if p]
        if len(kept) < 2:
            self._skipped.add(kind, "a trajectory with fewer than two vertices")
            return _over
        points = [(p.x, p.y) for _, p in kept]
        times = self._times(kind, [vertex for vertex, _ in kept])
        stated = [p.heading for _, p in kept] if self._all_oriented([v for v, _ in kept]) else None
        return self._on_course(entity, points, times, stated)

    def _times(self, kind: etree._Element, vertices: list[etree._Element]) -> list[float] | None:
        """Times of the vertices in the simulation; `None` if the speed decides."""
        timing = kind.find("TimeReference/Timing")
        if timing is None or any(vertex.get("time") is None for vertex in vertices):
            return None
        offset, scale = number(timing, "offset", 0.0), number(timing, "scale", 1.0)
        start = self._clock.time if timing.get("domainAbsoluteRelative") == "relative" else 0.0
        times = [start + offset + scale * number(vertex, "time") for vertex in vertices]
        if any(after <= before for before, after in pairwise(times)):
            self._skipped.add(kind, "a trajectory whose times go back", "its places at the speed")
            return None
        return times

    def _all_oriented(self, vertices: list[etree._Element]) -> bool:
        """Whether all vertices are world positions with a heading."""
        kinds = [only_child(vertex.find("Position")) for vertex in vertices]
        return all(k is not None and k.tag == "WorldPosition" and k.get("h") for k in kinds)

    def _on_course(
        self,
        entity: Entity,
        points: list[tuple[float, float]],
        times: list[float] | None,
        headings: list[float] | None,
    ) -> Running:
        """Lets an entity follow a polyline."""
        places = np.array(points)
        step = np.diff(places, axis=0)
        way = np.concatenate([[0.0], np.cumsum(np.hypot(*step.T))])
        stations = np.array(times) if times else way
        if headings is None:
            stations, places, turned = _with_corners(stations, places)
        else:
            turned = np.unwrap(np.array(headings))
        vertices = [(x, y, turn) for (x, y), turn in zip(places.tolist(), turned, strict=True)]
        entity.course = Course(stations.tolist(), vertices, times is not None)
        entity.path, entity.is_there, entity.at_end = None, True, False
        entity.x, entity.y, entity.heading = vertices[0]
        mine = entity.course
        return lambda: entity.course is mine


def _with_corners(
    stations: FloatArray, places: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Adds vertices around the corners of a polyline, so that headings turn there alone.

    Args:
        stations: N, of the vertices.
        places: N x 2, metres.

    Returns:
        Stations, places and headings of N + 2 (N - 1) vertices.
    """
    step = np.diff(places, axis=0)
    length = np.hypot(*step.T)
    chords = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    share = np.minimum(_CORNER / np.maximum(length, 1e-6), 1.0 / 3.0)
    mean = (chords[1:] + chords[:-1]) / 2
    at_vertices = np.concatenate([chords[:1], mean, chords[-1:]])
    rows = [np.column_stack([stations, places, at_vertices])[:-1]]
    for part in (share, 1.0 - share):
        along = stations[:-1] + part * np.diff(stations)
        rows.append(np.column_stack([along, places[:-1] + part[:, None] * step, chords]))
    last = np.array([[stations[-1], *places[-1], at_vertices[-1]]])
    table = np.concatenate([np.stack(rows, axis=1).reshape(-1, 4), last])
    return table[:, 0], table[:, 1:3], table[:, 3]

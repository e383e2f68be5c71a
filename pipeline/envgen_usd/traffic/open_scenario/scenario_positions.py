"""Positions of OpenSCENARIO in the road frame."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from lxml import etree

from envgen_usd.errors import EnvgenError
from envgen_usd.traffic.open_scenario.scenario_entity import Entity
from envgen_usd.traffic.open_scenario.scenario_file import ScenarioFile, number, only_child
from envgen_usd.traffic.open_scenario.scenario_lanes import LaneMap, LanePlace, shifted_lane

_ON_LANE = 3.0
"""Metres from the middle of a lane within which a world position is one on that lane."""
_ALIGNED = math.radians(45.0)
"""Angle to a lane within which a vehicle at a world position follows it."""


@dataclass(frozen=True)
class Placed:
    """A position.

    Attributes:
        x: Metres.
        y: Metres.
        heading: Radians.
        place: Its place on a lane; `None` off the lanes.
        is_backwards: True if it looks against the direction of travel.
    """

    x: float
    y: float
    heading: float
    place: LanePlace | None
    is_backwards: bool = False


@dataclass(frozen=True)
class Positions:
    """Resolves position elements.

    Attributes:
        file: The scenario.
        lanes: Lanes of the map.
        entities: Entities by name; relative positions start at where they are now.
    """

    file: ScenarioFile
    lanes: LaneMap
    entities: Mapping[str, Entity]

    def placed(self, position: etree._Element | None) -> Placed | None:
        """Returns the place of a Position element; `None` for kinds that are skipped.

        Raises:
            EnvgenError: It names an unknown road, lane or entity.
        """
        kind = only_child(position)
        if kind is None:
            return None
        known: Mapping[str, Callable[[etree._Element], Placed | None]] = {
            "WorldPosition": lambda k: self._free(
                number(k, "x"), number(k, "y"), number(k, "h") if k.get("h") else None
            ),
            "LanePosition": self._lane,
            "RoadPosition": self._on_road,
            "RelativeLanePosition": self._relative_to_lane,
            "RelativeRoadPosition": self._relative_to_lane,
            "RelativeWorldPosition": self._relative,
            "RelativeObjectPosition": self._relative,
        }
        if kind.tag not in known:
            self.file.skipped.add(kind, kind.tag)
            return None
        return known[kind.tag](kind)

    def entity(self, element: etree._Element) -> Entity:
        """Returns the entity that an element refers to.

        Raises:
            EnvgenError: There is no such entity.
        """
        name = element.get("entityRef", "")
        if name not in self.entities:
            known = ", ".join(self.entities)
            raise EnvgenError(
                f"{self.file.path}: line {element.sourceline}: no entity {name}; known: {known}"
            )
        return self.entities[name]

    def on_map(self, entity: Entity) -> LanePlace | None:
        """Returns where an entity is on the lanes; a place with an offset to the left."""
        if entity.path:
            lane, along = entity.path.lane_at(entity.along)
            if not entity.is_backwards:
                return LanePlace(lane, along, entity.offset)
        return self.lanes.nearest(entity.x, entity.y)

    def _lane(self, element: etree._Element) -> Placed:
        lane = self._whole(element, "laneId")
        found = self.lanes.at(element.get("roadId", ""), lane, number(element, "s"))
        return self._on_lane(element, found, number(element, "offset", 0.0))

    def _whole(self, element: etree._Element, name: str) -> int:
        return round(number(element, name))

    def _free(self, x: float, y: float, heading: float | None) -> Placed:
        """A place by coordinates; without a heading, a lane gives it, or else it is east."""
        place = self.lanes.nearest(x, y)
        if place is None or abs(place.offset) > _ON_LANE:
            return Placed(x, y, heading or 0.0, None)
        path = self.lanes.path(place, 1.0)
        px, py, _, along = path.pose(0.0, place.offset)
        heading = along if heading is None else heading
        turn = abs(math.remainder(heading - along, 2 * math.pi))
        if math.hypot(px - x, py - y) > 0.5 or _ALIGNED < turn < math.pi - _ALIGNED:
            return Placed(x, y, heading, None)
        return Placed(x, y, heading, place, turn > math.pi / 2)

    def _on_lane(self, element: etree._Element, place: LanePlace | None, t_offset: float) -> Placed:
        """A place on a lane; the offset is to the left of the road's direction."""
        if place is None:
            raise EnvgenError(
                f"{self.file.path}: line {element.sourceline}: the road file has no lane "
                f"{element.get('laneId', element.get('dLane'))} of road "
                f"{element.get('roadId', element.get('entityRef'))} there"
            )
        offset = t_offset if self.lanes.follows_s(place.lane) else -t_offset
        x, y, _, heading = self.lanes.path(place, 1.0).pose(0.0, offset)
        turn = self._turn(element, heading)
        backwards = abs(math.remainder(turn, 2 * math.pi)) > math.pi / 2
        moved = LanePlace(place.lane, place.along, offset)
        return Placed(x, y, heading + turn, moved, backwards)

    def _turn(self, element: etree._Element, heading: float) -> float:
        """Heading of an Orientation relative to the heading of a lane or road."""
        orientation = element.find("Orientation")
        if orientation is None:
            return 0.0
        stated = number(orientation, "h", 0.0)
        return stated if orientation.get("type", "absolute") == "relative" else stated - heading

    def _on_road(self, element: etree._Element) -> Placed:
        road = element.get("roadId", "")
        found = self.lanes.road_point(road, number(element, "s"), number(element, "t"))
        if found is None:
            raise EnvgenError(
                f"{self.file.path}: line {element.sourceline}: the road file has no road {road}"
            )
        x, y, _, heading = found
        turned = heading + self._turn(element, heading)
        place = self.lanes.nearest(x, y, turned)
        if place is None or abs(place.offset) > _ON_LANE:
            return Placed(x, y, turned, None)
        return Placed(x, y, turned, place)

    def _relative_to_lane(self, element: etree._Element) -> Placed | None:
        origin = self.on_map(self.entity(element))
        if origin is None:
            return None
        ahead = number(element, "dsLane", 0.0)
        s = self.lanes.s_of(origin) + number(element, "ds", 0.0)
        s += ahead if self.lanes.follows_s(origin.lane) else -ahead
        if element.tag == "RelativeRoadPosition":
            t = number(element, "dt", 0.0)
            found = self.lanes.at(origin.lane.road, origin.lane.lane, s)
            return self._on_lane(element, found, t)
        lane = shifted_lane(origin.lane.lane, self._whole(element, "dLane"))
        found = self.lanes.at(origin.lane.road, lane, s)
        return self._on_lane(element, found, number(element, "offset", 0.0))

    def _relative(self, element: etree._Element) -> Placed:
        entity = self.entity(element)
        dx, dy = number(element, "dx"), number(element, "dy")
        orientation = element.find("Orientation")
        turn = number(orientation, "h", 0.0) if orientation is not None else 0.0
        relative = orientation is None or orientation.get("type") == "relative"
        heading = turn + (entity.heading if relative else 0.0)
        if element.tag == "RelativeWorldPosition":
            return self._free(entity.x + dx, entity.y + dy, heading)
        cos, sin = math.cos(entity.heading), math.sin(entity.heading)
        x, y = entity.x + cos * dx - sin * dy, entity.y + sin * dx + cos * dy
        return self._free(x, y, heading)

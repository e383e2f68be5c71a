"""An entity of a scenario: its box, and how it moves from step to step."""

import math
from dataclasses import dataclass, field

from lxml import etree

from envgen_usd.errors import Issue
from envgen_usd.traffic.open_scenario.scenario_file import ScenarioFile, number
from envgen_usd.traffic.open_scenario.scenario_lanes import LanePath, LanePlace
from envgen_usd.traffic.traces.actor_kinds import ActorFacts, Size, facts_of

_STEEPEST = math.radians(60.0)
"""Greatest angle between the path and a vehicle that changes lanes."""


@dataclass(frozen=True)
class Shape:
    """A transition from one value to another (TransitionDynamics, DynamicsShape).

    Attributes:
        start: Value at its begin.
        end: Value at its end.
        span: Seconds, or metres, that it takes; 0 for a step.
        kind: ``linear``, ``sinusoidal``, ``cubic`` or ``step``.
        by_distance: True if `span` is metres.
    """

    start: float
    end: float
    span: float
    kind: str
    by_distance: bool = False

    def value(self, at: float) -> float:
        """Value after seconds or metres."""
        if self.span <= 0.0 or at >= self.span or self.kind == "step":
            return self.end
        share = max(at / self.span, 0.0)
        if self.kind == "sinusoidal":
            share = (1.0 - math.cos(math.pi * share)) / 2.0
        elif self.kind == "cubic":
            share = share * share * (3.0 - 2.0 * share)
        return self.start + share * (self.end - self.start)

    def is_over(self, at: float) -> bool:
        """True after its end."""
        return at >= self.span - 1e-9 or self.kind == "step"


@dataclass
class Course:
    """A polyline that an entity follows: places (x, y, heading) by time or by way.

    Attributes:
        stations: Seconds (of the simulation) or metres of each vertex, ascending.
        vertices: x, y (metres) and heading (radians, unwrapped) of each vertex.
        timed: True if the stations are seconds.
        along: Metres so far, for courses without times.
    """

    stations: list[float]
    vertices: list[tuple[float, float, float]]
    timed: bool
    along: float = 0.0

    def at(self, station: float) -> tuple[float, float, float]:
        """Place at a station; the ends hold beyond them."""
        stations = self.stations
        place = next((n for n, each in enumerate(stations) if each > station), len(stations))
        if place in {0, len(stations)}:
            return self.vertices[0 if place == 0 else -1]
        first, last = stations[place - 1], stations[place]
        share = (station - first) / max(last - first, 1e-12)
        a, b = self.vertices[place - 1], self.vertices[place]
        return (
            a[0] + share * (b[0] - a[0]),
            a[1] + share * (b[1] - a[1]),
            a[2] + share * (b[2] - a[2]),
        )


@dataclass
class Entity:
    """An entity while the scenario runs; positions are those of its reference point.

    Attributes:
        name: Name in the scenario.
        facts: Kind and size.
        ahead: Metres from the reference point to the middle of its box, ahead.
        left: The same, to the left.
    """

    name: str
    facts: ActorFacts
    ahead: float
    left: float
    x: float = 0.0
    y: float = 0.0
    z: float = math.nan
    heading: float = 0.0
    speed: float = 0.0
    travelled: float = 0.0
    is_there: bool = False
    at_end: bool = False
    path: LanePath | None = None
    along: float = 0.0
    offset: float = 0.0
    is_backwards: bool = False
    targets: list[LanePlace] = field(default_factory=list)
    course: Course | None = None
    speeding: tuple[Shape, float, float] | None = None
    shifting: tuple[Shape, float, float] | None = None

    def advance(self, time: float, step: float) -> None:
        """Moves the entity by a step, in seconds, that ends at a time."""
        if not self.is_there:
            return
        if self.speeding:
            shape, begun, way = self.speeding
            at = self.travelled - way if shape.by_distance else time - begun
            self.speed = shape.value(at)
            if shape.is_over(at):
                self.speeding = None
        before = self.x, self.y
        if self.course:
            self._follow(time, step)
        elif self.path:
            self._drive(time, step)
        else:
            self.x += self.speed * step * math.cos(self.heading)
            self.y += self.speed * step * math.sin(self.heading)
        self.travelled += math.hypot(self.x - before[0], self.y - before[1])

    def _follow(self, time: float, step: float) -> None:
        course = self.course
        if course is None:
            return
        course.along += self.speed * step
        station = time if course.timed else course.along
        x, y, self.heading = course.at(station)
        if course.timed:
            self.speed = math.hypot(x - self.x, y - self.y) / step
        self.x, self.y, self.z = x, y, math.nan
        if station >= course.stations[-1] - 1e-9:
            self.course = None
            self.at_end = True

    def _drive(self, time: float, step: float) -> None:
        path = self.path
        if path is None:
            return
        self.along += self.speed * step
        slope = 0.0
        if self.shifting:
            shape, begun, way = self.shifting
            at = self.travelled + self.speed * step - way if shape.by_distance else time - begun
            new = shape.value(at)
            slope = (new - self.offset) / max(abs(self.speed) * step, 1e-6)
            self.offset = new
            if shape.is_over(at):
                self.shifting = None
        if self.along > path.length:
            self.along = path.length
            self.at_end = True
            self.is_there = False
        self.x, self.y, self.z, heading = path.pose(self.along, self.offset)
        drift = max(min(math.atan(slope), _STEEPEST), -_STEEPEST) if self.speed else 0.0
        self.heading = heading + drift


def read_entities(file: ScenarioFile) -> tuple[dict[str, Entity], list[Issue]]:
    """Returns the vehicles and pedestrians of a scenario by name.

    Raises:
        EnvgenError: A catalogue lacks an entry, or a size is no number.
    """
    found: dict[str, Entity] = {}
    issues: list[Issue] = []
    for item in file.root.iterfind("Entities/ScenarioObject"):
        kind = next((c for c in item.iterchildren("*") if c.tag in _READERS), None)
        if kind is not None and kind.tag == "CatalogReference":
            kind = file.catalogue_entry(kind)
        if kind is None or kind.tag not in {"Vehicle", "Pedestrian"}:
            file.skipped.add(item, "an entity that is neither a vehicle nor a pedestrian")
            continue
        name = item.get("name", "")
        entity, guessed = _entity(name, kind, file.path.name)
        found[name] = entity
        issues += guessed
        if item.find("ObjectController") is not None:
            file.skipped.add(item, "ObjectController", "the storyboard alone moves the entity")
    for selection in file.root.iterfind("Entities/EntitySelection"):
        file.skipped.add(selection, "EntitySelection")
    return found, issues


_READERS = frozenset(
    {"Vehicle", "Pedestrian", "MiscObject", "CatalogReference", "ExternalObjectReference"}
)


def _entity(name: str, item: etree._Element, source: str) -> tuple[Entity, tuple[Issue, ...]]:
    category = item.get("vehicleCategory") or item.get("pedestrianCategory") or ""
    size: Size | None = None
    ahead = left = 0.0
    box = item.find("BoundingBox")
    if box is not None:
        for dimensions in box.iterfind("Dimensions"):
            size = (
                number(dimensions, "length"),
                number(dimensions, "width"),
                number(dimensions, "height"),
            )
        for centre in box.iterfind("Center"):
            ahead, left = number(centre, "x", 0.0), number(centre, "y", 0.0)
    model = item.get("name", "")
    names = ("pedestrian",) if item.tag == "Pedestrian" else (category, model)
    facts, issues = facts_of(name, names, size, source)
    return Entity(name, ActorFacts(facts.kind, facts.size, model), ahead, left), issues


def transition(element: etree._Element | None, start: float, end: float, speed: float) -> Shape:
    """Returns the transition of a TransitionDynamics element.

    Args:
        element: The element; `None` for a step.
        start: Value at its begin.
        end: Value at its end.
        speed: Speed of the entity, m/s; a rate of a lane change is metres a second.
    """
    if element is None:
        return Shape(start, end, 0.0, "step")
    kind = element.get("dynamicsShape", "linear")
    dimension, value = element.get("dynamicsDimension", "time"), number(element, "value", 0.0)
    if dimension == "rate":
        # The greatest slope: of a line its own, of a sine pi / 2, of a cubic 3 / 2 times the mean.
        peak = {"sinusoidal": math.pi / 2, "cubic": 1.5}.get(kind, 1.0)
        span = peak * abs(end - start) / abs(value) if value else 0.0
        return Shape(start, end, span, kind)
    return Shape(start, end, value, kind, dimension == "distance" and speed != 0.0)

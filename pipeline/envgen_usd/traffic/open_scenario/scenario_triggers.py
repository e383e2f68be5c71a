"""Triggers of OpenSCENARIO: groups of conditions that start events and acts, or end the story."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from lxml import etree

from envgen_usd.traffic.open_scenario.scenario_entity import Entity
from envgen_usd.traffic.open_scenario.scenario_file import number, only_child
from envgen_usd.traffic.open_scenario.scenario_positions import Positions

_RULES: Mapping[str, Callable[[float, float], bool]] = {
    "greaterThan": lambda a, b: a > b,
    "lessThan": lambda a, b: a < b,
    "equalTo": lambda a, b: abs(a - b) < 1e-6,
    "greaterOrEqual": lambda a, b: a >= b,
    "lessOrEqual": lambda a, b: a <= b,
    "notEqualTo": lambda a, b: abs(a - b) >= 1e-6,
}
_DONE = {"completeState", "endTransition", "stopTransition"}
_BEGUN = {"runningState", "startTransition"}


@dataclass
class Clock:
    """What conditions ask for.

    Attributes:
        time: Seconds of the simulation.
        states: ``running`` or ``complete`` by the name of an element of the storyboard.
    """

    time: float = 0.0
    states: dict[str, str] = field(default_factory=dict)


class _Condition:
    """A condition with its edge and delay."""

    def __init__(self, element: etree._Element) -> None:
        self.element = element
        self._edge = element.get("conditionEdge", "none")
        self._delay = number(element, "delay", 0.0)
        self._before = False
        self._met: list[float] = []

    def holds(self, now: bool, time: float) -> bool:
        """Whether it holds at a time, given its bare value; to be asked once in each step."""
        changes = {
            "none": now,
            "rising": now and not self._before,
            "falling": self._before and not now,
        }
        self._before, before = now, self._before
        if changes.get(self._edge, now != before):
            self._met.append(time + self._delay)
        due = [at for at in self._met if at <= time + 1e-9]
        self._met = self._met[len(due) :]
        return bool(due)


class Trigger:
    """A trigger, asked once in each step."""

    def __init__(self, element: etree._Element | None, positions: Positions, clock: Clock) -> None:
        """Takes the StartTrigger or StopTrigger; `None` fires at once."""
        self._groups: list[list[_Condition]] | None = None
        if element is not None:
            groups = element.iterfind("ConditionGroup")
            self._groups = [[_Condition(each) for each in g.iterfind("Condition")] for g in groups]
        self._positions = positions
        self._clock = clock

    def fires(self) -> bool:
        """Checks all conditions: all of a group have to hold, and one group suffices."""
        if self._groups is None:
            return True
        # Every condition is asked, since each remembers its edge.
        answers = [
            [each.holds(self._is_true(each.element), self._clock.time) for each in group]
            for group in self._groups
        ]
        return any(all(group) for group in answers)

    def _is_true(self, condition: etree._Element) -> bool:
        by_value = only_child(condition.find("ByValueCondition"))
        if by_value is not None:
            return self._value(by_value)
        by_entity = condition.find("ByEntityCondition")
        kind = only_child(by_entity.find("EntityCondition")) if by_entity is not None else None
        if by_entity is None or kind is None:
            return False
        who = by_entity.find("TriggeringEntities")
        names = by_entity.iterfind("TriggeringEntities/EntityRef")
        answers = [self._entity(kind, self._positions.entity(name)) for name in names]
        rule = who.get("triggeringEntitiesRule", "any") if who is not None else "any"
        return all(answers) if rule == "all" else any(answers)

    def _value(self, kind: etree._Element) -> bool:
        if kind.tag == "SimulationTimeCondition":
            return _met(kind, self._clock.time)
        if kind.tag == "StoryboardElementStateCondition":
            state = self._clock.states.get(kind.get("storyboardElementRef", ""), "")
            asked = kind.get("state", "")
            return (asked in _DONE and state == "complete") or (
                asked in _BEGUN and state in {"running", "complete"}
            )
        self._positions.file.skipped.add(kind, kind.tag, "never true")
        return False

    def _entity(self, kind: etree._Element, entity: Entity) -> bool:
        known: Mapping[str, Callable[[etree._Element, Entity], bool]] = {
            "TraveledDistanceCondition": lambda k, e: e.travelled >= number(k, "value"),
            "SpeedCondition": lambda k, e: _met(k, e.speed),
            "EndOfRoadCondition": lambda _, e: e.at_end,
            "RelativeDistanceCondition": lambda k, e: _met(k, self._gap(k, e)),
            "TimeHeadwayCondition": lambda k, e: (
                e.speed > 1e-6 and _met(k, self._headway(k, e) / e.speed)
            ),
            "RelativeSpeedCondition": lambda k, e: _met(
                k, e.speed - self._positions.entity(k).speed
            ),
            "ReachPositionCondition": lambda k, e: self._away(k, e) <= number(k, "tolerance"),
            "DistanceCondition": lambda k, e: _met(k, self._away(k, e)),
        }
        if kind.tag not in known:
            self._positions.file.skipped.add(kind, kind.tag, "never true")
            return False
        return entity.is_there and known[kind.tag](kind, entity)

    def _away(self, kind: etree._Element, entity: Entity) -> float:
        """Distance of an entity from a position, metres; infinite for skipped positions."""
        placed = self._positions.placed(kind.find("Position"))
        return math.hypot(placed.x - entity.x, placed.y - entity.y) if placed else math.inf

    def _headway(self, kind: etree._Element, entity: Entity) -> float:
        """Distance to another entity, metres; less than 0 for one behind."""
        other = self._positions.entity(kind)
        ahead = (other.x - entity.x) * math.cos(entity.heading)
        ahead += (other.y - entity.y) * math.sin(entity.heading)
        return math.copysign(self._gap(kind, entity), ahead)

    def _gap(self, kind: etree._Element, entity: Entity) -> float:
        return _gap(kind, entity, self._positions.entity(kind))


def _met(kind: etree._Element, value: float) -> bool:
    rule = _RULES.get(kind.get("rule", "greaterThan"), _RULES["greaterThan"])
    return rule(value, number(kind, "value"))


def _gap(kind: etree._Element, entity: Entity, other: Entity) -> float:
    """Distance between two entities, metres: straight, or along or across the first."""
    dx, dy = other.x - entity.x, other.y - entity.y
    cos, sin = math.cos(entity.heading), math.sin(entity.heading)
    along, across = abs(cos * dx + sin * dy), abs(cos * dy - sin * dx)
    free = kind.get("freespace", "false") in {"true", "1"}
    lengths = (entity.facts.size[0] + other.facts.size[0]) / 2 if free else 0.0
    widths = (entity.facts.size[1] + other.facts.size[1]) / 2 if free else 0.0
    way = kind.get("relativeDistanceType", "longitudinal")
    if way == "lateral":
        return max(across - widths, 0.0)
    if way in {"cartesianDistance", "euclidianDistance"}:
        return max(math.hypot(dx, dy) - lengths, 0.0)
    return max(along - lengths, 0.0)

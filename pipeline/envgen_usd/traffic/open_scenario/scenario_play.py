"""Plays a scenario step by step: from the initial actions to its end, with events in between."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from lxml import etree

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.actors import Trace
from envgen_usd.models.road_surface import LaneLine, RoadLine
from envgen_usd.traffic.open_scenario.scenario_actions import Actions, Running
from envgen_usd.traffic.open_scenario.scenario_entity import Entity, read_entities
from envgen_usd.traffic.open_scenario.scenario_file import ScenarioFile, number
from envgen_usd.traffic.open_scenario.scenario_lanes import LaneMap
from envgen_usd.traffic.open_scenario.scenario_positions import Positions
from envgen_usd.traffic.open_scenario.scenario_triggers import Clock, Trigger
from envgen_usd.traffic.traces.trace_rows import trace_of_rows

STEP = 0.05
"""Seconds of a step; every second step is a sample."""
_SAMPLED = 2
"""Steps for a sample."""


@dataclass
class _Event:
    """An event of a maneuver.

    Attributes:
        name: Name in the storyboard.
        maneuver: Name of its maneuver.
        trigger: When it starts.
        actions: Its private actions.
        actors: Entities that carry them out.
        left: How often it may still start.
        running: What still runs.
    """

    name: str
    maneuver: str
    trigger: Trigger
    actions: list[etree._Element]
    actors: list[Entity]
    left: int
    running: list[Running] = field(default_factory=list)


@dataclass
class _Act:
    """An act: its events wait for its trigger."""

    name: str
    trigger: Trigger
    stop: Trigger | None
    events: list[_Event]
    is_on: bool = False
    is_over: bool = False


def play(
    file: ScenarioFile, lanes: Iterable[LaneLine], roads: Iterable[RoadLine], seconds: float
) -> Trace:
    """Plays a scenario.

    Args:
        file: The scenario.
        lanes: Lanes of the road file.
        roads: Reference lines of the road file.
        seconds: Time after which it ends, if its stop trigger does not fire before.

    Raises:
        EnvgenError: The scenario refers to what is not there, or places no entity.
    """
    try:
        return _Stage(file, LaneMap(lanes, roads)).play(seconds)
    except EnvgenError as error:
        text = str(error)
        raise EnvgenError(text if str(file.path) in text else f"{file.path}: {text}") from error


class _Stage:
    """A scenario while it is played."""

    def __init__(self, file: ScenarioFile, lanes: LaneMap) -> None:
        self._file = file
        self._entities, self._issues = read_entities(file)
        self._positions = Positions(file, lanes, self._entities)
        self._clock = Clock()
        self._actions = Actions(self._positions, self._clock)

    def play(self, seconds: float) -> Trace:
        story = self._file.root.find("Storyboard")
        if story is None or not self._entities:
            raise EnvgenError("has no vehicle and no pedestrian")
        self._initialise(story)
        acts = [self._act(act) for act in story.iterfind("Story/Act")]
        stop = self._trigger(story.find("StopTrigger"))
        ids: list[str] = []
        rows: list[tuple[float, float, float, float, float]] = []
        for step in range(math.ceil(seconds / STEP - 1e-9) + 1):
            self._clock.time = step * STEP
            if step:
                for entity in self._entities.values():
                    entity.advance(self._clock.time, STEP)
            if step % _SAMPLED == 0:
                for name, row in self._sampled():
                    ids.append(name)
                    rows.append(row)
            if stop and stop.fires():
                break
            for act in acts:
                self._run(act)
        if not rows:
            raise EnvgenError("places no entity: Init has no TeleportAction that is supported")
        facts = {name: entity.facts for name, entity in self._entities.items()}
        found = [*self._issues, *self._file.skipped.issues.values(), *self._ended()]
        return trace_of_rows(ids, np.array(rows), facts, self._file.path.name, found)

    def _initialise(self, story: etree._Element) -> None:
        """Init: positions first, since speeds and routes may follow from them."""
        privates = list(story.iterfind("Init/Actions/Private"))
        for is_position in (True, False):
            for private in privates:
                entity = self._known(private)
                for action in private.iterfind("PrivateAction"):
                    teleports = action.find("TeleportAction") is not None
                    if entity and teleports == is_position:
                        self._actions.start(action, entity)
        for kind in ("GlobalAction", "UserDefinedAction"):
            for action in story.iterfind(f"Init/Actions/{kind}"):
                self._file.skipped.add(action, f"Init {kind}")

    def _known(self, element: etree._Element) -> Entity | None:
        return self._entities.get(element.get("entityRef", ""))

    def _trigger(self, element: etree._Element | None) -> Trigger | None:
        """A trigger with conditions; `None` for one that never fires."""
        if element is None or element.find("ConditionGroup") is None:
            return None
        return Trigger(element, self._positions, self._clock)

    def _act(self, act: etree._Element) -> _Act:
        events = []
        for group in act.iterfind("ManeuverGroup"):
            actors = [self._known(each) for each in group.iterfind("Actors/EntityRef")]
            known = [actor for actor in actors if actor]
            maneuvers = list(group.iterfind("Maneuver"))
            for reference in group.iterfind("CatalogReference"):
                maneuvers.append(self._file.catalogue_entry(reference))
            for maneuver in maneuvers:
                name = maneuver.get("name", "")
                events += [self._event(each, name, known) for each in maneuver.iterfind("Event")]
        start = Trigger(act.find("StartTrigger"), self._positions, self._clock)
        return _Act(act.get("name", ""), start, self._trigger(act.find("StopTrigger")), events)

    def _event(self, event: etree._Element, maneuver: str, actors: list[Entity]) -> _Event:
        actions = []
        for action in event.iterfind("Action"):
            private = action.find("PrivateAction")
            if private is None:
                self._file.skipped.add(action, "an action that is not private")
            else:
                actions.append(private)
        trigger = Trigger(event.find("StartTrigger"), self._positions, self._clock)
        times = round(number(event, "maximumExecutionCount", 1.0))
        name = event.get("name", "")
        return _Event(name, maneuver, trigger, actions, actors, max(times, 1))

    def _run(self, act: _Act) -> None:
        states = self._clock.states
        if not act.is_on:
            act.is_on = act.trigger.fires()
            if act.is_on:
                states[act.name] = "running"
        if not act.is_on or act.is_over:
            return
        for event in act.events:
            if event.running:
                event.running = [runs for runs in event.running if runs()]
                if not event.running:
                    states[event.name] = "complete"
            elif event.left and event.trigger.fires():
                event.left -= 1
                states[event.name] = "running"
                started = [
                    self._actions.start(action, entity)
                    for entity in event.actors
                    for action in event.actions
                ]
                event.running = [runs for runs in started if runs()]
                if not event.running:
                    states[event.name] = "complete"
        open_ = {each.maneuver for each in act.events if each.left or each.running}
        states |= {each.maneuver: "complete" for each in act.events if each.maneuver not in open_}
        done = not open_
        act.is_over = done or bool(act.stop and act.stop.fires())
        if act.is_over:
            states[act.name] = "complete"

    def _sampled(self) -> Iterator[tuple[str, tuple[float, float, float, float, float]]]:
        """The middle of each entity's box that is there, in plan."""
        for name, entity in self._entities.items():
            if entity.is_there:
                cos, sin = math.cos(entity.heading), math.sin(entity.heading)
                x = entity.x + entity.ahead * cos - entity.left * sin
                y = entity.y + entity.ahead * sin + entity.left * cos
                yield name, (self._clock.time, x, y, entity.z, entity.heading)

    def _ended(self) -> list[Issue]:
        """Entities that came to the end of the road, or never appeared."""
        issues = []
        for name, entity in self._entities.items():
            if entity.at_end and not entity.is_there:
                text = "comes to the end of its lane"
                done = "not there from then on"
            elif not entity.is_there and not entity.travelled:
                text, done = "is never placed", "left out"
            else:
                continue
            where = f"{self._file.path.name}: entity {name}"
            issues.append(Issue("scenario.entity", Severity.INFO, where, text, done))
        return issues

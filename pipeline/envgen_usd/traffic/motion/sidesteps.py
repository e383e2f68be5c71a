"""Leads simulated actors around objects of which the simulation knows nothing.

People step around posts, bins and parked vehicles; drivers give way to vehicles that are parked
half on the sidewalk.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from envgen_usd.models.actors import Actor, Obstacle, Trace
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.traffic.motion.trace_meetings import Meetings, body_lines, deepest

_HIT, _AWAY, _TURN = 50.0, 0.1, 2.0
"""Costs at a station of a metre inside an object, of a metre beside the way, and of a metre of
sideways step."""
_STEEPEST = 0.6
"""Largest turn of the heading by a sidestep, radians."""
_CHORD = 0.05
"""Metres by which driven ways may be simplified."""
_LEAST = 1e-3
"""Metres of way below which an actor stands."""


@dataclass(frozen=True, eq=False)
class _Manner:
    """How actors step aside.

    Attributes:
        offsets: O, metres beside the simulated way, to the left; the first is 0.
        room: Metres that they keep between their body and objects; a larger value leads them
            farther around.
        station: Metres of way between the places at which an offset is chosen.
        step: Metres of way on which a sidestep is made; a larger value makes it gentler.
    """

    offsets: FloatArray
    room: float
    station: float
    step: float


def _both_sides(step: float, count: int) -> FloatArray:
    sides = step * np.arange(1, count + 1)
    return np.concatenate([[0.0], np.stack([sides, -sides], axis=1).ravel()])


_WALKING = _Manner(_both_sides(0.3, 5), room=0.1, station=0.25, step=2.2)
_DRIVING = _Manner(_both_sides(0.15, 8), room=0.2, station=1.0, step=14.0)
_MANNERS = {
    "pedestrian": _WALKING,
    **dict.fromkeys(("car", "van", "truck", "bus", "motorcycle", "bicycle"), _DRIVING),
}


def sidestepped(trace: Trace, obstacles: Sequence[Obstacle]) -> Trace:
    """Returns the trace with actors who go around obstacles where there is room.

    1. Along its way, each actor takes the cheapest sequence of offsets (Viterbi 1967), where what
       is deepest inside of an object nearby counts. People do not step onto land that vehicles
       drive over; where the simulation lets them cross it, all offsets are alike.
    2. A mean along the way makes steps of it, so that who stands is not moved sideways.
    3. Of two who then meet, the first in the trace chooses again if it has gone around something,
       with the others in the way.

    Args:
        trace: Simulated actors.
        obstacles: What is in the way.
    """
    ways = [_Way(actor, _MANNERS[actor.kind]) for actor in trace.actors if actor.kind in _MANNERS]
    if not obstacles or not ways:
        return trace
    objects = shapely.STRtree([shapely.Polygon(each.outline) for each in obstacles])
    for way in ways:
        way.look(objects)
    vehicles = [way.led() for way in ways if way.manner is _DRIVING]
    driven = shapely.STRtree(_driven(vehicles))
    for way in ways:
        if way.manner is _WALKING and way.is_blocked:
            way.look(driven)
    led = [way.led() for way in ways]
    meetings = Meetings(led, trace.rate)
    for index in sorted(meetings.overlapping()):
        if ways[index].is_blocked:
            ways[index].meet(meetings, index)
            led[index] = ways[index].led()
    known = {actor.id: actor for actor in led}
    return replace(trace, actors=tuple(known.get(actor.id, actor) for actor in trace.actors))


def _driven(actors: Sequence[Actor]) -> list[shapely.Geometry]:
    """Land that vehicles drive over, in pieces: one large outline would make each query slow."""
    pieces: list[shapely.Geometry] = []
    for actor in actors:
        if len(actor.positions) > 1:
            way = shapely.LineString(actor.positions[:, :2]).simplify(_CHORD)
            corners = shapely.get_coordinates(way)
            chords = shapely.linestrings(np.stack([corners[:-1], corners[1:]], axis=1))
            pieces += shapely.buffer(chords, actor.width / 2, quad_segs=2).tolist()
    return pieces


class _Way:
    """The way of an actor with stations along it, and what is in the way."""

    def __init__(self, actor: Actor, manner: _Manner) -> None:
        self.actor, self.manner = actor, manner
        places = actor.positions[:, :2]
        steps = np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=1)
        self._travelled = np.cumsum(steps)
        moves = np.concatenate([[True], steps[1:] > _LEAST])
        known = self._travelled[moves]
        self._stations = np.arange(0.0, known[-1] + manner.station, manner.station)
        self._x, self._y, self._headings = (
            np.interp(self._stations, known, values[moves])
            for values in (*places.T, actor.headings)
        )
        self._depths = np.zeros((len(self._stations), len(manner.offsets)))

    @property
    def is_blocked(self) -> bool:
        """Whether anything is in the way."""
        return bool(self._depths[:, 0].any())

    def look(self, tree: shapely.STRtree) -> None:
        """Adds how deep the body, with its room, is inside of outlines."""
        middles = self._beside(np.column_stack([self._x, self._y]), self._headings)
        bodies = body_lines(self.actor, middles, self._headings).ravel()
        reach = self.actor.width / 2 + self.manner.room
        body, outline = tree.query(bodies, predicate="dwithin", distance=reach)
        depths = deepest(bodies, body, tree.geometries[outline], reach)
        self._depths += depths.reshape(self._depths.shape)

    def meet(self, meetings: Meetings, index: int) -> None:
        """Adds how deep the actor, which has an index among others, would be inside of them."""
        ways = self._beside(self.actor.positions[:, :2], self.actor.headings)
        depths = meetings.depths(index, self.actor, ways, self.manner.room / 2)
        station = np.round(self._travelled / self.manner.station).astype(np.int64)
        station = np.minimum(station, len(self._stations) - 1)
        np.maximum.at(self._depths, station, depths)

    def led(self) -> Actor:
        """The actor on the cheapest way."""
        actor, manner = self.actor, self.manner
        if not self.is_blocked:
            return actor
        chosen = manner.offsets[_cheapest(self._near(), manner.offsets)]
        window = max(round(manner.step / manner.station), 1)
        offset = uniform_filter1d(chosen, window, mode="nearest")
        half = manner.station / 2
        behind, own, ahead = (
            np.interp(self._travelled + shift, self._stations, offset)
            for shift in (-half, 0.0, half)
        )
        positions = actor.positions.copy()
        positions[:, :2] += own[:, None] * _left(actor.headings)
        turn = np.clip(np.arctan((ahead - behind) / manner.station), -_STEEPEST, _STEEPEST)
        return replace(actor, positions=positions, headings=actor.headings + turn)

    def _beside(self, places: FloatArray, headings: FloatArray) -> FloatArray:
        """Places at all offsets, N x O x 2."""
        beside: FloatArray = (
            places[:, None] + self.manner.offsets[:, None] * _left(headings)[:, None]
        )
        return beside

    def _near(self) -> FloatArray:
        """The deepest within half of a step before and behind."""
        window = 2 * (round(self.manner.step / self.manner.station) // 2 + 1) + 1
        near: FloatArray = maximum_filter1d(self._depths, window, axis=0, mode="nearest")
        return near


def _left(headings: FloatArray) -> FloatArray:
    """Unit vectors to the left, N x 2."""
    return np.stack([-np.sin(headings), np.cos(headings)], axis=1)


def _cheapest(depths: FloatArray, offsets: FloatArray) -> IntArray:
    """Index of the offset at each station of the cheapest sequence, S."""
    own = _HIT * depths + _AWAY * np.abs(offsets)
    change = _TURN * np.abs(offsets[:, None] - offsets)
    cost = own[0]
    origins = np.zeros(depths.shape, dtype=np.int64)
    for station in range(1, len(depths)):
        total = cost[:, None] + change
        origins[station] = total.argmin(axis=0)
        cost = total.min(axis=0) + own[station]
    best = np.zeros(len(depths), dtype=np.int64)
    best[-1] = cost.argmin()
    for station in range(len(depths) - 1, 0, -1):
        best[station - 1] = origins[station, best[station]]
    return best

"""Connecting roads of a mapped junction: turns, ways around a roundabout, sidewalks at corners."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.geometry.hermite_curves import Cubic, turning_cubic
from envgen_usd.models.array_types import FloatArray
from envgen_usd.streets.street_mouths import LaneEnd, StreetMouth, Walk

_STRAIGHT = np.radians(35.0)
"""Turn up to which traffic goes straight on; beyond it turns left or right."""
_BACK = np.radians(155.0)
"""Turn from which traffic would go back where it came from."""
_LONGEST_CORNER = 45.0
"""Largest distance of two kerbs that a sidewalk joins around a corner, metres."""
_JOIN = np.radians(35.0)
"""Angle of a roundabout over which traffic joins and leaves its ring."""
_TOUCHING = 0.05
"""Largest distance of the borders of lanes that lie side by side, metres."""


@dataclass(frozen=True, eq=False)
class Ring:
    """A roundabout that is a single junction.

    Attributes:
        centre: x and y, metres.
        radius: Of the middle of its carriageway, metres.
        width: Of its carriageway, metres.
    """

    centre: FloatArray
    radius: float
    width: float


@dataclass(frozen=True, eq=False)
class Turn:
    """A connecting road; its lanes lie right of their middle.

    Attributes:
        incoming: The street end it comes from.
        outgoing: The street end it leads to.
        line: Its reference line.
        lanes: Pairs of lanes that it joins, from the middle outwards.
        walks: Sidewalks that it joins, or `None`.
        at_kerb: The reference line is the kerb and not the border of the inner lane.
        middle: Width of its only lane between both ends, metres; 0: in between theirs.
    """

    incoming: StreetMouth
    outgoing: StreetMouth
    line: tuple[Cubic, ...]
    lanes: tuple[tuple[LaneEnd, LaneEnd], ...]
    walks: tuple[Walk, Walk] | None = None
    at_kerb: bool = False
    middle: float = 0.0

    @property
    def length(self) -> float:
        """Length of the reference line, metres."""
        return sum(piece.length for piece in self.line)


def junction_turns(
    mouths: Sequence[StreetMouth],
    ring: Ring | None = None,
    banned: frozenset[tuple[int, int]] = frozenset(),
) -> Iterator[Turn]:
    """All connecting roads of a junction.

    1. From each street to each other one, but not back and not where a restriction forbids it.
    2. Lanes with arrows lead where these point; others straight on from lane to lane, right from
       the outer and left from the inner one.
    3. Sidewalks of neighbouring arms are joined along the kerb, together with the lanes beside
       them that turn right or go straight on.
    4. A cycle lane or track leads straight on to one on the same side, beside the outer lane
       straight on or, where this lies elsewhere, on a road of its own.
    5. Around a roundabout all traffic runs along its ring.

    Args:
        mouths: Street ends of the junction, counter-clockwise.
        ring: The roundabout, or `None`.
        banned: Numbers of mouths between which no traffic turns.
    """
    for number, incoming in enumerate(mouths):
        for step in range(1, len(mouths)):
            other = (number + step) % len(mouths)
            outgoing = mouths[other]
            turn = _angle(incoming, outgoing)
            drives = (number, other) not in banned and incoming.road != outgoing.road
            if drives and ring is not None:
                yield from _around(incoming, outgoing, ring)
                continue
            drives &= abs(turn) < _BACK
            lanes = lane_pairs(incoming.entering, outgoing.leaving, turn) if drives else ()
            cycling = _cycle_lanes(incoming, outgoing, turn) if drives else ()
            if lanes and cycling and all(_beside(lanes[-1][k], cycling[0][k]) for k in (0, 1)):
                lanes, cycling = (*lanes, *cycling), ()
            yield from _plain(incoming, outgoing, cycling)
            walks = _corner(incoming, outgoing) if step == 1 and ring is None else None
            if walks is not None:
                corner = _kerb_turn(incoming, outgoing, lanes, walks, turn)
                yield corner
                lanes = () if corner.lanes else lanes
            yield from _plain(incoming, outgoing, lanes)


def lane_pairs(
    entering: Sequence[LaneEnd], leaving: Sequence[LaneEnd], turn: float
) -> tuple[tuple[LaneEnd, LaneEnd], ...]:
    """Lanes that a turn joins, see rule 2 of `junction_turns`; from the middle outwards."""
    way = "left" if turn > _STRAIGHT else "right" if turn < -_STRAIGHT else "through"
    marked = any(lane.turns for lane in entering)
    usable = [lane for lane in entering if way in lane.turns or not lane.turns]
    if not marked or not usable:
        usable = {"left": [*entering[:1]], "right": [*entering[-1:]]}.get(way, [*entering])
    count = min(len(usable), len(leaving))
    if way == "right":
        return tuple(
            zip(usable[len(usable) - count :], leaving[len(leaving) - count :], strict=True)
        )
    return tuple(zip(usable[:count], leaving[:count], strict=True))


def _cycle_lanes(
    incoming: StreetMouth, outgoing: StreetMouth, turn: float
) -> tuple[tuple[LaneEnd, LaneEnd], ...]:
    """The pair of cycle lanes that goes straight on, see rule 4 of `junction_turns`."""
    first, last = incoming.cycling[0], outgoing.cycling[1]
    if abs(turn) > _STRAIGHT or first is None or last is None:
        return ()
    return ((first, last),) if incoming.entering and outgoing.leaving else ()


def _beside(lane: LaneEnd, outer: LaneEnd) -> bool:
    return bool(np.hypot(*(lane.outer - outer.inner)) < _TOUCHING)


def _angle(incoming: StreetMouth, outgoing: StreetMouth) -> float:
    turn = outgoing.direction - incoming.heading_in
    return float((turn + np.pi) % (2.0 * np.pi) - np.pi)


def _plain(
    incoming: StreetMouth, outgoing: StreetMouth, lanes: Sequence[tuple[LaneEnd, LaneEnd]]
) -> Iterator[Turn]:
    """A turn without a sidewalk; none where it would have to run backwards."""
    if lanes and _is_ahead(incoming, outgoing, lanes[0][1].inner - lanes[0][0].inner):
        line = turning_cubic(
            lanes[0][0].inner, incoming.heading_in, lanes[0][1].inner, outgoing.direction
        )
        yield Turn(incoming, outgoing, (line,), tuple(lanes))


def _corner(incoming: StreetMouth, outgoing: StreetMouth) -> tuple[Walk, Walk] | None:
    """Sidewalks that meet around a corner: on the right of what enters, and of what leaves."""
    first, last = incoming.walks[0], outgoing.walks[1]
    if first is None or last is None:
        return None
    gap = last.kerb - first.kerb
    if not 0.5 < np.hypot(*gap) < _LONGEST_CORNER:
        return None
    return (first, last) if _is_ahead(incoming, outgoing, gap) else None


def _is_ahead(incoming: StreetMouth, outgoing: StreetMouth, gap: FloatArray) -> bool:
    """True if a gap is crossed forwards, as seen by what enters and by what leaves."""
    ahead = np.array([np.cos(incoming.heading_in), np.sin(incoming.heading_in)])
    beyond = np.array([np.cos(outgoing.direction), np.sin(outgoing.direction)])
    return bool(gap @ ahead > 0.3 and gap @ beyond > 0.3)


def _kerb_turn(
    incoming: StreetMouth,
    outgoing: StreetMouth,
    lanes: Sequence[tuple[LaneEnd, LaneEnd]],
    walks: tuple[Walk, Walk],
    turn: float,
) -> Turn:
    """The sidewalk of a corner, with the lanes that go right or straight on beside it.

    Two roads with nearly the same border would overlap in slivers.
    """
    line = turning_cubic(walks[0].kerb, incoming.heading_in, walks[1].kerb, outgoing.direction)
    together = turn < _STRAIGHT and bool(lanes)
    together = together and all(
        np.hypot(*(lanes[-1][k].outer - walks[k].kerb)) < _TOUCHING for k in (0, 1)
    )
    return Turn(incoming, outgoing, (line,), tuple(lanes) if together else (), walks, True)


def _around(incoming: StreetMouth, outgoing: StreetMouth, ring: Ring) -> Iterator[Turn]:
    """A way around a roundabout, counter-clockwise along its ring."""
    if not incoming.entering or not outgoing.leaving:
        return
    first, last = incoming.entering[-1], outgoing.leaving[-1]
    start, end = first.inner - ring.centre, last.inner - ring.centre
    angles = np.arctan2(start[1], start[0]) + _JOIN, np.arctan2(end[1], end[0]) - _JOIN
    around = (angles[1] - angles[0]) % (2.0 * np.pi)
    pair = ((first, last),)
    if around > 2.0 * np.pi - 2.2 * _JOIN:
        short = turning_cubic(first.inner, incoming.heading_in, last.inner, outgoing.direction)
        yield Turn(incoming, outgoing, (short,), pair)
        return
    # The reference line is the inner border of a lane whose middle lies on the ring.
    radius = max(ring.radius - ring.width / 2.0, 1.0)
    count = max(int(np.ceil(around / np.radians(60.0))), 1)
    turns = angles[0] + np.linspace(0.0, around, count + 1)
    points = ring.centre + radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    ways = turns + np.pi / 2.0
    places = [first.inner, *points, last.inner]
    heads = [incoming.heading_in, *ways, outgoing.direction]
    line = tuple(
        turning_cubic(places[n], heads[n], places[n + 1], heads[n + 1])
        for n in range(len(places) - 1)
        if np.hypot(*(places[n + 1] - places[n])) > 1e-3
    )
    yield Turn(incoming, outgoing, line, pair, middle=ring.width)

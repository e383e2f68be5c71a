"""Rows of vehicles along kerbs and in parking lanes."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.actor_rules import ActorRules, KerbRules, ParkingAngle
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.distribution import Range, drawn
from envgen_usd.models.parked_actors import Looks
from envgen_usd.seeds import Draws, generator
from envgen_usd.traffic.standing.free_stretches import Roadside, packed
from envgen_usd.traffic.standing.kerb_lines import LEAST_ROOM, KerbLine
from envgen_usd.traffic.standing.standing_actors import Candidates, LookDraw

_PASSING = 0.75
"""Least distance from the middle of a driven lane to a parked vehicle, metres.

A larger value leaves traffic more room and parks on fewer streets.
"""
_RAISED = (0.5, 0.4)
"""Shares of a vehicle's width on the sidewalk, the first that fits: half, or two wheels alone.

Smaller shares need wider carriageways and leave more of a sidewalk.
"""
_LEAST_WALK = 1.0
"""Metres of sidewalk that stay free beside a vehicle half on it; a larger value raises fewer."""
_USUAL = "car"
"""Kind of vehicle whose usual width decides where rows are."""
_STRETCH = 80.0
"""Length of the stretches of kerb that have vehicles half on the sidewalk, or none, metres.

A larger value makes longer rows, and maps of few streets more unlike one another.
"""
_LEAST_LENGTH = 2.0
"""Least length of a place, metres; bounds the number of draws."""
_STALL = 2.5
"""Width of a place at an angle, metres (RASt 06, table 22)."""
_ANGLED = np.radians(60.0)
"""Angle of vehicles at an angle to the road."""
_DEPTHS = {"angled": 4.7, "perpendicular": 4.9}
"""Least width of a parking lane with vehicles at an angle, metres."""


@dataclass(frozen=True)
class _Row:
    """A row of places.

    Attributes:
        line: The kerb or parking lane.
        angle: Of the vehicles to the road.
        place: As `ParkedActor.place`.
        occupancy: Share of the places that are taken.
        gap: Metres between two places.
        offset: Metres from the kerb to the vehicle; none in parking lanes.
        room: Largest width of a vehicle and its offset, metres.
        raised: Share of a vehicle's width that stands on the sidewalk.
        reversed: Share of the vehicles that stand the other way round.
        stretches: Share of the stretches of the line that vehicles stand along.
    """

    line: KerbLine
    angle: ParkingAngle
    place: str
    occupancy: Range
    gap: Range
    offset: Range
    room: float
    raised: float
    reversed: float
    stretches: float = 1.0


def park_along_roads(
    lines: Iterable[KerbLine], roadside: Roadside, rules: ActorRules, looks: Looks, seed: int
) -> Iterator[Candidates]:
    """Yields the vehicles along roads.

    The vehicles of a line depend on the seed, the line, and what stands in the chunk.

    Args:
        lines: Kerbs and parking lanes.
        roadside: Where vehicles may stand in the chunk.
        rules: The environment.
        looks: Looks by kind.
        seed: The user's seed.
    """
    for row, vehicles in _rows(lines, rules, looks, seed):
        yield _parked(row, roadside, vehicles, seed)


def lines_with_rows(
    lines: Iterable[KerbLine], rules: ActorRules, looks: Looks, seed: int
) -> Iterator[KerbLine]:
    """Yields the lines along which vehicles may park, whatever stands there.

    Args:
        lines: Kerbs and parking lanes.
        rules: The environment.
        looks: Looks by kind.
        seed: The user's seed.
    """
    yield from (row.line for row, _ in _rows(lines, rules, looks, seed))


def _rows(
    lines: Iterable[KerbLine], rules: ActorRules, looks: Looks, seed: int
) -> Iterator[tuple[_Row, LookDraw]]:
    """Rows of places, and the looks of their vehicles."""
    kerb_looks = LookDraw(rules.kerbs.vehicles, looks)
    bay_looks = LookDraw(rules.bays.vehicles, looks)
    for line in lines:
        draws = Draws(seed, "actors", "street", line.lane.road)
        is_bay = line.kind == "parking_lane"
        vehicles = bay_looks if is_bay else kerb_looks
        if not vehicles:
            continue
        if is_bay:
            yield _bay_row(line, rules, draws), vehicles
        elif (row := _kerb_row(line, rules.kerbs, draws, vehicles)) is not None:
            yield row, vehicles


def _bay_row(line: KerbLine, rules: ActorRules, draws: Draws) -> _Row:
    angle: ParkingAngle = draws.choice("angle", rules.bays.wide)
    if line.width < _DEPTHS.get(angle, 0.0):
        angle = "parallel"
    turned_round = 1.0 - rules.bays.nose_in if angle != "parallel" else rules.kerbs.reversed
    occupancy = rules.bays.occupancy
    room = line.width if angle == "parallel" else np.inf
    return _Row(
        line, angle, "parking_lane", occupancy, rules.kerbs.gap, (0.0, 0.0), room, 0.0, turned_round
    )


def _kerb_row(line: KerbLine, rules: KerbRules, draws: Draws, looks: LookDraw) -> _Row | None:
    """The row at a kerb, or none: the street decides, the same for all of its sections."""
    parked, both = draws.happens("parked", rules.streets), draws.happens("both", rules.both)
    left = draws.happens("left", 0.5)
    if not parked:
        return None
    widths = [look.width for look in looks.looks if look.kind == _USUAL] or [1.8]
    usual = float(np.median(widths))
    rows = 2 if both and line.sides == 2 else 1
    if line.sides == 2 and not both and left != line.left_side:
        return None
    room = min((line.width - LEAST_ROOM) / rows, line.beside - _PASSING)
    shares = (0.0, *(_RAISED if rules.raised and line.walk else ()))
    for share in shares:
        offset: Range = (0.0, 0.0) if share else rules.offset
        widest = room / (1.0 - share)
        walk_left = line.walk - share * usual
        if widest >= usual + max(offset) and (not share or walk_left >= _LEAST_WALK):
            place = "raised_kerb" if share else "kerb"
            return _Row(
                line, "parallel", place, rules.occupancy, rules.gap, offset, widest, share,
                rules.reversed, rules.raised if share else 1.0,
            )  # fmt: skip
    return None


def _parked(row: _Row, roadside: Roadside, looks: LookDraw, seed: int) -> Candidates:
    line, name, chunk = row.line, row.line.lane.id, roadside.chunk.name
    rng = generator(seed, "actors", row.place, name)
    occupancy, offset = float(drawn(rng, row.occupancy)), float(drawn(rng, row.offset))
    rng = generator(seed, "actors", row.place, name, chunk)
    count = int(line.s[-1] / (_LEAST_LENGTH + min(row.gap))) + 1
    shares = rng.random((count, 3))
    vehicles = looks.at(shares[:, 0])
    sizes = np.array([look.size for look in vehicles])
    lengths = _lengths(row.angle, sizes)
    gaps = drawn(rng, row.gap, count) if row.angle == "parallel" else np.zeros(count)
    widths = np.array([look.width for look in vehicles])
    fits = np.flatnonzero(widths + offset <= row.room)
    free = roadside.free(line, *_reach(row, looks, offset))
    places, starts = packed(lengths[fits], gaps[fits], free)
    rows = fits[places]
    middle = starts + lengths[rows] / 2
    kept = (shares[rows, 1] < occupancy) & line.is_straight(middle, 2.5)
    kept &= _taken_stretches(row, seed)[(middle / _STRETCH).astype(np.int64)]
    rows, middle = rows[kept], middle[kept]
    points, along = line.at(middle)
    turned_round = shares[rows, 2] < row.reversed
    positions, headings = _poses(row, points, along, widths[rows], offset, turned_round)
    tile = roadside.chunk.prim_name
    return Candidates(
        [f"{row.place}_{name}_{tile}_{number}" for number in rows.tolist()],
        [vehicles[number] for number in rows.tolist()],
        positions,
        headings,
        row.place,
        on_road=row.place != "raised_kerb",
    )


def _taken_stretches(row: _Row, seed: int) -> BoolArray:
    """True for the stretches of a line that vehicles stand along."""
    count = int(row.line.s[-1] / _STRETCH) + 1
    draws = generator(seed, "actors", row.place, "stretches", row.line.lane.id).random(count)
    taken: BoolArray = draws < row.stretches
    return taken


def _reach(row: _Row, looks: LookDraw, offset: float) -> tuple[float, float]:
    """Metres from the line outwards to the middle of usual vehicles, and to what stands there."""
    if row.place == "kerb":
        return -float(np.median([look.width for look in looks.looks])) / 2 - offset, 0.0
    widest = max((look.size[1] for look in looks.looks if look.width <= row.room), default=0.0)
    return 0.0, float(widest) / 2 + 0.1 if row.place == "raised_kerb" else 0.0


def _lengths(angle: ParkingAngle, sizes: FloatArray) -> FloatArray:
    """Length of the kerb that each vehicle takes, N, metres."""
    if angle == "parallel":
        return sizes[:, 0]
    wide = np.maximum(sizes[:, 1] + 0.3, _STALL)
    return wide if angle == "perpendicular" else wide / np.sin(_ANGLED)


def _poses(  # noqa: PLR0913, PLR0917 - what poses follow from
    row: _Row,
    points: FloatArray,
    along: FloatArray,
    widths: FloatArray,
    offset: float,
    turned_round: BoolArray,
) -> tuple[FloatArray, FloatArray]:
    """Positions (N x 3) and headings (N) of the vehicles of a row at points of its line."""
    outward = row.line.outward
    normal = outward * np.column_stack([-np.sin(along), np.cos(along)])
    moved = points.copy()
    if row.place == "kerb":
        moved[:, :2] -= normal * (widths / 2 + offset)[:, None]
    elif row.place == "raised_kerb":
        moved[:, :2] -= normal * (widths * (0.5 - row.raised))[:, None]
    turn = {"parallel": 0.0, "angled": _ANGLED, "perpendicular": np.pi / 2}[row.angle]
    return moved, along + outward * turn + np.pi * turned_round

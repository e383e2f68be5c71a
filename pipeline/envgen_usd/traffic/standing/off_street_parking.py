"""Vehicles on parking spaces of the road file, car parks, driveways and yards."""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
import shapely

from envgen_usd.models.actor_rules import ActorRules, BayRules, LotRules
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City
from envgen_usd.models.distribution import drawn
from envgen_usd.models.landuse import LanduseClass, Plot
from envgen_usd.models.parked_actors import Looks
from envgen_usd.seeds import generator
from envgen_usd.traffic.standing.standing_actors import Candidates, LookDraw

_STALL_WIDTH, _STALL_LENGTH, _AISLE = 2.5, 5.0, 6.0
"""Sizes of a car park's places and of the ways between them, metres (RASt 06, table 22)."""
_PARALLEL_STALL = 5.9
"""Length of a place beside a lane, metres; longer parking spaces hold several."""
_MARGIN = 1.0
"""Metres along the border of a car park that stay free."""
_ENTRY = 3.0
"""Half the width of the way into a car park, metres."""
_GARAGE = (2.2, 6.0)
"""Least and largest width of the door of a garage, metres."""
_BEFORE_DOOR = 0.7
"""Metres between the door of a garage and a vehicle."""
_YARD_CELL = 14.0
"""Metres between the places of a yard; each is taken at random."""
_HECTARE = 1e4


def park_in_bays(
    bays: Mapping[str, FloatArray], rules: BayRules, looks: Looks, seed: int
) -> Iterator[Candidates]:
    """Yields the vehicles on parking spaces of the road file.

    Args:
        bays: Corners of each by id, 4 x 3, metres; a long one holds several vehicles.
        rules: The environment.
        looks: Looks by kind.
        seed: The user's seed.
    """
    vehicles = LookDraw(rules.vehicles, looks)
    for name, corners in bays.items() if vehicles else ():
        places, heading = _stalls(corners)
        rng = generator(seed, "actors", "parking_space", name)
        shares = rng.random((len(places), 3))
        taken = np.flatnonzero(shares[:, 1] < drawn(rng, rules.occupancy))
        headings = heading + np.pi * (shares[taken, 2] < 0.5)
        ids = [f"parking_space_{name}_{number}" for number in taken.tolist()]
        chosen = vehicles.at(shares[taken, 0])
        yield Candidates(ids, chosen, places[taken], headings, "parking_space", on_road=True)


def _stalls(corners: FloatArray) -> tuple[FloatArray, float]:
    """Middles of the places of a parking space (N x 3), and the direction of the vehicles."""
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(sides[:, :2], axis=1)
    long, short = (0, 1) if lengths[0] >= lengths[1] else (1, 0)
    if lengths[short] > (_STALL_LENGTH + _STALL_WIDTH) / 2:
        # Places side by side; the vehicles stand across the long side.
        count, axis = int(lengths[long] / (_STALL_WIDTH - 0.2)), sides[short]
    else:
        count, axis = int(max(lengths[long] / _PARALLEL_STALL, 1.0)), sides[long]
    shares = (np.arange(max(count, 1)) + 0.5) / max(count, 1)
    middle = corners.mean(axis=0)
    places: FloatArray = middle + (shares[:, None] - 0.5) * sides[long]
    return places, float(np.arctan2(axis[1], axis[0]))


def park_in_car_parks(
    plots: Iterable[Plot], rules: LotRules, looks: Looks, seed: int
) -> Iterator[Candidates]:
    """Yields the vehicles on car parks; a way leads straight in from the street.

    Args:
        plots: Plots; those with the landuse of car parks are filled with rows of places.
        rules: The environment.
        looks: Looks by kind.
        seed: The user's seed.
    """
    vehicles = LookDraw(rules.vehicles, looks)
    for plot in plots:
        if plot.landuse is not LanduseClass.PARKING or not vehicles:
            continue
        rng = generator(seed, "actors", "car_park", plot.id)
        occupancy = float(drawn(rng, rules.car_parks))
        places, headings, into = _car_park(plot)
        shares = rng.random((len(places), 3))
        taken = np.flatnonzero(shares[:, 1] < occupancy)
        # A vehicle that backed in looks to the aisle.
        turn = np.pi * (shares[taken, 2] < 0.35)
        yield Candidates(
            [f"car_park_{plot.id}_{number}" for number in taken.tolist()],
            vehicles.at(shares[taken, 0]),
            places[taken],
            headings[taken] + into + turn,
            "car_park",
        )


def _car_park(plot: Plot) -> tuple[FloatArray, FloatArray, float]:
    """Middles of places (N x 3), their headings (N) to the direction into the plot, and that."""
    start, end = plot.frontage
    along = (end - start) / max(float(np.hypot(*(end - start))), 1e-9)
    axes = np.stack([along, [-along[1], along[0]]])
    local = (plot.polygon - start) @ axes.T
    low, high = local.min(axis=0) + _MARGIN, local.max(axis=0) - _MARGIN
    x = np.arange(low[0] + _STALL_WIDTH / 2, high[0] - _STALL_WIDTH / 2, _STALL_WIDTH)
    # Row, aisle, row; two modules stand back to back.
    module = 2 * _STALL_LENGTH + _AISLE
    count = int((high[1] - low[1] + 1e-6) // module) + 1
    first = low[1] + _STALL_LENGTH / 2 + module * np.arange(count)
    y = np.concatenate([first, first + _STALL_LENGTH + _AISLE])
    facing = np.repeat([-1.0, 1.0], count)
    inside = y + _STALL_LENGTH / 2 <= high[1]
    grid = np.stack(np.meshgrid(x, y[inside], indexing="ij"), axis=-1).reshape(-1, 2)
    turn = np.tile(facing[inside], len(x))
    access = local.mean(axis=0) if plot.access is None else (plot.access - start) @ axes.T
    grid_free = np.abs(grid[:, 0] - access[0]) > _ENTRY + _STALL_WIDTH / 2
    places = start + grid @ axes
    room = shapely.Polygon(plot.polygon).buffer(-_MARGIN - _STALL_LENGTH / 2)
    grid_free &= shapely.contains_xy(room, places[:, 0], places[:, 1])
    rows = np.flatnonzero(grid_free)
    headings = np.where(turn[rows] > 0.0, 0.0, np.pi)
    into = float(np.arctan2(axes[1, 1], axes[1, 0]))
    return np.column_stack([places[rows], np.zeros(len(rows))]), headings, into


def garage_doors(city: City) -> FloatArray:
    """Returns the doors of garages: x, y, direction outwards (radians), width; N x 4."""
    doors = []
    for feature in city.walk():
        for surface in feature.surfaces:
            for opening in surface.openings:
                if opening.kind == "DoorSurface" and len(opening.polygons):
                    doors.append(_door(opening.polygons.rings(0)[0]))
    found = np.array(doors).reshape(-1, 4)
    wide: FloatArray = found[(found[:, 3] >= _GARAGE[0]) & (found[:, 3] <= _GARAGE[1])]
    return wide


def _door(ring: FloatArray) -> FloatArray:
    """Middle, outward direction and width of a door in a vertical wall."""
    turn = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
    direction = float(np.arctan2(turn[1], turn[0]))
    across = ring[:, :2] @ np.array([-np.sin(direction), np.cos(direction)])
    middle = (ring[:, :2].min(axis=0) + ring[:, :2].max(axis=0)) / 2
    return np.array([*middle, direction, np.ptp(across)])


def park_on_driveways(
    doors: FloatArray, rules: LotRules, looks: Looks, seed: int
) -> Iterator[Candidates]:
    """Yields a vehicle before some garages.

    Args:
        doors: As `garage_doors` returns them.
        rules: The environment.
        looks: Looks by kind.
        seed: The user's seed.
    """
    vehicles = LookDraw(rules.vehicles, looks)
    if not vehicles or not len(doors):
        return
    names = [f"{x:.1f}_{y:.1f}".replace("-", "m") for x, y in doors[:, :2].tolist()]
    shares = np.array([generator(seed, "actors", "driveway", name).random(3) for name in names])
    rows = np.flatnonzero(shares[:, 1] < rules.driveways)
    chosen = vehicles.at(shares[rows, 0])
    reach = np.array([look.size[0] for look in chosen]) / 2 + _BEFORE_DOOR
    out = doors[rows, 2]
    x = doors[rows, 0] + reach * np.cos(out)
    y = doors[rows, 1] + reach * np.sin(out)
    # Most drivers leave their driveway forwards or backwards as they came: nose to the door.
    headings = out + np.pi * (shares[rows, 2] < 0.7)
    ids = [f"driveway_{names[row]}" for row in rows.tolist()]
    yield Candidates(ids, chosen, np.column_stack([x, y, np.zeros(len(x))]), headings, "driveway")


def park_on_yards(
    plots: Iterable[Plot], rules: ActorRules, looks: Looks, seed: int
) -> Iterator[Candidates]:
    """Yields the vehicles on yards of industrial plots, in line with the plot.

    Args:
        plots: Plots; those with the landuse of industry have yards.
        rules: The environment.
        looks: Looks by kind.
        seed: The user's seed.
    """
    vehicles = LookDraw(rules.lots.yard_vehicles, looks)
    for plot in plots:
        shape = shapely.Polygon(plot.polygon)
        if plot.landuse is not LanduseClass.RUBBLE or not vehicles or rules.lots.yards <= 0.0:
            continue
        rng = generator(seed, "actors", "yard", plot.id)
        start, end = plot.frontage
        along = (end - start) / max(float(np.hypot(*(end - start))), 1e-9)
        low, high = plot.polygon.min(axis=0), plot.polygon.max(axis=0)
        count = int(np.ceil(np.prod((high - low) / _YARD_CELL))) + 1
        shares = rng.random((count, 5))
        share = rules.lots.yards * shape.area / _HECTARE / count
        taken = np.flatnonzero(shares[:, 0] < share * np.prod(high - low) / max(shape.area, 1.0))
        chosen = vehicles.at(shares[taken, 1])
        places = low + shares[taken, 2:4] * (high - low)
        room = shape.buffer(-2.0)
        quarter = np.pi / 2 * np.floor(4 * shares[taken, 4])
        headings = float(np.arctan2(along[1], along[0])) + quarter
        candidates = Candidates(
            [f"yard_{plot.id}_{number}" for number in taken.tolist()],
            chosen,
            np.column_stack([places, np.zeros(len(taken))]),
            headings,
            "yard",
        )
        inside = shapely.covers(room, shapely.polygons(candidates.rectangles()))
        yield candidates.chosen(np.flatnonzero(inside))

"""Harbours: stacks of containers on quays and yards, and bollards for ships at the water."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, chunk_at, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.headings import heading_of
from envgen_usd.city.plots.plot_frame import is_unoccupied, rectangle_at, widened
from envgen_usd.city.plots.spread_places import spread
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.environment_profile import YardRules
from envgen_usd.models.landuse import ROW_UNIT, LanduseClass, LanduseMap
from envgen_usd.seeds import Draws

CONTAINER = (6.06, 2.44, 2.59)
"""Length, width and height of a container, metres (ISO 668, 20 feet)."""
SLOT = (6.6, 2.7)
"""Distance of containers along and across their rows, metres."""
GROUP = (5, 4)
"""Containers side by side along and across their rows, between lanes of vehicles."""
LANE = (12.0, 9.0)
"""Width of the lanes between groups, along and across the rows, metres."""
TIERS = 3
"""Largest number of containers on each other."""
EDGE = 6.0
"""Least distance of a container from the border of its yard, metres."""
MOORING = 14.0
"""Distance of bollards at the water, metres; a larger value gives fewer."""
_BESIDE = 1.6
"""Distance of a bollard from the water, metres."""
_CLEARANCE = 0.4
"""Least distance from roads and from what stands already, metres."""
# SIG3D code list CityFurniture_function: other.
_OTHER = "1540"


@dataclass(frozen=True)
class _Yard:
    """The harbour's ground in a chunk.

    Attributes:
        landuse: Landuse of the chunk.
        cells: 255 x 255, cells of the class.
        away: 255 x 255, distance from the border of these cells, metres.
    """

    landuse: LanduseMap
    cells: BoolArray
    away: FloatArray

    def holds(self, points: FloatArray, distance: float) -> bool:
        """True if all points (N x 2) in the chunk keep a distance from the border, metres."""
        cells = ((points - self.landuse.chunk.origin) / CELL_SIZE).astype(np.int64)
        column, row = np.clip(cells, 0, len(self.cells) - 1).T
        return bool((self.away[row, column] >= distance).all())


def place_quays(scene: Scene, landuse: LanduseMap, rules: YardRules) -> tuple[CityObject, ...]:
    """Returns the containers and mooring bollards of a chunk's harbours as ``CityFurniture``.

    Containers stand in groups on one grid of the map for each direction of rows, which follow the
    longest border of the yard, so that chunks agree.

    Args:
        scene: Scene of the chunk.
        landuse: Landuse of the chunk.
        rules: Share of the places of containers that hold some.
    """
    cells = landuse.classes == LanduseClass.QUAY
    if not cells.any():
        return ()
    away = ndimage.distance_transform_edt(cells) * CELL_SIZE
    yard = _Yard(landuse, cells, away)
    return (*_stacks(scene, yard, rules), *_moorings(scene, yard))


def _stacks(scene: Scene, yard: _Yard, rules: YardRules) -> Iterator[CityObject]:
    rows = np.zeros_like(yard.landuse.plots) if yard.landuse.rows is None else yard.landuse.rows
    for code in np.unique(rows[yard.cells & (yard.away >= EDGE)]).tolist():
        along = np.array([np.cos(code * ROW_UNIT), np.sin(code * ROW_UNIT)])
        for column, row, place in _slots(scene, along):
            draws = Draws(scene.seed, "city", "containers", code, column, row)
            if chunk_at(place) != scene.chunk or not draws.happens("stands", rules.stacks):
                continue
            shape = rectangle_at(place, along, *CONTAINER[:2])
            corners = np.array(shape.exterior.coords)
            own = _code_at(place, rows, yard.landuse) == code and yard.holds(corners, EDGE)
            if own and is_unoccupied(widened(shape, _CLEARANCE), scene):
                yield from _stack(scene, f"{code}_{column}_{row}", place, along, draws)


def _slots(scene: Scene, along: FloatArray) -> Iterator[tuple[int, int, FloatArray]]:
    """Column, row and middle of the places of containers in and around a chunk."""
    axes = np.stack([along, [-along[1], along[0]]])
    corners = scene.chunk.origin + CHUNK_SIZE * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    period = np.array(SLOT) * GROUP + LANE
    low, high = (pick(corners @ axes.T / period, axis=0) for pick in (np.min, np.max))
    first, last = np.floor(low).astype(int), np.ceil(high).astype(int)
    columns, rows = (
        [group * size + n for group in range(a, b + 1) for n in range(size)]
        for a, b, size in zip(first, last, GROUP, strict=True)
    )
    for column in columns:
        for row in rows:
            group, within = np.divmod([column, row], GROUP)
            yield column, row, (group * period + within * SLOT) @ axes


def _stack(
    scene: Scene, name: str, place: FloatArray, along: FloatArray, draws: Draws
) -> Iterator[CityObject]:
    """Containers on each other; the lowest stands on the ground."""
    place = snap(place)
    ground = float(snap(scene.ground.heights(place[None]))[0])
    facts = {"class": "1000", "function": _OTHER}
    for tier in range(draws.whole("tiers", (1, TIERS))):
        position = np.append(place, round(ground + tier * CONTAINER[2], 3))
        placement = Placement(position, heading_of(along), np.array(CONTAINER), "container")
        yield CityObject(f"container_{name}_{tier}", "CityFurniture", facts, placement=placement)


def _code_at(place: FloatArray, rows: np.ndarray, landuse: LanduseMap) -> int:
    column, row = ((place - landuse.chunk.origin) / CELL_SIZE).astype(int)
    return int(rows[min(row, len(rows) - 1), min(column, len(rows) - 1)])


def _moorings(scene: Scene, yard: _Yard) -> Iterator[CityObject]:
    """Bollards at the water, as far apart as `MOORING`."""
    water = yard.landuse.classes == LanduseClass.WATER
    if not water.any():
        return
    away, nearest = ndimage.distance_transform_edt(~water, return_indices=True)
    here = yard.cells & (np.abs(away * CELL_SIZE - _BESIDE) < CELL_SIZE / 2.0)
    row, column = np.nonzero(here)
    cells = np.stack([column, row], axis=1).astype(np.float64)
    points: FloatArray = (cells + 0.5) * CELL_SIZE + scene.chunk.origin
    inside = points - scene.chunk.origin
    # Half the distance from the chunk's border keeps those across it apart.
    own = np.all((inside > MOORING / 2.0) & (inside < CHUNK_SIZE - MOORING / 2.0), axis=1)
    own &= ~scene.road.near(points, _CLEARANCE) & ~scene.taken.near(points, _CLEARANCE)
    shore = np.stack([nearest[1][row, column], nearest[0][row, column]], axis=1)
    chosen = np.flatnonzero(own)
    chosen = chosen[spread(points[chosen], MOORING)]
    for number in chosen.tolist():
        place = snap(points[number])
        towards = (shore[number] + 0.5) * CELL_SIZE + scene.chunk.origin - points[number]
        position = np.append(place, snap(scene.ground.heights(place[None]))[0])
        placement = Placement(position, heading_of(towards), np.zeros(3), "mooring")
        facts = {"class": "1000", "function": _OTHER}
        name = f"mooring_{scene.chunk.prim_name}_{number}"
        yield CityObject(name, "CityFurniture", facts, placement=placement)

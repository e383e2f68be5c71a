"""Harbours: stacks of containers on quays and yards, and bollards for ships at the water."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, Chunk, snap, tiles_of
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.headings import heading_of
from envgen_usd.city.plots.land_rows import at_points, directions_of, row_axes, span_of
from envgen_usd.city.plots.plot_frame import is_unoccupied, rectangle_at, widened
from envgen_usd.city.plots.spread_places import spread
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.environment_profile import YardRules
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.seeds import Draws

CONTAINER = (6.06, 2.44, 2.59)
"""Length, width and height of a container, metres (ISO 668, 20 feet)."""
_CORNERS = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * CONTAINER[:2]
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
    rows, chunk = directions_of(yard.landuse), yard.landuse.chunk
    for code in np.unique(rows[yard.cells & (yard.away >= EDGE)]).tolist():
        axes = row_axes(code)
        slots, places = _slots(chunk, axes)
        corners = places[:, None] + _CORNERS @ axes
        own = (tiles_of(places) == (chunk.x, chunk.y)).all(axis=1)
        own &= at_points(rows, places, chunk) == code
        own &= (at_points(yard.away, corners, chunk) >= EDGE).all(axis=1)
        for (column, row), place in zip(slots[own].tolist(), places[own], strict=True):
            draws = Draws(scene.seed, "city", "containers", code, column, row)
            shape = widened(rectangle_at(place, axes[0], *CONTAINER[:2]), _CLEARANCE)
            if draws.happens("stands", rules.stacks) and is_unoccupied(shape, scene):
                yield from _stack(scene, f"{code}_{column}_{row}", place, axes[0], draws)


def _slots(chunk: Chunk, axes: FloatArray) -> tuple[IntArray, FloatArray]:
    """Column and row, and middle, of the places of containers in and around a chunk, N x 2 each."""
    period = np.array(SLOT) * GROUP + LANE
    low, high = span_of(chunk, axes)
    first, last = np.floor(low / period).astype(int), np.ceil(high / period).astype(int) + 1
    sides = (np.arange(a * n, b * n) for a, b, n in zip(first, last, GROUP, strict=True))
    slots = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    group, within = np.divmod(slots, GROUP)
    return slots, (group * period + within * SLOT) @ axes


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

"""A building on every plot that has room for one."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import shapely

from envgen_usd.city.building import make_building
from envgen_usd.city.design import Design
from envgen_usd.city.draws import LEAST_OVERHANG, Draws, draw_design
from envgen_usd.city.enclosures import Enclosed
from envgen_usd.city.facade import Facade, lay_out
from envgen_usd.city.garage import garage_range
from envgen_usd.city.given import chunk_of
from envgen_usd.city.installations import BALCONY_DEPTH, PORCH_DEPTH
from envgen_usd.city.rectangle import largest_rectangle
from envgen_usd.city.scene import Scene
from envgen_usd.city.shell import taken
from envgen_usd.city.surfaces import Site
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import CityObject
from envgen_usd.models.landuse import Plot
from envgen_usd.models.profile import BuildingRules, Range
from envgen_usd.seeds import generator

_LEAST_SIDE = 4.0
"""Metres; on less room no building stands."""
_GARAGE_WALLS = 0.4
_SNAP_ROOM = 0.002
"""Metres that a corner may move when it is put on the grid of coordinates."""


@dataclass(frozen=True)
class Gate:
    """A door at the street, or the gate of a garage.

    Attributes:
        place: Its middle, 2, metres.
        foot: Place on the frontage before it, 2, metres.
        width: Metres.
    """

    place: FloatArray
    foot: FloatArray
    width: float


@dataclass(frozen=True)
class Buildings:
    """The buildings of a chunk, and the ground that is taken.

    Attributes:
        features: The buildings whose plots lie in the chunk.
        footprints: Outlines of the walls of these and of those around, in plan.
        enclosed: The plots of these, with what their enclosures need to know.
    """

    features: tuple[CityObject, ...]
    footprints: tuple[shapely.Polygon, ...]
    enclosed: tuple[Enclosed, ...]


@dataclass(frozen=True)
class _Plan:
    """A design with its place.

    Attributes:
        design: What it looks like.
        origin: 2, left end of the street side.
        along: 2, direction of the street side.
        footprint: Around the walls.
        covered: Around all that stands out.
        room: Free depth before the street side, metres.
    """

    design: Design
    origin: FloatArray
    along: FloatArray
    footprint: shapely.Polygon
    covered: shapely.Polygon
    room: float


def place_buildings(scene: Scene, plots: Sequence[Plot], rules: BuildingRules) -> Buildings:
    """Puts a building on each plot whose centroid lies in a chunk.

    Each stands in the largest rectangle that fits into its plot and is parallel to its frontage,
    behind the setback. A building is left out where it would touch the road or what stands there
    already, leave its plot, or overlap the building of an overlapping plot whose id sorts before
    its own; so every chunk decides alike, whoever builds it.

    Args:
        scene: The chunk.
        plots: Those that come near the chunk.
        rules: The environment's ranges.
    """
    features, footprints, enclosed = [], [], []
    for plot, own in _plans(scene, plots, rules):
        footprints.append(own.footprint)
        if chunk_of(shapely.Polygon(plot.polygon)) == scene.chunk:
            features.append(_build(plot, own, scene))
            gates = tuple(gate.place for gate in _gates(plot, own))
            enclosed.append(Enclosed(plot, own.covered, gates))
    return Buildings(tuple(features), tuple(footprints), tuple(enclosed))


def find_gates(scene: Scene, plots: Sequence[Plot], rules: BuildingRules) -> tuple[Gate, ...]:
    """Returns the doors and gates of the buildings that `place_buildings` makes.

    Args:
        scene: The chunk.
        plots: Those that come near the chunk.
        rules: The environment's ranges.
    """
    return tuple(gate for plot, own in _plans(scene, plots, rules) for gate in _gates(plot, own))


def _plans(
    scene: Scene, plots: Sequence[Plot], rules: BuildingRules
) -> Iterator[tuple[Plot, _Plan]]:
    """The plots that are built on."""
    shapes = [shapely.Polygon(plot.polygon) for plot in plots]
    tree = shapely.STRtree(shapes)

    @cache
    def plan(index: int) -> _Plan | None:
        return _plan(plots[index], shapes[index], rules, scene.seed)

    for index, plot in enumerate(plots):
        own = plan(index)
        if own is None or _is_blocked(own, scene):
            continue
        around = tree.query(shapes[index], predicate="intersects").tolist()
        rivals = [plan(i) for i in around if plots[i].id < plot.id]
        if not any(rival and own.covered.intersects(rival.covered) for rival in rivals):
            yield plot, own


def _is_blocked(plan: _Plan, scene: Scene) -> bool:
    return scene.road.touches(plan.covered) or scene.taken.touches(plan.covered)


def _gates(plot: Plot, plan: _Plan) -> tuple[Gate, ...]:
    """Doors at the street, and the garage."""
    into = np.array([-plan.along[1], plan.along[0]])
    ground = float((plan.origin - plot.frontage[0]) @ into)
    found = []
    for at, depth, width in _openings(plan.design):
        foot = plan.origin + at * plan.along - ground * into
        found.append(Gate(foot + (ground + depth) * into, foot, width))
    return tuple(found)


def _openings(design: Design) -> list[tuple[float, float, float]]:
    """The garage's gate and the doors.

    Middle from the house's left end, distance behind the building line, and width.
    """
    facade = Facade(design.width, design.storeys, True, taken(design))
    doors = [hole.box for hole in lay_out(design, facade) if hole.kind == "DoorSurface"]
    front = design.main_front
    found = [((left + right) / 2, front, right - left) for left, _, right, _ in doors]
    if design.extras.garage:
        middle = design.garage_left + design.extras.garage / 2
        behind = garage_range(design)[0]
        found.insert(0, (middle, behind, design.extras.garage - _GARAGE_WALLS))
    return found


def _left_end(
    design: Design, free: tuple[float, float], access: float | None, share: float
) -> float:
    """Where the house's left end lies on its plot: so that the paved way leads to a gate.

    Args:
        design: The house.
        free: Least and greatest place.
        access: Where the way crosses the frontage, if there is one.
        share: Of the room to the left, where there is none.
    """
    low, high = free
    gates = _openings(design)
    if access is None or not gates:
        return low + share * (high - low)
    # The garage comes first; of many gates the one that is nearest.
    wanted = [access - middle for middle, _, _ in gates]
    ends = [min(max(left, low), high) for left in wanted]
    if design.extras.garage:
        return ends[0]
    return min(zip(ends, wanted, strict=True), key=lambda pair: abs(pair[0] - pair[1]))[0]


def _plan(plot: Plot, shape: shapely.Polygon, rules: BuildingRules, seed: int) -> _Plan | None:
    """The building of a plot, or none where there is no room for it."""
    start, end = plot.frontage
    along = (end - start) / np.hypot(*(end - start))
    into = np.array([-along[1], along[0]])
    x0, y0, x1, y1 = largest_rectangle((plot.polygon - start) @ np.stack([along, into], axis=1))
    draws = generator(seed, "city", chunk_of(shape).name, plot.id)
    front, side, place = draws.random(3).tolist()
    if rules.style == "row":
        # Houses of a row share their building line, apart from a few centimetres.
        front = 0.06 * front + 0.94 * float(generator(seed, "city", "row", plot.road).random())
    setback = max(_within(rules.setback, front), _SNAP_ROOM)
    gap = max(_within(rules.side_setback, side), _SNAP_ROOM)
    width, depth = x1 - x0 - 2 * gap, y1 - y0 - setback - gap
    if min(width, depth) < _LEAST_SIDE:
        return None
    design = draw_design(rules, (width, depth), Draws(draws))
    behind = depth - design.depth + gap - _SNAP_ROOM
    design = _fitted(design, setback - _SNAP_ROOM, behind, gap - _SNAP_ROOM)
    left = x0 + gap
    access = None if plot.access is None else float((plot.access - start) @ along)
    if rules.style == "row" and access is not None:
        design = replace(design, entrance=access - left)
    left = _left_end(design, (left, left + max(width - design.outer_width, 0.0)), access, place)
    origin = start + left * along + (y0 + setback) * into
    walls = _outline(design, origin, along, (0.0, 0.0, 0.0))
    bay = design.extras.bay.depth if design.extras.bay else 0.0
    over = design.overhang
    back = max(over, BALCONY_DEPTH if design.extras.balconies else 0.0)
    reach = (max(over, bay), back, 0.0 if design.style == "row" else over)
    covered = _outline(design, origin, along, reach)
    if not shape.covers(covered):
        return None
    return _Plan(design, origin, along, walls, covered, setback)


def _fitted(design: Design, front: float, back: float, side: float) -> Design:
    """The design without what would stand out over the free room around it, metres."""
    free = min(front, back) if design.style == "row" else min(front, back, side)
    bay = design.extras.bay
    extras = replace(
        design.extras,
        bay=bay if bay is not None and bay.depth < front else None,
        balconies=design.extras.balconies and back > BALCONY_DEPTH,
        porch=design.extras.porch and front > PORCH_DEPTH,
    )
    return replace(design, overhang=_overhang(design.overhang, free), extras=extras)


def _within(limits: Range, share: float) -> float:
    return limits[0] + share * (limits[1] - limits[0])


def _overhang(wanted: float, free: float) -> float:
    """As far as there is room; a hand's breadth is not worth its faces."""
    return min(wanted, free) if min(wanted, free) >= LEAST_OVERHANG else 0.0


def _outline(
    design: Design, origin: FloatArray, along: FloatArray, reach: tuple[float, float, float]
) -> shapely.Polygon:
    """Rectangle around the walls and what stands out to the front, the back and the sides."""
    front, back, side = reach
    x0, x1, y0, y1 = -side, design.outer_width + side, -front, design.depth + back
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    into = np.array([-along[1], along[0]])
    return shapely.Polygon(origin + corners @ np.stack([along, into]))


def _build(plot: Plot, plan: _Plan, scene: Scene) -> CityObject:
    corners = shapely.get_coordinates(plan.footprint)[:4]
    lowest, highest = scene.ground.range_under(corners)
    before = (corners[0] + corners[1]) / 2 - np.array([-plan.along[1], plan.along[0]])
    street = float(scene.ground.heights(before[None])[0])
    site = Site(plan.origin, plan.along, lowest, highest, street, plan.room)
    return make_building(f"building_{plot.id}", plan.design, site, scene.modelling)

"""Places a building on every plot with enough room."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import shapely

from envgen_usd.city.buildings.building_design import STREET_BALCONY, Design
from envgen_usd.city.buildings.building_feature import make_building
from envgen_usd.city.buildings.building_shell import taken
from envgen_usd.city.buildings.design_draws import LEAST_OVERHANG, draw_design, tied
from envgen_usd.city.buildings.facades import Facade, lay_out
from envgen_usd.city.buildings.garages import garage_range
from envgen_usd.city.buildings.installations import BALCONY_DEPTH, PORCH_DEPTH
from envgen_usd.city.buildings.thematic_surfaces import Site
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.plots.enclosures import Enclosed, Gate
from envgen_usd.city.plots.given_buildings import chunk_of
from envgen_usd.city.plots.largest_rectangle import largest_rectangle
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.building_rules import BuildingRules
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.landuse import OPEN_USES, Plot
from envgen_usd.seeds import Draws

_LEAST_SIDE = 4.0
"""Least side length of a building, metres; a larger value leaves more plots empty."""
_GARAGE_WALLS = 0.4
_BESIDE_SHOP = 0.4
"""Part of a shop's street side that its forecourt leaves out, metres: ways are wider by it."""
_SNAP_ROOM = 0.002
"""Distance by which snapping to the coordinate grid may move a corner, metres."""


@dataclass(frozen=True)
class Buildings:
    """The buildings of a chunk, and their footprints.

    Attributes:
        features: Buildings whose plots lie in the chunk.
        footprints: Wall outlines of buildings in and around the chunk, in plan.
        enclosed: Plots in the chunk with houses, for their enclosures.
        issues: Parts of the buildings without room, an issue for each kind of part.
    """

    features: tuple[CityObject, ...]
    footprints: tuple[shapely.Polygon, ...]
    enclosed: tuple[Enclosed, ...]
    issues: tuple[Issue, ...] = ()


@dataclass(frozen=True)
class PlannedBuilding:
    """A design with its position on a plot.

    Attributes:
        plot: The plot.
        design: Design of the building.
        origin: 2, left end of the street side, metres.
        along: 2, unit direction of the street side.
        footprint: Outline of the walls.
        covered: Outline including all projections.
        room: Free depth before the street side, metres.
    """

    plot: Plot
    design: Design
    origin: FloatArray
    along: FloatArray
    footprint: shapely.Polygon
    covered: shapely.Polygon
    room: float


def plan_buildings(
    scene: Scene, plots: Sequence[Plot], rules: BuildingRules
) -> tuple[PlannedBuilding, ...]:
    """Plans a building on each plot in and around a chunk.

    Each building stands in the largest rectangle of its plot parallel to the frontage, behind the
    setback. It is left out if it would touch the road or an existing object, or leave its plot. It
    also yields to the building of an overlapping plot with a smaller id, so all chunks decide
    alike.

    Args:
        scene: Scene of the chunk.
        plots: Plots in or near the chunk.
        rules: Ranges of the environment.
    """
    return tuple(_plans(scene, plots, rules))


def place_buildings(scene: Scene, planned: Sequence[PlannedBuilding]) -> Buildings:
    """Builds the planned buildings whose plots have their centroid in a chunk.

    Args:
        scene: Scene of the chunk.
        planned: Buildings as `plan_buildings` returns them.
    """
    features, footprints, enclosed = [], [], []
    left_out: dict[str, list[str]] = {}
    for planned_building in planned:
        footprints.append(planned_building.footprint)
        if chunk_of(shapely.Polygon(planned_building.plot.polygon)) == scene.chunk:
            building, lost = _build(planned_building, scene)
            features.append(building)
            for part in lost:
                left_out.setdefault(part, []).append(building.id)
            gates = _gates(planned_building)
            # Nothing stands between a shop and its street.
            if not planned_building.design.extras.fittings.shop:
                enclosed.append(Enclosed(planned_building.plot, planned_building.covered, gates))
    issues = (
        Issue(
            f"building.{part}_left_out",
            Severity.INFO,
            f"chunk[{scene.chunk.name}]/Building[{names[0]}]",
            f"{len(names)} of {len(features)} buildings have no room for all of their design:"
            f" {part.replace('_', ' ')}",
            "left out",
        )
        for part, names in sorted(left_out.items())
    )
    return Buildings(tuple(features), tuple(footprints), tuple(enclosed), tuple(issues))


def find_gates(planned: Sequence[PlannedBuilding]) -> tuple[Gate, ...]:
    """Returns the doors and gates of planned buildings."""
    return tuple(gate for building in planned for gate in _gates(building))


def _plans(scene: Scene, plots: Sequence[Plot], rules: BuildingRules) -> Iterator[PlannedBuilding]:
    """Yields the plots with their building plans."""
    plots = [plot for plot in plots if plot.landuse not in OPEN_USES]
    shapes = [shapely.Polygon(plot.polygon) for plot in plots]
    tree = shapely.STRtree(shapes)

    @cache
    def plan(index: int) -> PlannedBuilding | None:
        return _plan(plots[index], shapes[index], rules, scene.seed)

    for index, plot in enumerate(plots):
        planned_building = plan(index)
        if planned_building is None or _is_blocked(planned_building, scene):
            continue
        around = tree.query(shapes[index], predicate="intersects").tolist()
        rivals = [plan(i) for i in around if plots[i].id < plot.id]
        if not any(
            rival and planned_building.covered.intersects(rival.covered) for rival in rivals
        ):
            yield planned_building


def _is_blocked(plan: PlannedBuilding, scene: Scene) -> bool:
    return scene.road.touches(plan.covered) or scene.taken.touches(plan.covered)


def _gates(plan: PlannedBuilding) -> tuple[Gate, ...]:
    """Doors at the street, and the garage; a shop opens along its whole street side."""
    into = np.array([-plan.along[1], plan.along[0]])
    ground = float((plan.origin - plan.plot.frontage[0]) @ into)
    openings, design = _openings(plan.design), plan.design
    if design.extras.fittings.shop and design.style != "hall":
        openings.append((design.width / 2, design.main_front, design.width - _BESIDE_SHOP))
    gates = []
    for at, depth, width in openings:
        foot = plan.origin + at * plan.along - ground * into
        gates.append(Gate(foot + (ground + depth) * into, foot, width))
    return tuple(gates)


def _openings(design: Design) -> list[tuple[float, float, float]]:
    """The garage's gate and the doors.

    Each with its middle from the house's left end, its distance behind the building line, and its
    width, metres.
    """
    facade = Facade(design.width, design.storeys, True, taken(design))
    doors = [hole.box for hole in lay_out(design, facade) if hole.kind == "DoorSurface"]
    front = design.main_front
    openings = [((left + right) / 2, front, right - left) for left, _, right, _ in doors]
    if design.extras.garage:
        middle = design.garage_left + design.extras.garage / 2
        behind = garage_range(design)[0]
        openings.insert(0, (middle, behind, design.extras.garage - _GARAGE_WALLS))
    return openings


def _left_end(
    design: Design, free: tuple[float, float], access: float | None, share: float
) -> float:
    """Position of the house's left end on its plot, so that the paved way leads to a gate.

    Args:
        design: Design of the house.
        free: Least and largest position, metres.
        access: Point at which the way crosses the frontage, or `None`.
        share: Share of the free room to the left, without access.
    """
    low, high = free
    gates = _openings(design)
    if access is None or not gates:
        return low + share * (high - low)
    # The garage takes precedence; of several gates the nearest is used.
    wanted = [access - middle for middle, _, _ in gates]
    ends = [min(max(left, low), high) for left in wanted]
    if design.extras.garage:
        return ends[0]
    return min(zip(ends, wanted, strict=True), key=lambda pair: abs(pair[0] - pair[1]))[0]


def _plan(
    plot: Plot, shape: shapely.Polygon, rules: BuildingRules, seed: int
) -> PlannedBuilding | None:
    """The building of a plot, or `None` if it does not fit."""
    start, end = plot.frontage
    along = (end - start) / np.hypot(*(end - start))
    into = np.array([-along[1], along[0]])
    x0, y0, x1, y1 = largest_rectangle((plot.polygon - start) @ np.stack([along, into], axis=1))
    draws = tied(Draws(seed, "city", chunk_of(shape).name, plot.id), rules, x1 - x0)
    setback = draws.within("setback", rules.setback)
    if rules.style == "row":
        # Houses of a row share their building line, apart from a few centimetres.
        line = Draws(seed, "city", "row", plot.road, plot.side).within("setback", rules.setback)
        setback = 0.06 * setback + 0.94 * line
    setback = max(setback, _SNAP_ROOM)
    gap = max(draws.within("side setback", rules.side_setback), _SNAP_ROOM)
    width, depth = x1 - x0 - 2 * gap, y1 - y0 - setback - gap
    if min(width, depth) < _LEAST_SIDE:
        return None
    design = draw_design(rules, (width, depth), draws)
    behind = depth - design.depth + gap - _SNAP_ROOM
    design = _fitted(design, setback - _SNAP_ROOM, behind, gap - _SNAP_ROOM)
    left = x0 + gap
    access = None if plot.access is None else float((plot.access - start) @ along)
    if rules.style == "row" and access is not None:
        design = replace(design, entrance=access - left)
    free = (left, left + max(width - design.outer_width, 0.0))
    left = _left_end(design, free, access, draws.share("place along the street"))
    origin = start + left * along + (y0 + setback) * into
    walls = _outline(design, origin, along, (0.0, 0.0, 0.0))
    bay = design.extras.bay.depth if design.extras.bay else 0.0
    over = design.overhang
    back = max(over, BALCONY_DEPTH if design.extras.balconies else 0.0)
    reach = (max(over, bay), back, 0.0 if design.style == "row" else over)
    covered = _outline(design, origin, along, reach)
    if not shape.covers(covered):
        return None
    return PlannedBuilding(plot, design, origin, along, walls, covered, setback)


def _fitted(design: Design, front: float, back: float, side: float) -> Design:
    """The design without parts that exceed the free room around it, metres."""
    free = min(front, back) if design.style == "row" else min(front, back, side)
    bay = design.extras.bay
    extras = replace(
        design.extras,
        bay=bay if bay is not None and bay.depth < front else None,
        balconies=design.extras.balconies and back > BALCONY_DEPTH,
        porch=design.extras.porch and front > PORCH_DEPTH,
        fittings=replace(
            design.extras.fittings,
            balcony=design.extras.fittings.balcony and front > STREET_BALCONY,
        ),
    )
    return replace(design, overhang=_overhang(design.overhang, free), extras=extras)


def _overhang(wanted: float, free: float) -> float:
    """The overhang limited by the free room; a few centimetres are not worth their faces."""
    return min(wanted, free) if min(wanted, free) >= LEAST_OVERHANG else 0.0


def _outline(
    design: Design, origin: FloatArray, along: FloatArray, reach: tuple[float, float, float]
) -> shapely.Polygon:
    """Rectangle around the walls and the projections to the front, the back and the sides."""
    front, back, side = reach
    x0, x1, y0, y1 = -side, design.outer_width + side, -front, design.depth + back
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    into = np.array([-along[1], along[0]])
    return shapely.Polygon(origin + corners @ np.stack([along, into]))


def _build(plan: PlannedBuilding, scene: Scene) -> tuple[CityObject, tuple[str, ...]]:
    corners = shapely.get_coordinates(plan.footprint)[:4]
    lowest, highest = scene.ground.range_under(corners)
    before = (corners[0] + corners[1]) / 2 - np.array([-plan.along[1], plan.along[0]])
    street = float(scene.ground.heights(before[None])[0])
    site = Site(plan.origin, plan.along, lowest, highest, street, plan.room)
    return make_building(f"building_{plan.plot.id}", plan.design, site, scene.modelling)

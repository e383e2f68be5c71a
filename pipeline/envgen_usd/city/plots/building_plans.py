"""Plans a building on every plot with enough room, and another behind it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import shapely

from envgen_usd.city.buildings.building_design import STREET_BALCONY, Design
from envgen_usd.city.buildings.building_shell import taken
from envgen_usd.city.buildings.design_draws import LEAST_OVERHANG, draw_design, tied
from envgen_usd.city.buildings.facades import Facade, lay_out
from envgen_usd.city.buildings.garages import garage_range
from envgen_usd.city.buildings.installations import BALCONY_DEPTH, PORCH_DEPTH
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.plots.given_buildings import chunk_of
from envgen_usd.city.plots.largest_rectangle import largest_rectangle
from envgen_usd.city.plots.plot_frame import PlotFrame
from envgen_usd.city.plots.use_rules import AT_BACK, barn_rules, rules_behind, rules_of
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.building_rules import BuildingRules
from envgen_usd.models.landuse import OPEN_USES, Plot
from envgen_usd.seeds import Draws

_LEAST_SIDE = 4.0
"""Least side length of a building, metres; a larger value leaves more plots empty."""
_COURT = 7.0
"""Least depth of the court between a house and the building behind it, metres.

A larger value gives fewer back buildings.
"""
_AT_BORDER = 0.6
"""Distance of a back building from the back of its plot, metres."""
_GABLE_ROOM = 3.0
"""Distance to the next building from which a side wall may have windows, metres."""
_GABLE_END = 0.3
"""Distance from the ends of a side wall within which others do not count, metres."""
_GARAGE_WALLS = 0.4
_SNAP_ROOM = 0.002
"""Distance by which snapping to the coordinate grid may move a corner, metres."""


@dataclass(frozen=True)
class PlannedBuilding:
    """A design with its position on a plot.

    Attributes:
        name: Id of the building.
        plot: The plot.
        design: Design of the building.
        origin: 2, left end of the street side, metres.
        along: 2, unit direction of the street side.
        footprint: Outline of the walls.
        covered: Outline including all projections.
        room: Free depth before the street side, metres.
        is_behind: True for a building behind the house of its plot, which no way leads to.
    """

    name: str
    plot: Plot
    design: Design
    origin: FloatArray
    along: FloatArray
    footprint: shapely.Polygon
    covered: shapely.Polygon
    room: float
    is_behind: bool = False


def plan_buildings(
    scene: Scene, plots: Sequence[Plot], rules: BuildingRules
) -> tuple[PlannedBuilding, ...]:
    """Plans the buildings of each plot in and around a chunk.

    Each building stands in the largest rectangle of its plot parallel to the frontage, behind the
    setback. Another stands at the back of some plots (`BuildingDetails.back_buildings`). A building
    is left out if it would touch the road or an existing object, or leave its plot. It also yields
    to the building of an overlapping plot with a smaller id, so all chunks decide alike.

    Args:
        scene: Scene of the chunk.
        plots: Plots in or near the chunk.
        rules: Ranges of the environment.
    """
    return tuple(_plans(scene, plots, rules))


def _plans(scene: Scene, plots: Sequence[Plot], rules: BuildingRules) -> Iterator[PlannedBuilding]:
    """Yields the buildings of plots that have room beside those of other plots."""
    plots = [plot for plot in plots if plot.landuse not in OPEN_USES]
    shapes = [shapely.Polygon(plot.polygon) for plot in plots]
    tree = shapely.STRtree(shapes)

    @cache
    def plan(index: int) -> tuple[PlannedBuilding, ...]:
        return tuple(_of_plot(plots[index], shapes[index], rules, scene.seed))

    for index, plot in enumerate(plots):
        around = tree.query(shapes[index], predicate="intersects").tolist()
        rivals = [rival for i in around if plots[i].id < plot.id for rival in plan(i)]
        for building in plan(index):
            if _is_blocked(building, scene):
                continue
            if not any(building.covered.intersects(rival.covered) for rival in rivals):
                beside = tree.query(building.footprint, "dwithin", _GABLE_ROOM).tolist()
                others = [other.footprint for i in beside if i != index for other in plan(i)]
                yield _with_gables(building, others, rules, scene)


def _with_gables(
    building: PlannedBuilding,
    others: Sequence[shapely.Polygon],
    rules: BuildingRules,
    scene: Scene,
) -> PlannedBuilding:
    """A row house with windows in a share of the side walls that no building is beside."""
    design, share = building.design, rules.details.gable_windows
    if design.style != "row" or building.is_behind or not share:
        return building
    draws = Draws(scene.seed, "city", "gables", building.plot.id)
    into = np.array([-building.along[1], building.along[0]])
    gables = []
    for name, side, out in (("right", design.outer_width, 1.0), ("left", 0.0, -1.0)):
        ends = np.array([[side, _GABLE_END], [side, design.depth - _GABLE_END]])
        wall = building.origin + ends @ np.stack([building.along, into])
        beyond = wall[::-1] + out * _GABLE_ROOM * building.along
        room = shapely.Polygon([*(wall + out * _GABLE_END * building.along), *beyond])
        is_open = not shapely.intersects(room, others).any() and not scene.taken.touches(room)
        gables.append(is_open and draws.happens(name, share))
    return replace(building, design=replace(design, gables=(gables[0], gables[1])))


def _of_plot(
    plot: Plot, shape: shapely.Polygon, rules: BuildingRules, seed: int
) -> Iterator[PlannedBuilding]:
    """The building of a plot, and that behind it."""
    own = rules_of(rules, plot.landuse)
    frame = PlotFrame.of(plot)
    room = largest_rectangle(frame.inside(plot.polygon))
    main = _plan(plot, shape, own, room, seed)
    if main is None:
        return
    yield main
    behind = _plan_behind(main, shape, own, room, seed)
    if behind is not None:
        yield behind


def _is_blocked(plan: PlannedBuilding, scene: Scene) -> bool:
    return scene.road.touches(plan.covered) or scene.taken.touches(plan.covered)


def street_openings(design: Design) -> list[tuple[float, float, float]]:
    """The garage's gate and the doors of a building.

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
    gates = street_openings(design)
    if access is None or not gates:
        return low + share * (high - low)
    # The garage takes precedence; of several gates the nearest is used.
    wanted = [access - middle for middle, _, _ in gates]
    ends = [min(max(left, low), high) for left in wanted]
    if design.extras.garage:
        return ends[0]
    return min(zip(ends, wanted, strict=True), key=lambda pair: abs(pair[0] - pair[1]))[0]


def _plan(
    plot: Plot,
    shape: shapely.Polygon,
    rules: BuildingRules,
    room: tuple[float, float, float, float],
    seed: int,
) -> PlannedBuilding | None:
    """The building of a plot in a rectangle of its frame, or `None` if it does not fit."""
    frame = PlotFrame.of(plot)
    x0, y0, x1, y1 = room
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
    if plot.landuse in AT_BACK:
        setback += depth - design.depth
        depth = design.depth
    behind = depth - design.depth + gap - _SNAP_ROOM
    design = _fitted(design, setback - _SNAP_ROOM, behind, gap - _SNAP_ROOM)
    left = x0 + gap
    access = None if plot.access is None else float((plot.access - frame.start) @ frame.along)
    if rules.style == "row" and access is not None:
        design = replace(design, entrance=access - left)
    free = (left, left + max(width - design.outer_width, 0.0))
    left = _left_end(design, free, access, draws.share("place along the street"))
    origin = frame.place(left, y0 + setback)
    return _placed(f"building_{plot.id}", plot, shape, design, origin, setback)


def _plan_behind(
    main: PlannedBuilding,
    shape: shapely.Polygon,
    rules: BuildingRules,
    room: tuple[float, float, float, float],
    seed: int,
) -> PlannedBuilding | None:
    """The building at the back of a plot with a court between it and the house, or `None`."""
    plot, design = main.plot, main.design
    draws = Draws(seed, "city", "behind", plot.id)
    if design.style == "hall" or not draws.happens("exists", rules.details.back_buildings):
        return None
    frame = PlotFrame.of(plot)
    x0, _, x1, y1 = room
    side = max(rules.side_setback[0] / 2.0, _SNAP_ROOM)
    back = float(frame.inside(main.origin[None])[0, 1]) + design.depth
    width, depth = x1 - x0 - 2 * side, y1 - _AT_BORDER - back - _COURT
    if min(width, depth) < _LEAST_SIDE:
        return None
    is_barn = draws.happens("barn", rules.barns.share)
    behind = barn_rules(rules) if is_barn else rules_behind(rules)
    own = draw_design(behind, (width, depth), draws)
    own = _fitted(own, _COURT, _AT_BORDER - _SNAP_ROOM, side - _SNAP_ROOM)
    left = x0 + side + draws.share("place") * max(width - own.outer_width, 0.0)
    origin = frame.place(left, y1 - _AT_BORDER - own.depth)
    found = _placed(f"building_{plot.id}_back", plot, shape, own, origin, _COURT)
    return None if found is None else replace(found, is_behind=True)


def _placed(  # noqa: PLR0913, PLR0917 - what a building's place follows from
    name: str,
    plot: Plot,
    shape: shapely.Polygon,
    design: Design,
    origin: FloatArray,
    room: float,
) -> PlannedBuilding | None:
    """A design at its place, or `None` if it does not lie on its plot."""
    along = PlotFrame.of(plot).along
    walls = _outline(design, origin, along, (0.0, 0.0, 0.0))
    bay = design.extras.bay.depth if design.extras.bay else 0.0
    over = design.overhang
    back = max(over, BALCONY_DEPTH if design.extras.balconies else 0.0)
    reach = (max(over, bay), back, 0.0 if design.style == "row" else over)
    covered = _outline(design, origin, along, reach)
    if not shape.covers(covered):
        return None
    return PlannedBuilding(name, plot, design, origin, along, walls, covered, room)


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

"""A building on every plot that has room for one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import shapely

from envgen_usd.city.building import make_building
from envgen_usd.city.design import Design
from envgen_usd.city.draws import LEAST_OVERHANG, Draws, draw_design
from envgen_usd.city.enclosures import Enclosed
from envgen_usd.city.facade import Facade, lay_out
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
_SNAP_ROOM = 0.002
"""Metres that a corner may move when it is put on the grid of coordinates."""


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
    shapes = [shapely.Polygon(plot.polygon) for plot in plots]
    tree = shapely.STRtree(shapes)

    @cache
    def plan(index: int) -> _Plan | None:
        return _plan(plots[index], shapes[index], rules, scene.seed)

    features, footprints, enclosed = [], [], []
    for index, plot in enumerate(plots):
        own = plan(index)
        if own is None or _is_blocked(own, scene):
            continue
        around = tree.query(shapes[index], predicate="intersects").tolist()
        rivals = [plan(i) for i in around if plots[i].id < plot.id]
        if any(rival and own.covered.intersects(rival.covered) for rival in rivals):
            continue
        footprints.append(own.footprint)
        if chunk_of(shapes[index]) == scene.chunk:
            features.append(_build(plot, own, scene))
            enclosed.append(Enclosed(plot, own.covered, _gates(own)))
    return Buildings(tuple(features), tuple(footprints), tuple(enclosed))


def _is_blocked(plan: _Plan, scene: Scene) -> bool:
    return scene.road.touches(plan.covered) or scene.taken.touches(plan.covered)


def _gates(plan: _Plan) -> tuple[FloatArray, ...]:
    """Middles of the doors at the street, and of the garage."""
    design = plan.design
    facade = Facade(design.width, design.storeys, True, taken(design))
    doors = [hole.box for hole in lay_out(design, facade) if hole.kind == "DoorSurface"]
    middles = [(left + right) / 2 for left, _, right, _ in doors]
    if design.extras.garage:
        middles.append(design.garage_left + design.extras.garage / 2)
    return tuple(plan.origin + at * plan.along for at in middles)


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
    left = x0 + gap + max(width - design.outer_width, 0.0) * place
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

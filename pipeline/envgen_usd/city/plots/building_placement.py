"""Builds the planned buildings of a chunk, and the gates before them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.city.buildings.building_feature import make_building
from envgen_usd.city.buildings.thematic_surfaces import Site
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.plots.building_plans import PlannedBuilding, street_openings
from envgen_usd.city.plots.enclosed_plots import Enclosed, Gate
from envgen_usd.city.plots.given_buildings import chunk_of
from envgen_usd.city.plots.use_rules import UNFENCED
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.landuse import LanduseClass

_BESIDE_SHOP = 0.4
"""Part of a shop's street side that its forecourt leaves out, metres: ways are wider by it."""


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
            is_open = planned_building.design.extras.fittings.shop
            is_open |= planned_building.plot.landuse in UNFENCED
            if not is_open and not planned_building.is_behind:
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


def _gates(plan: PlannedBuilding) -> tuple[Gate, ...]:
    """Doors at the street, and the garage; a shop opens along its whole street side."""
    into = np.array([-plan.along[1], plan.along[0]])
    ground = float((plan.origin - plan.plot.frontage[0]) @ into)
    if plan.is_behind or plan.plot.landuse == LanduseClass.GARAGES:
        return ()
    openings, design = street_openings(plan.design), plan.design
    if design.extras.fittings.shop and design.style != "hall":
        openings.append((design.width / 2, design.main_front, design.width - _BESIDE_SHOP))
    gates = []
    for at, depth, width in openings:
        foot = plan.origin + at * plan.along - ground * into
        gates.append(Gate(foot + (ground + depth) * into, foot, width))
    return tuple(gates)


def _build(plan: PlannedBuilding, scene: Scene) -> tuple[CityObject, tuple[str, ...]]:
    corners = shapely.get_coordinates(plan.footprint)[:4]
    lowest, highest = scene.ground.range_under(corners)
    before = (corners[0] + corners[1]) / 2 - np.array([-plan.along[1], plan.along[0]])
    street = float(scene.ground.heights(before[None])[0])
    site = Site(plan.origin, plan.along, lowest, highest, street, plan.room)
    return make_building(plan.name, plan.design, site, scene.modelling)

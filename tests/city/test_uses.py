"""Buildings on whole plots with a use, and behind houses: judged by their outlines in plan."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.city.generate import build_city, plan_city
from envgen_usd.city.plots.plot_frame import PlotFrame
from envgen_usd.models.landuse import LanduseClass, Plot

CHUNK = Chunk(0, 0)
COURT = 7.0
"""Least distance between a house and the building behind it, metres."""


def wide_plot(use: LanduseClass) -> Plot:
    corners = np.array([[60.0, 112.0], [105.0, 112.0], [105.0, 142.0], [60.0, 142.0]])
    return Plot("wide", corners, use, corners[:2], "1", np.array([80.0, 112.0]), "left")


@pytest.fixture
def planned(make_map, by_place):
    """Function that plans the chunk with other plots, and builds its city."""
    scene = make_map("1", "residential")

    def plan(plots, details=None):
        rules = scene.profile.buildings
        rules = replace(rules, details=replace(rules.details, **(details or {})))
        profile = replace(scene.profile, buildings=rules)
        found = plan_city(CHUNK, plots, by_place, scene.heights[CHUNK], profile, 0)
        return found, build_city(found, scene.landuse[CHUNK], profile)

    return scene, plan


def test_back_buildings_leave_a_court_and_stay_on_their_plot(planned):
    scene, plan = planned
    found, _ = plan(scene.plots, {"back_buildings": 1.0})
    houses = {b.plot.id: b for b in found.buildings if not b.is_behind}
    behind = [b for b in found.buildings if b.is_behind]
    assert len(behind) > 3
    for building in behind:
        house = houses[building.plot.id]
        assert building.footprint.distance(house.footprint) >= COURT - 1e-6
        assert shapely.Polygon(building.plot.polygon).covers(building.covered)
        assert building.design.storeys <= 2
    none, _ = plan(scene.plots, {"back_buildings": 0.0})
    assert not any(building.is_behind for building in none.buildings)


@pytest.mark.parametrize("use", [LanduseClass.SHOP, LanduseClass.GARAGES])
def test_shops_and_garages_stand_at_the_back_of_their_plot(planned, use):
    plot = wide_plot(use)
    found, _ = planned[1]([plot])
    (building,) = found.buildings
    depths = PlotFrame.of(plot).inside(shapely.get_coordinates(building.footprint))[:, 1]
    assert 30.0 - depths.max() < 4.0
    assert depths.min() > 6.0


def test_a_row_of_garages_has_a_door_each_and_no_window(planned):
    _, city = planned[1]([wide_plot(LanduseClass.GARAGES)])
    (building,) = city.of_kind("Building")
    kinds = [o.kind for part in building.walk() for wall in part.surfaces for o in wall.openings]
    assert set(kinds) == {"DoorSurface"}
    assert len(kinds) >= 5
    assert building.attributes["function"] == "1630"


@pytest.mark.parametrize(("use", "is_enclosed"), [("PARK", True), ("SHOP", False)])
def test_parks_are_enclosed_and_shops_are_open(planned, use, is_enclosed):
    _, city = planned[1]([wide_plot(LanduseClass[use])])
    kinds = {
        part.id.split("_")[0]
        for kind in ("PlantCover", "CityFurniture")
        for part in city.of_kind(kind)
    }
    assert bool(kinds & {"hedge", "wall", "fence"}) == is_enclosed

"""Paved ways: from the street to every door, and houses that stand where a way leads."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from tests.environments import TABLE_A1

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.city.generate import build_city, pave_ways, plan_city
from envgen_usd.city.plots import building_plans
from envgen_usd.models.landuse import LanduseClass

ENVIRONMENTS = [*TABLE_A1, ("1", "city_centre")]
"""Houses of the city centre stand at the sidewalk, without land for a way."""
ROAD = (94.5, 103.62)
"""Borders of the road along x."""


def street_doors(building):
    """Middles of the doors of a building and its garage, in plan."""
    return [
        opening.polygons.points[:, :2].mean(axis=0)
        for part in building.walk()
        for wall in part.surfaces
        for opening in wall.openings
        if opening.kind == "DoorSurface"
    ]


@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_a_way_leads_from_the_road_to_every_door(make_map, by_place, country, area):
    scene = make_map(country, area)
    chunk = Chunk(0, 0)
    plan = plan_city(chunk, scene.plots, by_place, scene.heights[chunk], scene.profile, 0)
    paved = pave_ways(plan, scene.landuse[chunk])
    in_court = [b.is_behind or b.design.function == "garages" for b in plan.buildings]
    led_to = {b.name for b, inner in zip(plan.buildings, in_court, strict=True) if not inner}
    buildings = [b for b in scene.cities[0].of_kind("Building") if b.id in led_to]
    doors = [door for b in buildings for door in street_doors(b)]
    inside = [door for door in doors if 2.0 < door[0] < 198.0]
    assert len(inside) > 3
    for x, y in inside:
        near = ROAD[0] if y < 100.0 else ROAD[1]
        places = np.arange(min(y, near) + 0.5, max(y, near) - 0.5, 0.3)
        rows, column = (places / CELL_SIZE).astype(int), int(x / CELL_SIZE)
        found = paved.classes[rows, column]
        assert np.isin(found, (LanduseClass.ACCESS, LanduseClass.ROAD)).all()
    road = scene.landuse[chunk].classes == LanduseClass.ROAD
    assert (paved.classes[road] == LanduseClass.ROAD).all()
    assert (paved.plots == scene.landuse[chunk].plots).all()


def test_the_ground_before_a_shop_is_paved_along_its_front(make_map, by_place):
    """Nothing is lawn between the display windows of a shop and the road."""
    scene = make_map("1", "residential")
    details = replace(scene.profile.buildings.details, shops=1.0)
    profile = replace(scene.profile, buildings=replace(scene.profile.buildings, details=details))
    chunk = Chunk(0, 0)
    plan = plan_city(chunk, scene.plots, by_place, scene.heights[chunk], profile, 0)
    paved = pave_ways(plan, scene.landuse[chunk]).classes
    shops = [b for b in plan.buildings if b.design.extras.fittings.shop]
    assert len(shops) > 5
    for shop in shops:
        along = np.linspace(0.1, 0.9, 5)[:, None] * shop.design.width
        before = shop.origin + along * shop.along - 0.5 * np.array([-shop.along[1], shop.along[0]])
        inside = before[((before > 1.0) & (before < 199.0)).all(axis=1)]
        columns, rows = (inside / CELL_SIZE).astype(int).T
        assert np.isin(paved[rows, columns], (LanduseClass.ACCESS, LanduseClass.ROAD)).all()


def test_chunks_agree_on_a_way_over_their_border(make_map, by_place, chunks):
    """Ways along the border are the same whichever chunk paves them."""
    scene = make_map("2", "residential")
    one, two = (
        pave_ways(
            plan_city(c, scene.plots, by_place, scene.heights[c], scene.profile, 0),
            scene.landuse[c],
        )
        for c in chunks
    )
    assert ((one.classes == LanduseClass.ACCESS).any(axis=0)).any()
    before, after = one.classes[:, -1], two.classes[:, 0]
    assert np.mean((before == LanduseClass.ACCESS) != (after == LanduseClass.ACCESS)) < 0.05


@pytest.mark.parametrize("garages", [0.0, 1.0])
@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_houses_stand_where_the_way_crosses_the_frontage(
    make_map, by_place, country, area, garages
):
    """Houses that are narrow enough for it have a door, or the garage, at the way."""
    scene = make_map(country, area)
    share = 0.6 if garages else 0.4
    rules = scene.profile.buildings
    limit = {"row": 2.5, "detached": 0.5, "hall": 0.5}[rules.style]
    narrow = {"row": rules.width, "detached": (6.0, 7.0), "hall": (20.0, 24.0)}[rules.style]
    details = replace(rules.details, garages=garages, front_gable=0.0, back_buildings=0.0)
    profile = replace(scene.profile, buildings=replace(rules, width=narrow, details=details))
    chunk = Chunk(0, 0)
    plots = tuple(
        replace(p, access=p.frontage[0] + share * (p.frontage[1] - p.frontage[0]))
        for p in scene.plots
    )
    plan = plan_city(chunk, plots, by_place, scene.heights[chunk], profile, 0)
    city = build_city(plan, scene.landuse[chunk], profile)
    buildings = city.of_kind("Building")
    assert len(buildings) > 5
    for building in buildings:
        plot = next(p for p in plots if f"building_{p.id}" == building.id)
        assert min(abs(door[0] - plot.access[0]) for door in street_doors(building)) < limit


def test_a_building_is_planned_once_for_its_way_and_for_the_city(make_map, by_place, monkeypatch):
    """The ways of a chunk and its city come from one plan; nothing is drawn a second time."""
    scene, chunk, drawn = make_map("1", "residential"), Chunk(0, 0), Counter()
    draw = building_plans.draw_design

    def counted(rules, space, draws):
        drawn[space] += 1
        return draw(rules, space, draws)

    monkeypatch.setattr(building_plans, "draw_design", counted)
    plan = plan_city(chunk, scene.plots, by_place, scene.heights[chunk], scene.profile, 0)
    planned = drawn.total()
    assert planned >= len(plan.buildings) > 3
    landuse = pave_ways(plan, scene.landuse[chunk])
    assert build_city(plan, landuse, scene.profile).of_kind("Building")
    assert drawn.total() == planned

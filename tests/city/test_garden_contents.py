"""Terraces, sheds and clothes lines behind houses; parcels of allotments."""

from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.city.footprints import footprint_of
from envgen_usd.city.generate import build_city, plan_city
from envgen_usd.models.environment_profile import GardenRules
from envgen_usd.models.landuse import LanduseClass

KINDS = ("terrace", "shed", "clothes_line")


def cities_of(make_map, by_place, chunks, rules, *, country="2", landuse=None):
    """Plots and the city of each chunk."""
    scene = make_map(country, "residential")
    profile = replace(scene.profile, gardens=rules)
    plots = scene.plots
    if landuse is not None:
        plots = tuple(replace(plot, landuse=landuse) for plot in plots)
    for chunk in chunks:
        plan = plan_city(chunk, plots, by_place, scene.heights[chunk], profile, 0)
        city = build_city(plan, scene.landuse[chunk], profile, roads=False)
        yield {plot.id: plot for plot in plots}, city


def contents(city):
    """Objects in gardens with the id of their plot."""
    for thing in (*city.of_kind("CityFurniture"), *city.of_kind("SolitaryVegetationObject")):
        if "_garden_" in thing.id and thing.placement is not None:
            name = thing.id.removeprefix(f"{thing.placement.template}_")
            yield thing, name.rsplit("_garden_", 1)[0]


def test_what_stands_in_gardens_stands_behind_the_house_on_its_plot(make_map, by_place, chunks):
    found = dict.fromkeys(KINDS, 0)
    for plots, city in cities_of(make_map, by_place, chunks, GardenRules(0, 1, 1, 1)):
        houses = {house.id: footprint_of(house) for house in city.of_kind("Building")}
        for thing, name in contents(city):
            kind, shape = thing.placement.template, footprint_of(thing)
            house = houses[f"building_{name}"]
            found[kind] += 1
            assert shapely.Polygon(plots[name].polygon).covers(shape)
            assert not house.intersects(shape)
            # The road is at y = 100.
            away = abs(thing.placement.position[1] - 100.0)
            assert away > abs(house.centroid.y - 100.0)
            if kind == "terrace":
                assert house.distance(shape) < 0.6
    assert min(found.values()) > 3


def test_nothing_in_gardens_stands_on_anything(make_map, by_place, chunks):
    for _, city in cities_of(make_map, by_place, chunks, GardenRules(0.5, 1, 1, 1)):
        shapes = [footprint_of(thing) for thing, _ in contents(city)]
        pairs = shapely.STRtree(shapes).query(shapes, "intersects").T
        assert all(first == second for first, second in pairs)


def test_shares_of_gardens_are_those_of_the_environment(make_map, by_place, chunks):
    counts = []
    for share in (0.0, 0.5, 1.0):
        cities = cities_of(make_map, by_place, chunks, GardenRules(0, share, 0, 0))
        counts.append(sum(len(list(contents(city))) for _, city in cities))
    assert counts[0] == 0
    assert 0.25 < counts[1] / counts[2] < 0.75


def test_allotments_hold_beds_and_sheds_and_no_house(make_map, by_place, chunks):
    rules, kinds = GardenRules(allotments=True), []
    landuse = LanduseClass.ALLOTMENT
    for plots, city in cities_of(make_map, by_place, chunks, rules, landuse=landuse):
        assert not city.of_kind("Building")
        for thing, name in contents(city):
            kinds.append(thing.placement.template)
            place = shapely.Point(thing.placement.position[:2])
            assert shapely.Polygon(plots[name].polygon).contains(place)
    sheds, trees = (kinds.count(kind) for kind in ("shed", "tree"))
    assert sheds > 5
    assert trees > 0.6 * sheds
    assert kinds.count("flower_bed") > 3 * sheds


def test_houses_of_both_countries_have_gardens(make_map, by_place, chunks):
    for country in ("1", "2"):
        rules = make_map(country, "residential").profile.gardens
        cities = cities_of(make_map, by_place, chunks, rules, country=country)
        kinds = {thing.placement.template for _, city in cities for thing, _ in contents(city)}
        assert kinds >= {"terrace", "shed"}
        assert np.isfinite(rules.sheds)

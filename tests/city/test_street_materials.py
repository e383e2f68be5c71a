"""Streets and houses of an environment differ, and each street is one."""

import itertools
from collections import Counter, defaultdict

import pytest

from envgen_usd.city.roads.road_model import make_roads
from envgen_usd.city.roads.street_materials import street_materials
from envgen_usd.environment_files import read_profile
from envgen_usd.models.road_surface import Patch

PROFILE = read_profile("1", "residential")


def street(name, junction="", lane_type="driving"):
    return Patch(f"{name}_lane", "lane", lane_type, road=name, junction=junction)


def test_shares_of_materials_are_those_of_the_environment():
    """Of 2000 streets; three standard deviations of a share of one half are 0.034."""
    streets = [street_materials(street(str(n)), PROFILE.road, 5) for n in range(2000)]
    for drawn, weights in (
        (Counter(each.lanes for each in streets), PROFILE.road.materials),
        (Counter(each.sidewalk for each in streets), PROFILE.road.sidewalk_materials),
        (Counter(each.kerb for each in streets), PROFILE.road.kerb_materials),
    ):
        for name, weight in weights.items():
            expected = weight / sum(weights.values())
            assert drawn[name] / len(streets) == pytest.approx(expected, abs=0.035)


def test_a_junction_is_one_street_and_another_seed_gives_other_streets():
    look = PROFILE.road
    crossing = {street_materials(street(str(n), "4"), look, 5) for n in range(20)}
    assert len(crossing) == 1
    names = [str(n) for n in range(50)]
    first, other = ([street_materials(street(n), look, seed) for n in names] for seed in (5, 6))
    assert first != other


def test_a_road_has_one_sidewalk_in_all_chunks(by_place, chunks):
    found = defaultdict(set)
    for chunk in chunks:
        for top in make_roads(chunk, by_place, PROFILE, seed=3):
            for part in top.walk():
                for surface in part.surfaces:
                    facts = {**part.attributes, **surface.attributes}
                    key = facts.get("opendrive_road"), facts.get("opendrive_lane_type")
                    if surface.kind == "TrafficArea":
                        found[key].add(surface.material)
    roads = {road for road, _ in found}
    for road in roads:
        drawn = street_materials(street(str(road)), PROFILE.road, 3)
        assert found[road, "sidewalk"] == {drawn.sidewalk}
        assert found[road, "driving"] == {drawn.lanes}


@pytest.mark.parametrize(
    ("country", "area", "family"),
    [
        ("1", "residential", {"brick_red", "brick_orange"}),
        ("2", "residential", {"flagstone", "flagstone_grey", "flagstone_red"}),
        ("1", "industrial", {"sheet_metal", "sheet_metal_white", "sheet_metal_blue"}),
        ("2", "industrial", {"sheet_metal", "sheet_metal_white", "sheet_metal_blue"}),
    ],
)
def test_most_houses_are_of_the_material_of_the_article(country, area, family):
    """Table A1: red brick, flagstone, sheet metal; here as the majority, not as all."""
    weights = read_profile(country, area).buildings.materials
    share = sum(weights[name] for name in family) / sum(weights.values())
    assert 0.5 < share < 0.8
    assert len(weights) >= 6


def test_neighbours_differ(make_map):
    """A row of houses has several walls, and no house copies all of its neighbours."""
    walls = []
    for city in make_map("1", "residential").cities:
        for top in city.objects:
            if top.kind == "Building":
                shell = [s.material for s in top.surfaces if s.kind == "WallSurface"]
                walls.append(Counter(shell).most_common(1)[0][0])
    unlike = [one != other for one, other in itertools.pairwise(walls)]
    assert len(set(walls)) >= 4
    assert sum(unlike) / len(unlike) > 0.5

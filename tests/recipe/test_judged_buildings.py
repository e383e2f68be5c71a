"""Our buildings are valid for val3dity and for us, with their parts and installations."""

import json
import os
import subprocess

import numpy as np
import pytest

from envgen_usd.city.buildings.building_feature import make_building
from envgen_usd.city.buildings.design_draws import draw_design
from envgen_usd.city.buildings.thematic_surfaces import Site
from envgen_usd.citygml.write import write_city
from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.models.city_model import City
from envgen_usd.recipe.city_files import file_issues
from envgen_usd.seeds import Draws

JUDGE = os.environ.get("ENVGEN_VAL3DITY", "")
SPACES = {"row": (9.0, 14.0), "detached": (20.0, 18.0), "hall": (40.0, 30.0)}


@pytest.fixture(scope="module")
def city():
    """Turned buildings of all environments in LoD3.3; some have a garage."""
    buildings = []
    for country, areas in known_environments().items():
        for area in areas:
            rules = read_profile(country, area).buildings
            for number in range(6):
                design = draw_design(rules, SPACES[rules.style], Draws(0, "judge", number))
                turn, place = 0.4 + number, np.array([60.0 * len(buildings), 50.0])
                along = np.array([np.cos(turn), np.sin(turn)])
                site = Site(place, along, 1.0, 1.6, 1.3)
                buildings.append(make_building(f"b{len(buildings)}", design, site)[0])
    return City(tuple(buildings))


def test_we_find_no_fault_in_either_format(city, tmp_path):
    write_cityjson(city, tmp_path / "city.json")
    write_city(city, tmp_path / "city.gml")

    assert len([part for top in city.objects for part in top.children]) > 20
    for name in ("city.json", "city.gml"):
        assert file_issues(tmp_path / name, schema=False) == ()


@pytest.mark.skipif(not JUDGE, reason="val3dity is not built ($ENVGEN_VAL3DITY)")
def test_val3dity_finds_no_fault(city, tmp_path):
    write_cityjson(city, tmp_path / "city.json")
    report = tmp_path / "report.json"

    subprocess.run([JUDGE, tmp_path / "city.json", "--report", report], check=True)

    found = json.loads(report.read_text())
    faulty = [f["id"] for f in found["features"] if not f["validity"]]
    assert (found["all_errors"], faulty) == ([], [])
    assert found["validity"]

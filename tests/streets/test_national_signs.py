"""Signs of maps by the country of the environment, read back with the faces that they show."""

import pytest
from lxml import etree
from tests.places.places_extracts import Extract
from tests.streets.test_traffic_islands import ISLAND, STREET

from envgen_usd.recipe.build_options import LandOptions
from envgen_usd.recipe.mapped_place import read_mapped_place
from envgen_usd.step_clock import Clock


def signs_of(tmp_path, country):
    """Country and code of each sign of a crossing with a stop sign, an island and a mapped sign."""
    extract, street = Extract(), {"highway": "residential", "sidewalk": "both"}
    extract.way((-100.0, 0.0), (0.0, 0.0), (12.0, 0.0), (100.0, 0.0), **street)
    extract.way((0.0, -100.0), (0.0, 0.0), (0.0, 12.0), (0.0, 100.0), **street)
    extract.node(0.0, 12.0, highway="stop")
    extract.node(12.0, 0.0, highway="give_way")
    extract.node(-60.0, 6.0, traffic_sign="DE:205")
    extract.way((300.0, 0.0), (450.0, 0.0), (600.0, 0.0), **STREET)
    extract.node(450.0, 0.0, **ISLAND)
    options = LandOptions(
        tmp_path / "road.xodr", country, "residential", osm=extract.write(tmp_path / "place.osm"),
    )  # fmt: skip
    place = read_mapped_place(options, Clock(lambda *_: None))
    root = etree.fromstring(place.xodr)
    return [(each.get("country"), each.get("type")) for each in root.iter("signal")]


@pytest.mark.parametrize(
    ("country", "of", "island"),
    [("1", "DE", "222"), ("2", "US", "r4-7")],
)
def test_who_waits_and_where_to_pass_is_told_in_the_signs_of_the_country(
    tmp_path, country, of, island
):
    signs = signs_of(tmp_path, country)
    stop, wait = ("206", "205") if of == "DE" else ("r1-1", "r1-2")
    assert signs.count((of, stop)) == 1
    assert signs.count((of, island)) == 2
    mapped = ("DE", "205")
    assert sorted(signs) == sorted([(of, stop), (of, wait), *[(of, island)] * 2, mapped])

"""Every element of a map is counted once: as used, as unused, or as a mere place."""

from collections import Counter

import pytest
from lxml import etree
from tests.places.places_extracts import LAT, LON, crossing, degrees

from envgen_usd.compressed_files import open_content
from envgen_usd.landuse.osm_land_tags import has_landuse
from envgen_usd.places.map_elements import count_elements


def small_map(path):
    extract = crossing(100.0)
    ring = [(12, 12), (24, 12), (24, 22), (12, 22), (12, 12)]
    extract.way(*ring, building="house")
    extract.way(*[(x + 40, y) for x, y in ring], landuse="meadow")
    extract.way((-90, 30), (-20, 30), highway="track")
    extract.way((-90, 35), (-20, 35), barrier="hedge")
    extract.way((-90, 45), (-20, 45), landuse="meadow")
    extract.node(5.0, 8.0, natural="tree")
    extract.node(6.0, 9.0, shop="bakery")
    extract.node(7.0, 9.0, power="pole")
    extract.node(0.0, 0.0, highway="traffic_signals")
    extract.relation([("way", 1000, "")], type="route", route="bus")
    turn = [("way", 1000, "from"), ("node", extract.node(0.0, 0.0), "via"), ("way", 1001, "to")]
    extract.relation(turn, type="restriction", restriction="no_left_turn")
    return extract.write(path)


def test_elements_are_counted_by_what_follows_from_them(tmp_path):
    counts = count_elements(small_map(tmp_path / "map.osm"), has_landuse)
    assert counts.used == {
        "streets": 2,
        "buildings": 1,
        "landuse": 2,
        "barriers, rows of trees and railways": 1,
        "trees, lamps, furniture and gates": 1,
        "shops": 1,
        "crossings, signals and priority signs": 1,
        "restrictions": 1,
    }
    # An open way has no area.
    assert counts.unused == {"landuse=meadow": 1, "power=pole": 1, "route=bus": 1}
    assert counts.outside == 0
    used, unused = counts.issues("map.osm")
    assert (used.kind, unused.kind) == ("osm.elements", "osm.unused")
    assert "10 are used: 2 landuse" in used.message
    assert unused.message.startswith("from 3 elements nothing follows: 1 landuse=meadow")


def test_an_area_leaves_the_rest_outside(tmp_path):
    path = small_map(tmp_path / "map.osm")
    (south, west), (north, east) = degrees(-5.0, -5.0), degrees(30.0, 25.0)
    counts = count_elements(path, has_landuse, (west, south, east, north))
    assert west < LON
    assert south < LAT
    assert counts.used["buildings"] == 1
    assert "landuse" not in counts.used
    assert counts.unused == {"power=pole": 1, "route=bus": 1}
    assert counts.outside == 4


@pytest.mark.parametrize(
    "name", ["munich.osm.gz", "garching_intersection.osm", "clipped_multipolygon.osm"]
)
@pytest.mark.parametrize("bounds", [None, (11.546, 48.183, 11.552, 48.187)], ids=["all", "part"])
def test_no_element_of_a_real_extract_is_lost(shared, name, bounds):
    path = shared / "osm" / name
    if not path.is_file():
        pytest.skip(f"no {path}")
    with open_content(path) as file:
        tags = Counter(
            (element.tag, bool(len(element.findall("tag"))))
            for _, element in etree.iterparse(file, tag=("node", "way", "relation"))
        )
    counts = count_elements(path, has_landuse, bounds)
    assert counts.total == tags.total()
    assert counts.places == sum(count for (_, tagged), count in tags.items() if not tagged)
    rest = counts.outside + sum(counts.used.values()) + sum(counts.unused.values())
    assert counts.places + rest == counts.total

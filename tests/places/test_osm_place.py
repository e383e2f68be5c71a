"""Extracts of OpenStreetMap as places."""

import gzip

import numpy as np
import pytest
import shapely

from envgen_usd.errors import EnvgenError
from envgen_usd.places.building_figures import measure
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.places.osm_tags import LANE, SIDEWALK, STREETS
from envgen_usd.places.street_figures import measure_streets

METRE = 1 / 110_574.3
"""Degrees of latitude at the equator (WGS 84), and nearly of longitude."""
EAST = 1 / 111_319.5
HEAD = '<?xml version="1.0"?><osm version="0.6">'
HOUSE = [(0, 10), (12, 10), (12, 20), (0, 20), (0, 10)]


class Extract:
    """An extract that is being written."""

    def __init__(self):
        self.nodes, self.ways, self.relations = [], [], []

    def node(self, x, y, **tags):
        place = f'lat="{y * METRE:.9f}" lon="{x * EAST:.9f}"'
        number = len(self.nodes) + 1
        self.nodes.append(f'<node id="{number}" version="1" {place}>{self._tags(tags)}</node>')
        return number

    def way(self, points, tags, missing=0):
        refs = [self.node(*point) for point in points]
        if points[0] == points[-1]:
            refs[-1] = refs[0]
        refs += [10_000 + n for n in range(missing)]
        inside = "".join(f'<nd ref="{ref}"/>' for ref in refs) + self._tags(tags)
        number = len(self.ways) + 1
        self.ways.append(f'<way id="{number}" version="1">{inside}</way>')
        return number

    def relation(self, members, tags):
        inside = "".join(f'<member type="way" ref="{w}" role="{role}"/>' for w, role in members)
        inside += self._tags({"type": "multipolygon", **tags})
        self.relations.append(f'<relation id="9" version="1">{inside}</relation>')

    def _tags(self, tags):
        return "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())

    def text(self):
        return HEAD + "".join([*self.nodes, *self.ways, *self.relations]) + "</osm>"

    def read(self, folder):
        path = folder / "town.osm.gz"
        path.write_bytes(gzip.compress(self.text().encode()))
        return read_osm_place(path)


def test_buildings_have_their_size_and_tags(tmp_path):
    extract = Extract()
    extract.way(HOUSE, {"building": "house", "building:levels": "2", "height": "8,5 m"})
    shifted = [(x + 40, y) for x, y in HOUSE]
    tags = {"roof:shape": "half-hipped", "building:material": "brick", "roof:material": "slate"}
    extract.way(shifted, {"building": "yes", "building:levels": "many", **tags})
    extract.way([(0, 0), (60, 0)], {"highway": "residential"})
    houses = extract.read(tmp_path).houses
    np.testing.assert_allclose(shapely.area(houses.footprints), 120, rtol=1e-3)
    np.testing.assert_array_equal(houses.storeys, [2, np.nan])
    np.testing.assert_array_equal(houses.heights, [8.5, np.nan])
    assert houses.roofs.tolist() == ["", "hipped"]
    assert (houses.walls[1], houses.roofing[1]) == ("brick", "roof_slate")
    assert houses.landuse.tolist() == ["residential", ""]


def test_a_building_is_of_the_smallest_landuse_around_it(tmp_path):
    extract = Extract()
    for size, use in ((200, "industrial"), (60, "residential")):
        ring = [(-size, -size), (size, -size), (size, size), (-size, size), (-size, -size)]
        extract.way(ring, {"landuse": use})
    extract.way(HOUSE, {"building": "yes"})
    extract.way([(x + 100, y) for x, y in HOUSE], {"building": "yes"})
    extract.way([(x - 30, y) for x, y in HOUSE], {"building": "warehouse"})
    houses = extract.read(tmp_path).houses
    west_to_east = np.argsort(shapely.get_x(shapely.centroid(houses.footprints)))
    expected = ["industrial", "residential", "industrial"]
    assert houses.landuse[west_to_east].tolist() == expected


def test_a_courtyard_is_no_footprint(tmp_path):
    extract = Extract()
    outer = extract.way([(0, 0), (40, 0), (40, 30), (0, 30), (0, 0)], {})
    inner = extract.way([(10, 10), (30, 10), (30, 20), (10, 20), (10, 10)], {})
    extract.relation([(outer, "outer"), (inner, "inner")], {"building": "apartments"})
    figures = measure(extract.read(tmp_path))
    np.testing.assert_allclose(figures.area, [1200 - 200], rtol=1e-3)


@pytest.mark.parametrize(
    ("tags", "width"),
    [
        ({"width": "9 m"}, 9.0),
        ({"lanes": "4"}, 4 * LANE),
        ({"width": "wide"}, STREETS["tertiary"]),
        ({"width": "900"}, STREETS["tertiary"]),
    ],
)
def test_a_street_is_as_wide_as_tagged(tmp_path, tags, width):
    extract = Extract()
    extract.way(HOUSE, {"building": "yes"})
    extract.way([(-50, 0), (50, 0)], {"highway": "tertiary", **tags})
    extract.way([(-50, 5), (50, 5)], {"highway": "footway"})
    place = extract.read(tmp_path)
    assert place.streets.widths.tolist() == [width]
    figures = measure(place)
    assert figures.setback[0] == pytest.approx(10 - width / 2, abs=0.02)


def test_rows_beside_streets_have_their_spacing(tmp_path):
    extract = Extract()
    extract.way(HOUSE, {"building": "yes"})
    tags = {"highway": "residential", "width": "6", "lanes": "2", "sidewalk": "both"}
    extract.way([(-50, 0), (150, 0)], tags)
    extract.way([(-1, 9), (13, 9)], {"barrier": "hedge"})
    for number in range(5):
        extract.node(12 * number, 4.5, natural="tree")
        extract.node(30 * number, -4.5, highway="street_lamp")
    extract.node(6, 60, natural="tree")
    figures = measure_streets(extract.read(tmp_path))
    np.testing.assert_allclose(figures.tree_spacing, [12] * 4, rtol=1e-3)
    np.testing.assert_allclose(figures.lamp_spacing, [30] * 4, rtol=1e-3)
    assert figures.enclosures == ("hedge",)
    assert figures.lane_width.tolist() == [3.0]
    assert figures.sidewalk_width.tolist() == [SIDEWALK]


def test_what_a_clipped_extract_lacks_is_counted(tmp_path):
    extract = Extract()
    extract.way(HOUSE, {"building": "yes"})
    extract.way([(x + 40, y) for x, y in HOUSE[:-1]], {"building": "yes"}, missing=2)
    extract.way([(-50, 0), (50, 0)], {"highway": "residential"}, missing=1)
    part = extract.way(HOUSE[:3], {})
    extract.relation([(part, "outer"), (77, "outer")], {"building": "yes"})
    place = extract.read(tmp_path)
    assert len(place.houses) == len(place.streets) == 1
    kinds = {issue.kind for issue in place.issues}
    assert kinds == {"osm.incomplete_building", "osm.incomplete_way"}


ENTITY = '<!DOCTYPE osm [<!ENTITY a "aaaa">]><osm version="0.6"><note>&a;</note></osm>'
NAN = HEAD + '<node id="1" version="1" lat="nan" lon="0"/></osm>'


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("nothing", "cannot be read as an OpenStreetMap extract"),
        (HEAD + "</osm>", "holds no building"),
        (HEAD + "<node", "cannot be read"),
        (ENTITY, "cannot be read"),
        (NAN, "cannot be read"),
    ],
)
def test_what_is_no_extract_is_refused(tmp_path, text, fault):
    path = tmp_path / "town.osm"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(EnvgenError, match=f"town.osm: .*{fault}"):
        read_osm_place(path)
    with pytest.raises(EnvgenError, match="no such file"):
        read_osm_place(tmp_path / "other.osm")

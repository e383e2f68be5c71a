"""Squares of a map: paved, a plot each, with what the map has and no other landmark."""

from collections import Counter

import numpy as np
import pytest
import shapely
from tests.kept_work import kept
from tests.places.places_extracts import crossing

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.citygml.read import read_city
from envgen_usd.landuse.landuse_geotiff import read_landuse_map
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build

CORNERS = [(12.0, 12.0), (36.0, 12.0), (36.0, 36.0), (12.0, 36.0), (12.0, 12.0)]


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    return kept(tmp_path_factory, "mapped_squares", built)


def built(folder):
    extract = crossing(40.0)
    extract.way(*CORNERS, place="square")
    extract.node(22.0, 22.0, amenity="fountain")
    extract.node(17.0, 30.0, amenity="bench")
    out = folder / "out"
    build(
        BuildOptions(
            road=out / "road.xodr",
            country="1",
            area="residential",
            out=out,
            osm=extract.write(folder / "town.osm"),
            workers=1,
            actors=False,
            metadata_only=True,
        )
    )
    return out


def test_its_ground_is_paved_and_one_plot(town):
    maps = [read_landuse_map(path) for path in town.glob("chunks/*/landuse.tif")]
    cells = [(m.classes == LanduseClass.SQUARE, m.plots) for m in maps]
    area = sum(np.count_nonzero(square) for square, _ in cells) * CELL_SIZE**2
    assert area == pytest.approx(24.0**2, rel=0.05)
    assert set(np.concatenate([plots[square] for square, plots in cells])) == {1}


def test_it_has_the_fountain_and_the_bench_of_the_map_and_lamps_beside_them(town):
    cities = [read_city(path) for path in sorted(town.glob("chunks/*/city.gml"))]
    inside = shapely.Polygon(CORNERS)
    placed = [f.placement for city in cities for f in city.objects if f.placement is not None]
    on_it = Counter(p.template for p in placed if shapely.contains_xy(inside, *p.position[:2]))
    assert on_it["fountain"] == on_it["bench"] == 1
    assert on_it["street_light"] >= 2
    assert on_it["street_tree"] == on_it["tree_pit"] >= 3
    [fountain] = [p for p in placed if p.template == "fountain"]
    assert fountain.position[:2] == pytest.approx((22.0, 22.0), abs=0.3)

"""Gardens between the houses of a map: enclosures, gates, ways and what the map decides itself."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from tests.kept_work import kept
from tests.places.places_extracts import crossing

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.city.footprints import footprint_of
from envgen_usd.citygml.read import read_city
from envgen_usd.landuse.landuse_geotiff import read_landuse_map
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build
from envgen_usd.recipe.map_land import read_road

KINDS = ("hedge", "fence", "wall", "gate")
HOUSES = [shapely.box(x, y, x + 10.0, y + 9.0) for x in (14.0, 34.0, 54.0) for y in (16.0, -25.0)]
GARAGE = shapely.box(66.0, 16.0, 69.0, 22.0)
"""Beside the last house north of the street, in its plot."""
FLATS = shapely.box(-40.0, 14.0, -16.0, 26.0)
SHOP = shapely.box(-40.0, -30.0, -16.0, -14.0)
PATH = [(0.0, -38.0), (80.0, -38.0)]
"""Behind the houses south of the street, from street to street."""
FENCED = shapely.box(30.0, 9.0, 48.0, 40.0)
"""A fence of the map around the middle house north of the street."""


def ring(shape):
    return [(float(x), float(y)) for x, y in shape.exterior.coords]


def town(path):
    extract = crossing(80.0)
    for house in HOUSES:
        extract.way(*ring(house), building="house", building__levels="2")
    extract.way(*ring(GARAGE), building="garage")
    extract.way(*ring(FLATS), building="apartments", building__levels="6")
    extract.way(*ring(SHOP), building="retail", building__levels="1")
    extract.way(*PATH, highway="footway")
    extract.way((80.0, -38.0), (80.0, 0.0), highway="footway")
    extract.way(*ring(FENCED), barrier="fence")
    return extract.write(path)


def built(folder, **values):
    out = folder / "out"
    options = BuildOptions(
        road=out / "road.xodr", country="1", area="residential", out=out,
        osm=town(folder / "town.osm"), workers=1, actors=False, metadata_only=True,
    )  # fmt: skip
    result = build(replace(options, **values))
    cities = [read_city(path) for path in sorted(out.glob("chunks/*/city.gml"))]
    return out, result, [feature for city in cities for feature in city.objects]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return kept(tmp_path_factory, "mapped_gardens", built)


def enclosures(features):
    """Footprint of each piece of a generated enclosure."""
    made = [f for f in features if f.id.split("_")[0] in KINDS and "_plot_" in f.id]
    return {feature.id: footprint_of(feature) for feature in made}


def plots_of(out):
    """Cells of plots, and classes, over the whole map by place."""
    maps = [read_landuse_map(path) for path in sorted(out.glob("chunks/*/landuse.tif"))]
    places = []
    for each in maps:
        x, y = np.meshgrid(*each.chunk.cell_centres())
        places.append(
            np.column_stack([x.ravel(), y.ravel(), each.classes.ravel(), each.plots.ravel()])
        )
    return np.concatenate(places)


def test_each_house_stands_on_a_plot_of_its_own_and_a_shop_has_none(place):
    out, _, _ = place
    x, y, _, number = plots_of(out).T

    def on(shape):
        own = number[shapely.contains_xy(shape, x, y)]
        return set(own.tolist())

    of_houses = [on(house) for house in (*HOUSES, FLATS)]
    assert all(len(found) == 1 and found != {0.0} for found in of_houses)
    assert len(set.union(*of_houses)) == len(of_houses)
    assert on(SHOP) == {0.0}
    assert on(GARAGE) == of_houses[4]
    # Houses stand 10 m apart: the border is 5 m from either.
    between = (np.abs(y - 20.0) < 3.0) & (number == next(iter(of_houses[0])))
    assert x[between].max() == pytest.approx(29.0, abs=CELL_SIZE)


def test_enclosures_cross_neither_road_nor_path_nor_building(place):
    out, _, features = place
    _, surface = read_road(out / "road.xodr", 0.02)
    road = shapely.union_all(shapely.polygons(surface.vertices[surface.triangles][:, :, :2]))
    houses = [footprint_of(f) for f in features if f.kind == "Building"]
    path = shapely.buffer(shapely.LineString(PATH), 0.8)
    found = enclosures(features)
    assert sum(shape.area for shape in found.values()) > 10.0
    for shape in found.values():
        assert not shape.intersects(road)
        assert not shape.intersects(path)
        assert not any(shape.intersects(house) for house in houses)


def test_a_paved_way_leads_from_the_street_to_each_house_and_to_the_garage(place):
    """The enclosure is open there: only a gate may stand on the way."""
    out, _, features = place
    x, y, kind, _ = plots_of(out).T
    paved = kind == LanduseClass.ACCESS
    walls = [shape for name, shape in enclosures(features).items() if not name.startswith("gate")]
    doors = [
        opening.polygons.points.mean(axis=0)
        for feature in features
        if feature.kind == "Building"
        for part in feature.walk()
        for surface in part.surfaces
        for opening in surface.openings
        if opening.kind == "DoorSurface"
    ]
    # The first two stand at a corner and look at the other street.
    for house in HOUSES[2:]:
        front = 16.0 if house.bounds[1] > 0.0 else -16.0
        own = [d for d in doors if house.buffer(0.5).contains(shapely.Point(d[:2]))]
        # Doors of balconies are higher.
        at_street = [d[:2] for d in own if abs(d[1] - front) < 0.5 and d[2] < 2.0]
        assert at_street
        for door in at_street:
            before = shapely.LineString([door, (door[0], np.sign(front) * 6.0)])
            strip = before.buffer(0.4, cap_style="flat")
            inside = shapely.contains_xy(strip, x, y) & (np.abs(y) > 7.5)
            assert inside.any()
            assert paved[inside].mean() > 0.95
            assert not any(shape.intersects(before) for shape in walls)
    drive = shapely.box(66.5, 8.0, 68.5, 15.5)
    assert paved[shapely.contains_xy(drive, x, y)].mean() > 0.9
    assert not any(shape.intersects(drive) for shape in walls)


def test_what_the_map_has_is_not_generated_again(place):
    """The house in the fence of the map has no other enclosure; flats are open to the street."""
    _, result, features = place
    found = enclosures(features)
    within = FENCED.buffer(-1.0)
    assert not any(within.intersects(shape) for shape in found.values())
    front = shapely.box(*FLATS.buffer(8.0).bounds).intersection(shapely.box(-60, 0, 0, 13.5))
    assert not any(front.intersects(shape) for shape in found.values())
    (issue,) = [issue for issue in result.issues if issue.kind == "osm.plot"]
    assert issue.message.startswith("7 houses have plots")
    assert "1 are open towards streets" in issue.message
    assert "1 are enclosed by the map's barriers" in issue.message


def test_nothing_is_generated_between_houses_where_only_the_map_counts(tmp_path):
    out, result, features = built(tmp_path, fill="none")
    assert not enclosures(features)
    assert not any("_garden_" in f.id or f.id.startswith("flower_bed") for f in features)
    assert not [issue for issue in result.issues if issue.kind == "osm.plot"]
    x, y, kind, number = plots_of(out).T
    assert not number.any()
    # The map's footway is paved all the same.
    middle = shapely.contains_xy(shapely.box(20.0, -38.4, 60.0, -37.6), x, y)
    assert (kind[middle] == LanduseClass.ACCESS).all()

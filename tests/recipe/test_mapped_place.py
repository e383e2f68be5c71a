"""`build --osm`: a map becomes a road file, and the environment stands on it."""

import json
from dataclasses import replace

import numpy as np
import pytest
import shapely
from tests.places.places_extracts import crossing
from typer.testing import CliRunner

from envgen_usd.city.footprints import footprint_of
from envgen_usd.citygml.read import read_city
from envgen_usd.commands.command_line import app
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.build_options import BuildOptions, LandOptions
from envgen_usd.recipe.environment_build import build
from envgen_usd.recipe.map_land import lay_out_land, read_road
from envgen_usd.recipe.mapped_place import read_mapped_place
from envgen_usd.step_clock import Clock
from envgen_usd.traffic.standing.kerb_lines import kerb_lines
from envgen_usd.traffic.standing.street_facts import StreetFacts


def small_town(path):
    """Four short streets, a house, and a park."""
    extract = crossing(40.0)
    corners = [(12.0, 12.0), (24.0, 12.0), (24.0, 22.0), (12.0, 22.0), (12.0, 12.0)]
    extract.way(*corners, building="house", building__levels="2", roof__shape="gabled")
    away = [(1900.0, 12.0), (1912.0, 12.0), (1912.0, 22.0), (1900.0, 22.0), (1900.0, 12.0)]
    extract.way(*away, building="house")
    park = [(-35.0, -35.0), (-12.0, -35.0), (-12.0, -12.0), (-35.0, -12.0), (-35.0, -35.0)]
    extract.way(*park, leisure="park")
    return extract.write(path)


def options(folder, **values):
    osm = small_town(folder / "town.osm")
    out = folder / "out"
    return BuildOptions(
        road=out / "road.xodr", country="1", area="residential", out=out, osm=osm, workers=1,
        actors=False, metadata_only=True, **values,
    )  # fmt: skip


def _clock():
    return Clock(lambda *_: None)


def test_a_map_becomes_an_environment_and_is_kept(tmp_path):
    chosen = options(tmp_path)
    result = build(chosen)
    _, surface = read_road(tmp_path / "out" / "road.xodr", 0.02)
    road = shapely.union_all(shapely.polygons(surface.vertices[surface.triangles][:, :, :2]))
    cities = [read_city(path) for path in sorted((tmp_path / "out").glob("chunks/*/city.gml"))]
    houses = [house for city in cities for house in city.of_kind("Building")]
    assert len(houses) == 1
    plan = footprint_of(houses[0])
    assert not plan.intersects(road)
    assert shapely.buffer(shapely.box(12, 12, 24, 22), 0.7).covers(plan)
    assert plan.buffer(0.1).covers(shapely.box(12, 12, 24, 22))
    issues = {issue.kind: issue.message for issue in result.issues}
    assert issues["osm.building_beyond"].startswith("1 buildings lie beyond")
    assert "are used: 2 buildings, 2 streets, 1 landuse" in issues["osm.elements"]
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert list(manifest["hashes"]["osm"]) == ["town.osm"]
    assert manifest["inputs"]["osm"] == "town.osm"
    again = build(chosen)
    assert (again.built, again.kept) == (0, result.built)


def test_a_city_model_of_the_place_replaces_only_its_own_buildings(tmp_path):
    """The model is that of a build of the map, in a reference system of its own."""
    first = build(options(tmp_path))
    (model,) = [
        path
        for path in sorted(tmp_path.glob("out/chunks/*/city.gml"))
        if read_city(path).of_kind("Building")
    ]
    kept = tmp_path / "model.gml"
    kept.write_bytes(model.read_bytes())
    extract = crossing(40.0)
    corners = [(12.0, 12.0), (24.0, 12.0), (24.0, 22.0), (12.0, 22.0), (12.0, 12.0)]
    extract.way(*corners, building="house", building__levels="5")
    other = [(-30.0, 12.0), (-15.0, 12.0), (-15.0, 22.0), (-30.0, 22.0), (-30.0, 12.0)]
    extract.way(*other, building="house", building__levels="1")
    osm = extract.write(tmp_path / "two.osm")
    again = build(replace(options(tmp_path), osm=osm, city=kept, out=tmp_path / "again"))
    cities = [read_city(path) for path in sorted(tmp_path.glob("again/chunks/*/city.gml"))]
    houses = [house for city in cities for house in city.of_kind("Building")]
    storeys = sorted(int(house.attributes["storeysAboveGround"]) for house in houses)
    # The model's house has two storeys, that of the map beside it one.
    assert storeys == [1, 2]
    (issue,) = [issue for issue in again.issues if issue.kind == "osm.building_replaced"]
    assert issue.message.startswith("1 of 2 buildings")
    assert first.counts["Building"] == 1


def test_signs_lamps_and_trees_of_the_map_stand_where_it_has_them(tmp_path):
    extract = crossing(60.0)
    extract.node(5.0, 20.0, traffic_sign="DE:274[30]")
    for y in (12.0, 24.0, 36.0, 48.0):
        extract.node(14.0, y, highway="street_lamp")
        extract.node(-14.0, y, natural="tree")
    extract.way((20.0, 14.0), (20.0, 50.0), barrier="fence")
    osm = extract.write(tmp_path / "lamps.osm")
    result = build(replace(options(tmp_path), osm=osm, fill="missing"))
    cities = [read_city(path) for path in sorted(tmp_path.glob("out/chunks/*/city.gml"))]
    placed = [f for city in cities for f in city.walk() if f.placement is not None]
    lamps = np.array(
        [f.placement.position for f in placed if f.placement.template == "street_light"]
    )
    own = {tuple(np.round(p, 0)) for p in lamps[:, :2].tolist()}
    # The street has lamps of the map, so that none are generated along it.
    along = [p for p in lamps if 10.0 < p[1] < 55.0 and abs(p[0]) < 20.0]
    assert len(along) == 4, own
    assert any(f.placement.template == "fence" for f in placed)
    signs = [f for f in placed if f.attributes.get("opendrive_type") == "274-30"]
    assert len(signs) == 1
    assert any(issue.kind == "osm.used" for issue in result.issues)


def test_road_and_map_exclude_each_other(tmp_path):
    arguments = ["--country", "1", "--area", "residential", "--out", str(tmp_path / "out")]
    osm = str(small_town(tmp_path / "town.osm"))
    found = CliRunner().invoke(app, ["build", osm, "--osm", osm, *arguments])
    assert isinstance(found.exception, EnvgenError)
    assert "exclude each other" in str(found.exception)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"bbox": (11.0, 48.0, 12.0)}, "give four numbers"),
        ({"bbox": (12.0, 48.0, 11.0, 49.0)}, "west has to be less"),
        ({"bbox": (float("nan"), 48.0, 11.0, 49.0)}, "give four numbers"),
        ({"bbox": (20.0, 48.0, 21.0, 49.0)}, "no street for motor vehicles within --bbox"),
        ({"max_area": 0.001}, "more than --max-area"),
        ({"fill": "some"}, "--fill some: unknown"),
    ],
)
def test_unusable_parts_of_a_map_are_refused_before_anything_is_written(tmp_path, values, message):
    with pytest.raises(EnvgenError, match=message):
        build(options(tmp_path, **values))
    assert not (tmp_path / "out").exists()


def test_an_area_without_its_border_is_an_issue(tmp_path):
    """A wood of which a cut extract lacks the ways."""
    osm, members = small_town(tmp_path / "cut.osm"), '<member type="way" ref="77" role="outer"/>'
    tags = '<tag k="type" v="multipolygon"/><tag k="natural" v="wood"/>'
    wood = f'<relation id="5" version="1">{members}{tags}</relation></osm>'
    osm.write_text(osm.read_text("utf-8").replace("</osm>", wood), "utf-8")
    chosen, clock = LandOptions(tmp_path / "road.xodr", "1", "residential", osm=osm), _clock()
    place = read_mapped_place(chosen, clock)
    chosen = replace(chosen, road=place.write_road(tmp_path))
    land = lay_out_land(chosen, read_profile("1", "residential"), clock, place)
    lost = [issue for issue in land.issues if issue.kind == "osm.incomplete_area"]
    assert [(issue.where, issue.action) for issue in lost] == [
        ("cut.osm: area 5", "areas left out")
    ]


def test_an_unusable_city_model_leaves_nothing_behind(tmp_path):
    model = tmp_path / "model.gml"
    model.write_text("<html/>")
    with pytest.raises(EnvgenError, match="not CityGML"):
        build(options(tmp_path, city=model))
    assert not (tmp_path / "out").exists()


def test_parking_lanes_of_a_map_hold_vehicles_between_their_tapers(tmp_path):
    """They narrow to nothing beside junctions, which is no width to park in."""
    tags = {"highway": "residential", "sidewalk": "both", "parking__both": "lane"}
    osm = crossing(100.0, **tags).write(tmp_path / "town.osm")
    place = read_mapped_place(
        LandOptions(tmp_path / "road.xodr", "1", "residential", osm=osm), _clock()
    )
    road, surface = read_road(place.write_road(tmp_path), 0.02)
    facts = StreetFacts.of(surface, road.network)
    lines = [line for line in kerb_lines(surface.lanes, facts) if line.kind == "parking_lane"]
    assert len(lines) == 8
    driven = {x.road: x for x in surface.lanes if x.lane_type == "driving" and not x.junction}
    for line in lines:
        assert line.width == pytest.approx(2.0, abs=0.1)
        ends = driven[line.lane.road].points[[0, -1]]
        # A street ends 9 m and a taper of 3 m behind its parking lane at the junction.
        whole = float(np.linalg.norm(ends[1] - ends[0]))
        assert whole - 24.5 < line.s[-1] < whole - 11.5

"""Objects of a map on the land, held against the map and the ground."""

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.city.footprints import footprint_of
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.mapped_objects import MapLand, make_mapped_objects
from envgen_usd.city.plots.railways import GAUGE
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.street_plan import MapLine, StreetPoint

PROFILE = read_profile("1", "residential")
SLOPE = 0.1
ROAD = np.array([[(0, 0), (200, 0), (200, 10)], [(0, 0), (200, 10), (0, 10)]], float)
HOUSE = shapely.box(100, 40, 120, 60)


def made(points=(), lines=(), gates=(), house=HOUSE):
    across = np.linspace(0.0, 200.0, 256)
    chunks = [Chunk(0, 0), Chunk(1, 0)]
    maps = [
        HeightMap(chunk, np.tile(SLOPE * (across + 200.0 * chunk.x), (256, 1))) for chunk in chunks
    ]
    land = MapLand(
        Ground(maps[0], maps[1:]), frozenset(chunks), ROAD, np.array([[150.0, 5.0]]), (house,)
    )
    return make_mapped_objects(points, lines, gates, land, PROFILE, 0, "map")


def at(kind, x, y):
    return StreetPoint(kind, np.array([x, y], float))


def test_points_stand_on_the_ground_where_the_map_has_them():
    points = [at("tree", 50, 80), at("lamp", 60, 30), at("bench", 150, 30)]
    found = {feature.id: feature for _, feature in made(points).objects}
    for point, feature in zip(points, found.values(), strict=True):
        x, y, z = feature.placement.position
        assert (x, y) == pytest.approx(point.place, abs=1e-3)
        assert z == pytest.approx(SLOPE * x, abs=1e-2)
    # The bench looks at the street to its south.
    assert found["map_bench_2"].placement.heading == pytest.approx(-np.pi / 2, abs=1e-5)


def test_what_stands_on_a_road_in_a_house_or_beyond_the_land_is_counted():
    points = [at("tree", 50, 5), at("bench", 110, 50), at("lamp", 900, 50), at("tree", 20, 20)]
    result = made(points)
    assert [feature.id for _, feature in result.objects] == ["map_tree_3"]
    said = sorted(issue.message.split(" lie ")[-1] for issue in result.issues)
    assert "on a road" in said
    assert "in a building" in said
    assert "beyond the land around the roads" in said
    (used,) = [issue for issue in result.issues if issue.kind == "osm.used"]
    assert used.message.endswith("trees: 1")


def test_a_crown_ends_at_the_wall():
    ((_, tree),) = made([at("tree", 122.0, 50.0)]).objects
    assert tree.attributes["crownDiameter"] <= 2 * 2.0 + 1e-6


@pytest.mark.parametrize("kind", ["hedge", "wall", "fence"])
def test_lines_follow_the_ground_and_leave_roads_houses_and_gates_free(kind):
    line = MapLine(kind, np.array([[30, 2], [30, 50], [140, 50]], float), 1.5)
    objects = [f for _, f in made(lines=[line], gates=[at("gate", 60, 50)]).objects]
    plan = shapely.union_all([footprint_of(feature) for feature in objects])
    assert shapely.buffer(shapely.LineString(line.line), 0.4).covers(plan)
    road = shapely.union_all(shapely.polygons(ROAD))
    assert not plan.intersects(road)
    assert not plan.intersects(HOUSE)
    assert not plan.intersects(shapely.Point(60, 50).buffer(1.2))
    # 40 m from the road to the corner, 70 and 20 m beside the house, 3 m less for the gate.
    assert plan.buffer(0.3).intersection(shapely.LineString(line.line)).length > 120.0
    for feature in objects:
        if feature.placement is not None:
            x, _, z = feature.placement.position
            assert z == pytest.approx(SLOPE * x, abs=0.02)
        else:
            points = np.concatenate([p.points for p in feature.geometry.values()])
            above = points[:, 2] - SLOPE * points[:, 0]
            assert above.max() == pytest.approx(1.5, abs=0.05)
            assert above.min() == pytest.approx(-0.2, abs=0.05)


def test_a_line_through_two_chunks_is_whole_and_belongs_to_both():
    line = MapLine("wall", np.array([[150, 100], [250, 100]], float), 1.0)
    objects = made(lines=[line]).objects
    assert {chunk for chunk, _ in objects} == {Chunk(0, 0), Chunk(1, 0)}
    plan = shapely.union_all([footprint_of(feature) for _, feature in objects])
    assert plan.buffer(1e-3).covers(shapely.LineString(line.line))


def test_rails_lie_on_sleepers_at_the_gauge_and_end_at_roads():
    line = MapLine("rail", np.array([[40, 2], [40, 90], [70, 140]], float))
    rails, sleepers = (f.geometry["lod2MultiSurface"] for _, f in made(lines=[line]).objects)
    for body in (rails, sleepers):
        # Two rails and many sleepers: several pieces are no fault of theirs.
        assert {fault.code for fault in find_faults(Bodies.of_solid(body))} == {305}
        road = shapely.union_all(shapely.polygons(ROAD))
        assert not shapely.MultiPoint(body.points[:, :2]).intersects(road)
    # Between the rails of a straight track is the gauge, everywhere.
    straight = rails.points[(rails.points[:, 1] > 20) & (rails.points[:, 1] < 80)]
    left, right = straight[straight[:, 0] < 40.0], straight[straight[:, 0] > 40.0]
    assert right[:, 0].min() - left[:, 0].max() == pytest.approx(GAUGE, abs=2e-3)
    # The track is 80 + 58.3 m long beyond the road, with a sleeper each 0.65 m.
    assert len(sleepers) / 6 == pytest.approx((80.0 + np.hypot(30, 50) - 0.15) / 0.65, abs=2)
    top = sleepers.points[:, 2].reshape(-1, 24).max(axis=1)
    middle = sleepers.points[:, 0].reshape(-1, 24).mean(axis=1)
    assert top - SLOPE * middle == pytest.approx(0.12, abs=2e-3)
    assert rails.points[:, 2].max() > top.max()

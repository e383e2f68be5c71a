"""Roads of the city: nothing of the surface is lost, cut or doubled."""

from collections import Counter

import numpy as np
import pytest

from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.city.roads.patch_polygons import patch_polygons
from envgen_usd.city.roads.road_model import make_roads
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.polygon_triangles import triangulate


@pytest.fixture(scope="module")
def roads(by_place, chunks):
    profile = read_profile("2", "residential")
    return [road for chunk in chunks for road in make_roads(chunk, by_place, profile)]


def areas(roads):
    """Area of each kind of surface, of every patch."""
    total = Counter()
    for road in roads:
        for part in road.walk():
            for surface in part.surfaces:
                points = surface.polygons.points[triangulate(surface.polygons)[0]]
                cross = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
                total[surface.kind] += np.linalg.norm(cross, axis=1).sum() / 2
    return total


def test_areas_are_those_of_the_road(roads):
    found = areas(roads)
    assert found["TrafficArea"] == pytest.approx(400 * (3.5 + 3.5 + 2.0))
    assert found["Marking"] == pytest.approx(400 * 0.12)
    assert found["AuxiliaryTrafficArea"] == pytest.approx(400 * 0.12)


def test_the_surface_stays_watertight(roads):
    """Every inner edge has its twin; what has none lies at the outside of the road."""
    edges = Counter()
    for road in roads:
        for part in road.walk():
            for surface in part.surfaces:
                points = list(map(tuple, surface.polygons.points.tolist()))
                for a, b, c in triangulate(surface.polygons)[0].tolist():
                    for one, two in ((a, b), (b, c), (c, a)):
                        edges[points[one], points[two]] += 1
    assert max(edges.values()) == 1
    alone = [edge for edge in edges if edge[::-1] not in edges]
    for one, two in alone:
        on_side = one[1] == two[1] and one[1] in (94.5, 103.62)
        at_end = one[0] == two[0] and one[0] in (0.0, 400.0)
        assert on_side or at_end


def test_ids_are_unique_and_relations_lead_somewhere(roads):
    spaces = {p.id: p for road in roads for p in road.walk()}
    ids = [p.id for road in roads for p in road.walk()]
    ids += [s.id for p in spaces.values() for s in p.surfaces]
    assert len(set(ids)) == len(ids)
    lane = "road_7_s0_lane_-1"
    one, two = spaces[f"{lane}_chunk_0_0"], spaces[f"{lane}_chunk_1_0"]
    assert one.relations["successor"] == (f"../1_0/city.gml#{two.id}",)
    assert two.relations["predecessor"] == (f"../0_0/city.gml#{one.id}",)
    assert one.relations["laneChangeRight"] == ("road_7_s0_lane_-2_chunk_0_0",)
    # The left lane runs the other way.
    back = spaces["road_7_s0_lane_1_chunk_1_0"]
    assert back.relations["successor"] == ("../0_0/city.gml#road_7_s0_lane_1_chunk_0_0",)


def test_centre_lines_are_cut_at_the_border(roads, surface):
    for lane in surface.lanes:
        pieces = [
            curve
            for road in roads
            for part in road.walk()
            if part.id.startswith(f"{lane.id}_chunk")
            for curve in part.curves["lod2MultiCurve"]
        ]
        ends = sorted(float(p) for curve in pieces for p in (curve[0, 0], curve[-1, 0]))
        assert ends == [0.0, 200.0, 200.0, 400.0]
        assert all(np.sign(np.diff(c[:, 0])[0]) == -np.sign(lane.lane) for c in pieces)


def test_meanings(roads):
    spaces = {p.id: p for road in roads for p in road.walk()}
    lane = spaces["road_7_s0_lane_-1_chunk_0_0"]
    assert lane.kind == "TrafficSpace"
    assert lane.attributes["speed"] == 13.9
    assert lane.attributes["opendrive_lane_type"] == "driving"
    assert lane.attributes["granularity"] == "lane"
    walk = spaces["road_7_s0_lane_-2_chunk_0_0"]
    assert walk.attributes["function"] == "2"
    assert walk.surfaces[0].material in read_profile("2", "residential").road.sidewalk_materials
    kerb = spaces["road_7_s0_kerb_-2_chunk_0_0"]
    assert kerb.kind == "AuxiliaryTrafficSpace"
    assert kerb.surfaces[0].attributes["opendrive_kind"] == "kerb"
    section = next(p for p in spaces.values() if p.kind == "Section")
    (mark,) = section.surfaces
    assert mark.kind == "Marking"
    assert mark.material == "marking_yellow"
    assert mark.attributes["class"] == "solid"


def test_flat_pieces_become_one_polygon_with_all_border_vertices():
    # A square ring of triangles around a hole, with a vertex in the middle of each outer side.
    x = [0.0, 1.0, 2.0, 3.0]
    grid = np.array([[a, b, 0.0] for b in x for a in x])
    cells = [(i, j) for j in range(3) for i in range(3) if (i, j) != (1, 1)]
    triangles = np.array(
        [t for i, j in cells for c in [4 * j + i] for t in ((c, c + 1, c + 5), (c, c + 5, c + 4))]
    )
    polygons = patch_polygons(grid, triangles)
    assert len(polygons) == 1
    exterior, hole = polygons.rings(0)
    assert {tuple(p) for p in exterior} == {
        tuple(p) for p in grid.tolist() if 0.0 in p[:2] or 3.0 in p[:2]
    }
    assert len(hole) == 4
    bent = grid.copy()
    bent[0, 2] = 0.5
    assert len(patch_polygons(bent, triangles)) == len(triangles)


def test_the_plan_of_a_road_is_all_its_triangles_but_those_without_area():
    corners = np.array([[(0, 0), (1, 0), (0, 1)], [(5, 5), (6, 5), (7, 5)]], dtype=float)
    for moved in (corners, corners[:, ::-1], corners + np.array([30, -20])):
        shift = moved[0].min(axis=0)
        points = np.array([(0.2, 0.2), (1.2, 0.0), (1.3, 1.3), (6.0, 5.0)]) + shift
        plan = RoadPlan(moved)
        assert plan.near(points, 0.0).tolist() == [True, False, False, False]
        assert plan.near(points, 0.25).tolist() == [True, True, False, False]

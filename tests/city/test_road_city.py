"""The whole road as a city: solids, lines, and relations that follow from places."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st
from lxml import etree

from envgen_usd.city.roads.area_solids import area_solids, connected_parts, strip_solid
from envgen_usd.city.roads.feature_relations import with_controls
from envgen_usd.city.roads.file_objects import file_object
from envgen_usd.city.roads.lane_codes import TRAFFIC_TYPES
from envgen_usd.city.roads.road_city import build_road_city
from envgen_usd.city.roads.space_solids import with_solids
from envgen_usd.city.roads.traffic_solids import lane_solid, raise_solid, strip_borders
from envgen_usd.city.roads.traffic_spaces import RoadDetail
from envgen_usd.citygml.city_validation import geometry_issues
from envgen_usd.citygml.write import write_city
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.models.road_feature import Pose, RoadFeature
from envgen_usd.models.road_objects import RoadObject
from envgen_usd.models.road_surface import LaneLine, Patch
from envgen_usd.recipe.map_land import read_road

GML_ID = "{http://www.opengis.net/gml}id"


def mesh_of(polygons):
    corners = polygons.points[triangulate(polygons)[0]].reshape(-1, 3)
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    return trimesh.Trimesh(vertices, index.reshape(-1, 3), process=False)


def sign(name, x, y, heading):
    """A sign that the file gives as an object, without the lanes for which it holds."""
    figures = dict.fromkeys(("heading", "pitch", "roll", "length", "width", "height", "radius"), 0)
    source = RoadObject(name, "-1", "", "Sign_Stop", x, y, 0, orientation="+", **figures)
    pose = Pose(np.array([x, y, 0.0]), heading)
    kind = "traffic_sign"
    return RoadFeature(id=name, road="7", source=source, kind=kind, template=kind, pose=pose)


@pytest.fixture(scope="module")
def city(surface):
    """The straight road with two signs, a crosswalk that ends at the sidewalk, and a junction."""
    start = len(surface.vertices)
    corners = np.array([[50.0, 96.5, 0.0], [54.0, 96.5, 0.0], [54.0, 103.5, 0.0], [50.0, 103.5, 0]])
    crosswalk = Patch("crosswalk_1", "crosswalk", "driving", road="7", section=0)
    inner = Patch("road_8_s0_lane_-1", "lane", "driving", "8", 0, -1, junction="5")
    beyond = np.array([[400.0, 96.5, 0.0], [410.0, 96.5, 0.0], [410.0, 100.0, 0.0]])
    way = LaneLine(inner.id, "8", 0, -1, "driving", "5", beyond[:2], np.full(2, 3.5))
    lanes = [replace(lane) for lane in surface.lanes]
    lanes[1] = replace(lanes[1], successors=(inner.id,))
    new = start + np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]])
    count = len(surface.patches)
    whole = replace(
        surface,
        vertices=np.concatenate([surface.vertices, corners, beyond]),
        triangles=np.concatenate([surface.triangles, new]),
        triangle_patch=np.append(surface.triangle_patch, [count, count, count + 1]),
        triangle_level=np.append(surface.triangle_level, [0, 0, 0]),
        patches=(*surface.patches, crosswalk, inner),
        lanes=(*lanes, way),
        # The first looks against the traffic of the right lane, the second of the left lane.
        features=(sign("one", 20.0, 94.0, np.pi), sign("two", 90.0, 104.0, 0.0)),
    )
    return build_road_city(whole, read_profile("1", "residential"))


def test_is_valid_and_names_are_those_of_the_lanes(city, tmp_path, shared):
    write_city(city, tmp_path / "roads.gml")
    schema = etree.XMLSchema(etree.parse(str(shared / "citygml-xsd" / "citygml-3.0.xsd")))
    assert schema.validate(etree.parse(str(tmp_path / "roads.gml"))), schema.error_log
    names = {space.id for space in city.of_kind("TrafficSpace")}
    assert {"road_7_s0_lane_1", "road_7_s0_lane_-1", "road_7_s0_lane_-2"} <= names


def generics(element):
    """Generic attributes of an element of CityGML 2.0."""
    return {
        each.get("name"): each.findtext("{*}value")
        for each in element
        if etree.QName(each).namespace.endswith("/generics/2.0")
    }


def test_version_2_tells_sections_spaces_relations_and_markings(city, tmp_path, citygml_schemas):
    """2.0 has no element for sections and spaces; areas name them in generic attributes."""
    path = tmp_path / "roads.gml"
    write_city(city, path, "2.0")
    schema = etree.XMLSchema(etree.parse(str(citygml_schemas / "citygml-2.0.xsd")))
    tree = etree.parse(str(path))
    assert schema.validate(tree), schema.error_log
    assert geometry_issues(path) == ()
    areas = [*tree.iter("{*}TrafficArea"), *tree.iter("{*}AuxiliaryTrafficArea")]
    facts = [generics(area) for area in areas]
    by_space = {each["space"]: each for each in facts if "space" in each}
    sections = {
        space.id: (section.id, section.kind)
        for section in city.of_kind("Section", "Intersection")
        for space in section.children
    }
    spaces = city.of_kind("TrafficSpace", "AuxiliaryTrafficSpace")
    assert by_space.keys() == {space.id for space in spaces}
    for space in spaces:
        told = by_space[space.id]
        assert (told["section"], told["section_class"]) == sections[space.id]
        assert told["space_class"] == space.kind
        assert told.get("trafficDirection") == space.attributes.get("trafficDirection")
        relations = {k.removeprefix("relation_"): v for k, v in told.items() if "relation_" in k}
        assert relations == {role: " ".join(ids) for role, ids in space.relations.items()}
    assert any("relation_successor" in each for each in facts)
    marks = [
        (each["marking_class"], area.findtext("{*}function"))
        for area, each in zip(areas, facts, strict=True)
        if each.get("citygml_class") == "Marking"
    ]
    assert marks == [("solid", "11")]
    junction = next(road for road in tree.iter("{*}Road") if "Junction" in road.get(GML_ID))
    assert generics(junction)["opendrive_junction"] == "5"
    assert len({area.get(GML_ID) for area in areas}) == len(areas)


def test_solids_are_closed_and_as_high_as_what_drives_or_walks_in_them(city):
    spaces = {space.id: space for space in city.of_kind("TrafficSpace")}
    for name, width, height in (("lane_-1", 3.5, 4.5), ("lane_-2", 2.0, 2.5)):
        mesh = mesh_of(spaces[f"road_7_s0_{name}"].geometry["lod2Solid"])
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume == pytest.approx(400 * width * height)


def test_a_solid_over_a_hole_and_over_triangles():
    ring = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]])
    hole = (ring / 4 + (1.0, 1.0, 0.0))[::-1]
    with_hole = Polygons(
        np.concatenate([ring, hole]), np.array([0, 4, 8]), np.array([0, 2], dtype=np.int64)
    )
    solid = mesh_of(raise_solid(with_hole, 2.0))
    assert solid.is_watertight
    assert solid.volume == pytest.approx(30.0)
    bent = ring + (0.0, 0.0, 1.0) * np.array([[0.0], [1.0], [0.0], [1.0]])
    loose = Polygons.of_triangles(bent, np.array([[0, 1, 2], [0, 2, 3]]))
    solid = mesh_of(raise_solid(loose, 2.0))
    assert solid.is_watertight
    assert solid.volume == pytest.approx(32.0)


def test_the_room_above_a_bend_and_above_a_lane_that_begins_in_a_point():
    turn = np.linspace(0.0, np.pi / 2, 40)
    bend = np.column_stack([8 * np.cos(turn), 8 * np.sin(turn), np.zeros(40)])
    solid = mesh_of(lane_solid(bend, np.full(40, 3.0), 4.5))
    assert solid.is_watertight
    assert solid.volume == pytest.approx(np.pi / 2 * 8 * 3 * 4.5, rel=1e-3)
    straight = np.column_stack([np.linspace(0, 30, 7), np.zeros(7), np.linspace(0, 3, 7)])
    solid = mesh_of(lane_solid(straight, np.linspace(0.0, 3.0, 7), 4.5))
    assert solid.is_watertight
    assert solid.volume == pytest.approx(30 * 3 / 2 * 4.5, rel=1e-3)
    # A lane that is wider than its bend crosses itself.
    assert lane_solid(bend / 8, np.full(40, 3.0), 4.5) is None


def test_the_room_above_a_lane_that_crosses_itself_is_that_above_its_area():
    """A strip of 3 m around a bend of 1 m: quarter discs of 2.5 m and, opposite, of 0.5 m."""
    turn = np.linspace(0.0, np.pi / 2, 80)
    bend = np.column_stack([np.cos(turn), np.sin(turn), np.full(80, 7.0)])
    solid = strip_solid(*strip_borders(bend, np.full(80, 3.0)), 4.5)
    assert mesh_of(solid).is_watertight
    area = np.pi / 4 * (2.5**2 + 0.5**2)
    assert mesh_of(solid).volume == pytest.approx(area * 4.5, rel=0.05)
    assert (solid.points[:, 2].min(), solid.points[:, 2].max()) == (7.0, 11.5)


def squares(*places):
    square = np.array([(0.0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)])
    return Polygons.of_rings([square + np.array((x, y, 0.0)) for x, y in places])


def test_areas_are_split_where_only_a_corner_connects_them():
    parts = connected_parts(squares((0, 0), (2, 0), (4, 2), (9, 9)))
    assert sorted(len(part) for part in parts) == [1, 1, 2]
    solids = area_solids(parts, [3.0] * 3)
    assert sorted(mesh_of(solid).volume for solid in solids) == pytest.approx([12, 12, 24])


def test_the_room_above_an_area_that_touches_itself_in_a_corner():
    """Eight squares around a hole; a hole and the border meet in a point."""
    around = [(0, 0), (2, 0), (4, 0), (0, 2), (4, 2), (0, 4), (2, 4)]
    (whole,) = connected_parts(squares(*around))
    (solid,) = area_solids([whole], [3.0])
    assert find_faults(Bodies.of_solid(solid)) == []
    assert mesh_of(solid).volume == pytest.approx(7 * 4 * 3, rel=0.02)


def space(name, *ring):
    facts = {"opendrive_kind": "transition", "opendrive_lane_type": "driving"}
    area = Polygons.of_rings([np.array([(x, y, 0.0) for x, y in ring])])
    surface = ThematicSurface(f"{name}_area", "TrafficArea", area, 2, attributes=facts)
    return CityObject(name, "TrafficSpace", facts, (surface,))


def test_an_area_of_a_millimetre_belongs_to_the_space_beside_it():
    """val3dity calls a solid over it 306: its sides are nearer than the tolerance."""
    spaces = [
        space("a", (0, 0), (5, 0), (5, 3), (0, 3)),
        space("gap", (5, 0), (5.001, 3), (5, 3)),
        space("b", (5, 0), (9, 0), (9, 3), (5.001, 3)),
    ]
    first, second = with_solids(spaces)
    assert (first.id, second.id) == ("a", "b")
    surfaces = [surface.id for surface in (*first.surfaces, *second.surfaces)]
    assert sorted(surfaces) == ["a_area", "b_area", "gap_area"]
    assert all(find_faults(Bodies.of_solid(each.geometry["lod2Solid"])) == [] for each in (first,))


def test_every_traffic_space_of_a_town_has_a_valid_solid(corpus, tmp_path, citygml_schemas):
    surface = read_road(corpus / "carla_test" / "Town01.xodr", 0.02)[1]
    town = build_road_city(surface, read_profile("1", "residential"), RoadDetail(solids=True))
    spaces = town.of_kind("TrafficSpace")
    assert len(spaces) > 300
    assert [each.id for each in spaces if "lod2Solid" not in each.geometry] == []
    area = sum(plan_area(s.polygons) for each in spaces for s in each.surfaces)
    kinds = np.array([patch.lane_type in TRAFFIC_TYPES for patch in surface.patches])
    kinds &= np.array([patch.kind not in {"mark", "kerb", "deck"} for patch in surface.patches])
    corners = surface.vertices[surface.triangles[kinds[surface.triangle_patch]]][..., :2]
    assert area == pytest.approx(shapely.area(shapely.polygons(corners)).sum(), rel=1e-6)
    path = tmp_path / "town.gml"
    write_city(town, path)
    schema = etree.XMLSchema(etree.parse(str(citygml_schemas / "citygml-3.0.xsd")))
    assert schema.validate(etree.parse(str(path))), schema.error_log
    assert geometry_issues(path) == ()


def plan_area(polygons):
    corners = polygons.points[triangulate(polygons)[0]][..., :2]
    return shapely.area(shapely.polygons(corners)).sum()


def test_signs_control_the_lanes_that_run_against_them(city):
    one, two = (thing.relations.get("controls") for thing in city.of_kind("CityFurniture"))
    assert one == ("road_7_s0_lane_-1",)
    assert two == ("road_7_s0_lane_1",)


def test_a_sign_controls_the_lane_beside_it_however_far_its_points_lie_apart():
    lanes = []
    for road, y, step in (("near", 0.0, 100.0), ("far", 3.5, 10.0)):
        x = np.arange(0.0, 101.0, step)
        line = np.column_stack([x, np.full_like(x, y), np.zeros_like(x)])
        lanes.append(LaneLine(road, road, 0, -1, "driving", "", line, np.full(len(x), 3.5)))
    signs = [file_object(sign("one", 50.0, -2.0, np.pi))]
    (found,) = with_controls(signs, lanes, lambda lane: [lane], str)
    assert found.relations["controls"] == ("near",)


def test_pedestrians_find_a_way_over_the_crosswalk(city):
    spaces = {space.id: space for space in city.of_kind("TrafficSpace")}
    walk, over = spaces["road_7_s0_lane_-2"], spaces["crosswalk_1"]
    assert over.attributes["function"] == "20"
    assert over.relations["successor"] == (walk.id,)
    assert over.id in walk.relations["successor"]
    assert over.id in walk.relations["predecessor"]


def test_roads_refer_to_the_intersections_that_they_lead_to(city):
    (crossing,) = city.of_kind("Intersection")
    road = next(top for top in city.objects if top.id == "Road_7")
    assert road.relations["intersection"] == (crossing.id,)
    (junction,) = [top for top in city.objects if crossing in top.children]
    assert junction.attributes == {"opendrive_junction": "5"}


def test_reference_lines_and_borders_are_logical_spaces(city):
    lines = {line.id: line for line in city.of_kind("GenericLogicalSpace")}
    (points,) = lines["ReferenceLine_7"].curves["lod2MultiCurve"]
    np.testing.assert_allclose(points[[0, -1]], [[0, 100, 0], [400, 100, 0]])
    (right,) = lines["road_7_s0_lane_-1_right_border"].curves["lod2MultiCurve"]
    np.testing.assert_allclose(right[:, 1], 96.5)


@example(turns=[0.0, 0.5, 0.5514745806648768], widths=[0.0, 0.0, 0.3125, *[0.0] * 10])
@given(
    turns=st.lists(st.floats(-0.6, 0.6), min_size=2, max_size=12),
    widths=st.lists(st.floats(0.0, 9.0), min_size=13, max_size=13),
)
@settings(max_examples=150)
def test_the_room_above_any_lane_is_a_valid_solid_or_none(turns, widths):
    heading = np.cumsum([0.0, *turns])
    steps = np.column_stack([np.cos(heading), np.sin(heading), np.zeros(len(heading))])
    line = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    width = np.array([*widths[: len(line) - 1], 0.0])
    for solid in (lane_solid(line, width, 4.5), strip_solid(*strip_borders(line, width), 4.5)):
        assert solid is None or find_faults(Bodies.of_solid(solid)) == []

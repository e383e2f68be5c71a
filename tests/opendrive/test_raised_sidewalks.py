"""Sidewalks of files without heights of lanes, and the stones of kerbs."""

import numpy as np
import pytest
import shapely

from envgen_usd.environment_files import read_profile
from envgen_usd.opendrive.geometry.raised_sidewalks import with_raised_sidewalks
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.recipe.map_land import read_road

WIDTH = '<width sOffset="0" a="{}" b="0" c="0" d="0"/>'
RAISED = '<height sOffset="0" inner="0.15" outer="0.15"/>'
LENGTH = 100.0


def lane(id_, type_="driving", width=3.5, more=""):
    return f'<lane id="{id_}" type="{type_}">{WIDTH.format(width)}{more}</lane>'


def section(left, right):
    middle = '<center><lane id="0" type="none"/></center>'
    return f'<laneSection s="0"><left>{left}</left>{middle}<right>{right}</right></laneSection>'


def street(more=""):
    right = lane(-1) + lane(-2, "sidewalk", 2, more) + lane(-3, "none", 1)
    return section(lane(2, "sidewalk", 1.5) + lane(1), right)


def areas(surface, *kinds):
    """Area in plan and in elevation of patches of some kinds, m²."""
    chosen = np.array([patch.kind in kinds for patch in surface.patches])[surface.triangle_patch]
    corners = surface.vertices[surface.triangles[chosen]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    plan = np.abs(normal[:, 2])
    return float(plan.sum()), float((np.linalg.norm(normal, axis=1) - plan).sum())


def heights(surface, lane_type):
    """Lowest and highest vertex of the areas of a lane type, without walls, metres."""
    chosen = [p.lane_type == lane_type and p.kind != "kerb" for p in surface.patches]
    corners = surface.vertices[surface.triangles[np.array(chosen)[surface.triangle_patch]]]
    return corners[..., 2].min(), corners[..., 2].max()


def test_sidewalks_without_heights_rise_with_what_is_outside(xodr_reader, assert_watertight):
    network = with_raised_sidewalks(xodr_reader(lanes=street()), 0.12)
    surface = build_surface(network)
    assert_watertight(surface)
    assert heights(surface, "driving") == (0.0, 0.0)
    assert heights(surface, "sidewalk") == pytest.approx((0.12, 0.12))
    assert heights(surface, "none") == pytest.approx((0.12, 0.12))
    (issue,) = [issue for issue in network.issues if issue.kind == "road.flat_sidewalks"]
    assert "1 roads have sidewalks" in issue.message
    assert "0.12 m" in issue.action


def test_a_kerb_has_a_face_and_stones(xodr_reader):
    surface = build_surface(with_raised_sidewalks(xodr_reader(lanes=street()), 0.12))
    plan, upright = areas(surface, "kerb")
    # Two kerbs along the carriageway; at their four ends the ground rises along the stones.
    assert plan == pytest.approx(0.0, abs=1e-6)
    assert upright == pytest.approx(2 * LENGTH * 0.12 + 4 * 0.15 * 0.12 / 2)
    assert areas(surface, "kerb_stone")[0] == pytest.approx(2 * LENGTH * 0.15)
    assert areas(surface, "kerb_stone", "lane")[0] == pytest.approx(LENGTH * (2 * 3.5 + 4.5))


def test_stones_lie_at_the_carriageway(xodr_reader):
    surface = build_surface(with_raised_sidewalks(xodr_reader(lanes=street()), 0.12))
    chosen = np.array([p.kind == "kerb_stone" for p in surface.patches])[surface.triangle_patch]
    stones = shapely.union_all(shapely.polygons(surface.vertices[surface.triangles[chosen], :2]))
    expected = shapely.union(shapely.box(0, 3.5, LENGTH, 3.65), shapely.box(0, -3.65, LENGTH, -3.5))
    assert shapely.symmetric_difference(stones, expected).area < 1e-6


@pytest.mark.parametrize(
    ("lanes", "height"),
    [
        (street(RAISED), 0.12),
        (street(), 0.0),
        (section(lane(1), lane(-1) + lane(-2, "none", 1)), 0.12),
    ],
    ids=["the file gives heights", "the environment has no kerbs", "no sidewalk"],
)
def test_other_networks_stay_as_they_are(xodr_reader, lanes, height):
    network = xodr_reader(lanes=lanes)
    assert with_raised_sidewalks(network, height) is network


def test_a_cycle_track_is_raised_behind_a_sidewalk_and_level_before_it(xodr_reader):
    left = lane(3, "sidewalk", 2) + lane(2, "biking", 1) + lane(1)
    right = lane(-1) + lane(-2, "sidewalk", 2) + lane(-3, "biking", 1)
    network = with_raised_sidewalks(xodr_reader(lanes=section(left, right)), 0.12)
    (road,) = network.roads.values()
    lanes = (*road.sections[0].left, *road.sections[0].right)
    raised = {one.id for one in lanes if (one.height[:, 1:] == 0.12).any()}
    assert raised == {3, -2, -3}


def test_every_kerb_of_a_town_has_stones_also_around_corners(corpus):
    """As long as the kerbs that they lie on; without corners they are a tenth shorter."""
    network = read_network(corpus / "carla_test" / "Town01.xodr")
    surface = build_surface(with_raised_sidewalks(network, 0.12))
    stones, kerbs = areas(surface, "kerb_stone")[0], areas(surface, "kerb")[1]
    assert stones / 0.15 == pytest.approx(kerbs / 0.12, rel=0.01)


def test_a_flat_sidewalk_has_no_stones(xodr_reader):
    assert areas(build_surface(xodr_reader(lanes=street())), "kerb", "kerb_stone") == (0.0, 0.0)


def test_an_environment_raises_sidewalks_of_a_file(write_xodr, road_xml, assert_watertight):
    path = write_xodr(road_xml(lanes=street()))
    look = read_profile("1", "residential").road
    _, surface = read_road(path, 0.02, look)
    assert_watertight(surface)
    assert heights(surface, "sidewalk") == pytest.approx((look.kerb_height, look.kerb_height))
    assert heights(build_surface(read_network(path)), "sidewalk") == (0.0, 0.0)

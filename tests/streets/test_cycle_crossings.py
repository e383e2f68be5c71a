"""Cycle lanes of a map that go straight on across junctions."""

import numpy as np
import pytest
import shapely
from tests.places.places_extracts import Extract, crossing
from tests.streets.lane_gaps import lane_gaps
from tests.streets.test_mapped_roads import roads_of

STREET = {"highway": "secondary", "sidewalk": "both", "lanes": "2", "cycleway": "lane"}
SIDE = {"highway": "residential", "sidewalk": "both"}


def crossing_of(first, second=None, side=SIDE):
    """A street of two ways that a side street crosses."""
    extract = Extract()
    extract.way((-100.0, 0.0), (0.0, 0.0), **first)
    extract.way((0.0, 0.0), (100.0, 0.0), **(second or first))
    extract.way((0.0, -100.0), (0.0, 0.0), (0.0, 100.0), **side)
    return extract


def turns_with_bicycles(root):
    """Kinds of lanes, from the middle outwards, of the connecting roads with a cycle lane."""
    roads = [road for road in root.findall("road") if road.get("junction") != "-1"]
    kinds = [[lane.get("type") for lane in road.iterfind(".//right/lane")] for road in roads]
    return [each for each in kinds if "biking" in each]


def test_cycle_lanes_go_straight_on_beside_the_outer_lane(tmp_path):
    """Lanes of both directions lie on the straight line from arm to arm, and meet these."""
    _, root, reading, surface = roads_of(crossing_of(STREET), tmp_path)
    assert not reading.network.issues
    assert turns_with_bicycles(root) == [["driving", "biking"]] * 2
    lanes = {lane.id: lane for lane in surface.lanes}
    bicycles = [lane for lane in surface.lanes if lane.lane_type == "biking"]
    inside = [lane for lane in bicycles if lane.junction]
    assert len(inside) == 2
    for lane in inside:
        (after,) = lane.successors
        assert lanes[after].lane_type == "biking"
        assert np.ptp(lane.points[:, 1]) < 0.01
    assert max(lane_gaps(surface)) < 0.01


def test_broken_lines_lead_bicycles_across(tmp_path):
    """Two lines of 0.25 m along each lane; dashes of 0.5 m have gaps of 0.25 m."""
    _, root, _, surface = roads_of(crossing_of(STREET), tmp_path)
    (length, other) = (
        float(road.get("length"))
        for road in root.findall("road")
        if road.get("junction") != "-1" and road.find(".//lane[@type='biking']") is not None
    )
    assert length == pytest.approx(other)
    patches = surface.patches
    junction = np.array([p.kind == "mark" and bool(p.junction) for p in patches])
    corners = surface.vertices[surface.triangles[junction[surface.triangle_patch]]][:, :, :2]
    dashes = np.ceil(length / 0.75)
    painted = shapely.area(shapely.polygons(corners)).sum()
    assert painted == pytest.approx(4 * dashes * 0.5 * 0.25, rel=0.05)


def test_a_cycle_lane_without_one_beyond_ends_at_the_junction(tmp_path):
    bare = {**STREET, "cycleway": "no"}
    _, root, _, _ = roads_of(crossing_of(STREET, bare), tmp_path)
    assert not turns_with_bicycles(root)


def test_a_cycle_lane_on_one_side_goes_on_in_its_direction_alone(tmp_path):
    right = {key: value for key, value in STREET.items() if key != "cycleway"}
    right |= {"cycleway:right": "lane"}
    _, root, reading, _ = roads_of(crossing_of(right), tmp_path)
    assert not reading.network.issues
    assert turns_with_bicycles(root) == [["driving", "biking"]]


def test_a_cycle_lane_beside_a_turning_lane_has_a_road_of_its_own(tmp_path):
    """The outer lane turns right, so the lane straight on does not lie beside the bicycles."""
    before = {**STREET, "lanes": "3", "lanes:forward": "2", "turn:lanes:forward": "through|right"}
    _, root, reading, surface = roads_of(crossing_of(before, STREET), tmp_path)
    assert not reading.network.issues
    assert sorted(turns_with_bicycles(root)) == [["biking"], ["driving", "biking"]]
    assert max(lane_gaps(surface)) < 0.01


def test_raised_cycle_tracks_go_down_to_cross_a_street_and_stay_raised_beside_none(tmp_path):
    """The side street leads south: the track in the north has no street to cross."""
    extract = Extract()
    track = {**STREET, "cycleway": "track"}
    extract.way((-100.0, 0.0), (0.0, 0.0), (100.0, 0.0), **track)
    extract.way((0.0, 0.0), (0.0, -100.0), **SIDE)
    _, root, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    kinds = sorted(turns_with_bicycles(root))
    assert kinds == [["driving", "biking"], ["driving", "biking", "sidewalk"]]
    inside = {
        patch.id
        for patch in surface.patches
        if patch.lane_type == "biking" and patch.junction and patch.kind == "lane"
    }
    assert len(inside) == 2
    tracks = []
    for name in inside:
        chosen = np.array([patch.id == name for patch in surface.patches])
        tracks.append(surface.vertices[surface.triangles[chosen[surface.triangle_patch]]])
    south, north = sorted(tracks, key=lambda corners: corners[..., 1].mean())
    assert north[..., 2].ravel() == pytest.approx(0.12, abs=1e-6)
    assert south[..., 2].ravel() == pytest.approx(0.0, abs=1e-6)
    assert len(root.findall("road/objects/object[@name='cycle crossing']")) == 1


def test_all_four_arms_may_have_cycle_lanes(tmp_path):
    extract = crossing(lanes="2", highway="secondary", cycleway="lane")
    _, root, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    assert len(turns_with_bicycles(root)) == 4
    assert max(lane_gaps(surface)) < 0.01

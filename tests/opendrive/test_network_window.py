"""The surface of the roads near a place is the part of the whole map's surface there."""

from pathlib import Path

import numpy as np
import pytest

from envgen_usd.opendrive.network_window import NetworkWindows
from envgen_usd.opendrive.reader import read
from envgen_usd.opendrive.reference_samples import ReferenceSamples
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.streets.network_roads import network_xml
from envgen_usd.streets.street_layouts import grid_network

PLACE = (150.0, 120.0, 260.0, 210.0)
"""A rectangle with a junction, in the middle of streets."""


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    path = tmp_path_factory.mktemp("window") / "grid.xodr"
    path.write_bytes(network_xml(grid_network((3, 3), 0), "grid"))
    return read(Path(path)).network


def triangles_in(surface, bounds):
    """Corners, patches and levels of the triangles with their middles in a rectangle."""
    corners = surface.vertices[surface.triangles]
    middle = corners.mean(axis=1)[:, :2]
    inside = np.flatnonzero(np.all((middle > bounds[:2]) & (middle < bounds[2:]), axis=1))
    patches = [surface.patches[surface.triangle_patch[row]] for row in inside]
    return corners[inside], patches, surface.triangle_level[inside]


def test_the_surface_near_a_place_is_that_of_the_map(network):
    boxes = ReferenceSamples.of(network).boxes
    near = NetworkWindows(network, boxes).near(PLACE)
    assert len(near.roads) < 0.7 * len(network.roads)
    whole, part = build_surface(network), build_surface(near)
    corners, patches, levels = triangles_in(whole, PLACE)
    assert len(corners) > 500
    same, same_patches, same_levels = triangles_in(part, PLACE)
    assert np.array_equal(corners, same)  # bit by bit: neighbours weld without a tolerance
    assert patches == same_patches
    assert np.array_equal(levels, same_levels)
    lanes = {lane.id: lane for lane in part.lanes}
    for lane in whole.lanes:
        low, high = lane.points[:, :2].min(axis=0), lane.points[:, :2].max(axis=0)
        if np.all(low < PLACE[2:]) and np.all(high > PLACE[:2]):
            same_lane = lanes[lane.id]
            assert np.abs(same_lane.points - lane.points).max() < 1e-9
            links = ("predecessors", "successors", "left", "right", "speed", "junction")
            assert [getattr(same_lane, each) for each in links] == [
                getattr(lane, each) for each in links
            ]  # what it leads to is kept, too


def test_no_road_is_linked_to_what_is_left_out(network):
    boxes = ReferenceSamples.of(network).boxes
    near = NetworkWindows(network, boxes).near(PLACE)
    assert list(near.roads) == [id_ for id_ in network.roads if id_ in near.roads]
    for road in near.roads.values():
        assert not road.junction or road.junction in near.junctions
        for link in filter(None, (road.predecessor, road.successor)):
            assert link.id in (near.roads if link.element == "road" else near.junctions)
    for junction in near.junctions.values():
        named = {
            name for c in junction.connections for name in (c.incoming_road, c.connecting_road)
        }
        assert named <= near.roads.keys()


def test_boxes_hold_their_roads_and_all_is_the_map(network):
    samples = ReferenceSamples.of(network)
    surface = build_surface(network)
    low, high = surface.vertices[:, :2].min(axis=0), surface.vertices[:, :2].max(axis=0)
    assert np.all(samples.boxes[:, :2].min(axis=0) <= low)
    assert np.all(samples.boxes[:, 2:].max(axis=0) >= high)
    assert NetworkWindows(network, samples.boxes).near((*low, *high)) is network

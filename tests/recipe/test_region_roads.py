"""Roads that are built region by region have the outline and the bridges of the whole map."""

from dataclasses import replace

import numpy as np
import pytest

from envgen_usd.chunks import CHUNK_SIZE
from envgen_usd.models.road_marks import RMS_MARKS
from envgen_usd.opendrive.network_window import NetworkWindows
from envgen_usd.opendrive.reference_samples import ReferenceSamples
from envgen_usd.recipe import map_regions
from envgen_usd.recipe.map_land import read_road_file, surface_of
from envgen_usd.recipe.map_regions import MapRegions
from envgen_usd.recipe.region_roads import BESIDE, build_roads, joined_roads, with_decks

_TOLERANCE = 0.02
_MARGIN = 100.0


def _rows(triangles_or_edges):
    """Corners as a set, whatever their order in the file."""
    rows = np.round(triangles_or_edges / 1e-3).astype(np.int64)
    return {row.tobytes() for row in rows}


def _outline(surface):
    loops = surface.outline_loops()
    edges = np.concatenate([np.stack([p, np.roll(p, -1, axis=0)], axis=1) for p in loops])
    return edges[np.any(edges[:, 0, :2] != edges[:, 1, :2], axis=1)]


@pytest.fixture(
    scope="module", params=["carla_test/Town01.xodr", "asam_ex16/UC_Motorway-Exit-Entry.xodr"]
)
def network(request, corpus):
    return read_road_file(corpus / request.param, _TOLERANCE).network


@pytest.fixture(scope="module")
def regions(network):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(map_regions, "SIDE", 2)
        patch.setattr(map_regions, "WHOLE", 2)
        return MapRegions.of(ReferenceSamples.of(network).boxes, _MARGIN)


@pytest.fixture(scope="module")
def pieces(network, regions):
    windows = NetworkWindows(network, regions.boxes)
    near = [windows.near(each.around(BESIDE)) for each in regions.all]
    return [
        build_roads(roads, region, _TOLERANCE, RMS_MARKS, _MARGIN)[1]
        for region, roads in zip(regions.all, near, strict=True)
    ]


def test_regions_join_to_the_roads_of_the_map(network, regions, pieces):
    assert len(pieces) >= 4
    (x0, *_, x1), (y0, *_, y1) = regions.columns, regions.rows
    bounds = tuple(CHUNK_SIZE * side for side in (x0, y0, x1, y1))
    road, issues = joined_roads(pieces, network, _TOLERANCE, bounds)
    whole = surface_of(network, _TOLERANCE, RMS_MARKS)
    assert not issues
    assert _rows(_outline(road)) == _rows(_outline(whole))
    assert sum(map(len, road.outline)) == len(_outline(road))  # each edge once
    decks, elevated = with_decks(road, pieces), whole.triangle_level > 0
    expected = whole.vertices[whole.triangles[elevated]]
    assert len(decks.triangles) == len(expected)
    assert _rows(decks.vertices[decks.triangles]) == _rows(expected)
    assert (road.lanes, road.roads) == (whole.lanes, whole.roads)
    lanes = [lane for piece in pieces for lane in piece.lanes]
    assert sorted(lane.id for lane in lanes) == sorted(lane.id for lane in whole.lanes)
    found = {issue for piece in pieces for issue in piece.issues}
    assert {issue.kind for issue in found} == {issue.kind for issue in whole.issues}


def test_edges_that_are_missing_between_regions_are_an_issue(network, pieces):
    place = max(range(len(pieces)), key=lambda number: len(pieces[number].edges))
    torn = replace(pieces[place], edges=pieces[place].edges[1:])
    pieces = [*pieces[:place], torn, *pieces[place + 1 :]]
    far = 1e5
    road, issues = joined_roads(pieces, network, _TOLERANCE, (-far, -far, far, far))
    assert [issue.kind for issue in issues] == ["road.open_outline"]
    assert "2 open ends" in issues[0].message
    assert all(len(loop) > 2 for loop in road.outline)

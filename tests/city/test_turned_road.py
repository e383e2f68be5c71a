"""What stands beside a road does not depend on where the road runs and where it lies."""

from dataclasses import replace

import numpy as np
import pytest

from envgen_usd.chunks import HEIGHT_SAMPLES, LANDUSE_CELLS, Chunk
from envgen_usd.city.generate import build_city, plan_city
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.environment_files import read_profile
from envgen_usd.models.environment_profile import FurnitureRules
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap


def moved(surface, turn, shift):
    """The road, turned around the origin and shifted."""
    matrix = np.eye(3)
    matrix[:2, :2] = np.round([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])

    def move(points):
        return points @ matrix.T + (*shift, 0.0)

    return replace(
        surface,
        vertices=move(surface.vertices),
        lanes=tuple(replace(lane, points=move(lane.points)) for lane in surface.lanes),
        roads=tuple(
            replace(road, points=move(road.points), heading=road.heading + turn)
            for road in surface.roads
        ),
    )


def standing(surface, chunks):
    """Places and headings of furniture and street lights by name; the ground is level."""
    profile = replace(read_profile("1", "residential"), furniture=FurnitureRules(9, 9, 20, 30))
    found, roads = {}, RoadIndex(surface)
    for chunk in chunks:
        heights = HeightMap(chunk, np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES)))
        cells = np.full((LANDUSE_CELLS, LANDUSE_CELLS), LanduseClass.VERGE, dtype=np.uint8)
        landuse = LanduseMap(chunk, cells, np.zeros(cells.shape, dtype=np.int64))
        city = build_city(plan_city(chunk, (), roads, heights, profile, 0), landuse, profile)
        for thing in city.of_kind("CityFurniture"):
            found[thing.id] = (*thing.placement.position[:2], thing.placement.heading)
    return found


@pytest.mark.parametrize(
    ("turn", "shift", "tiles"),
    [
        (np.pi / 2, (200.0, 0.0), (Chunk(0, 0), Chunk(0, 1))),
        (np.pi, (400.0, 800.0), (Chunk(0, 3), Chunk(1, 3))),
    ],
    ids=["to the north", "to the west"],
)
def test_lights_and_furniture_turn_with_their_road(surface, chunks, turn, shift, tiles):
    expected = standing(surface, chunks)
    found = standing(moved(surface, turn, shift), tiles)
    assert len(expected) > 50
    assert found.keys() == expected.keys()
    for name, (x, y, heading) in expected.items():
        at = np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y
        np.testing.assert_allclose(found[name][:2], np.add(at, shift), atol=2e-3)
        assert np.cos(found[name][2] - heading - turn) == pytest.approx(1.0, abs=1e-5)

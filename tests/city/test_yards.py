"""Containers, pallets and silos stand on plots, clear of the road and of each other."""

from itertools import combinations

import numpy as np
import pytest

from envgen_usd.chunks import HEIGHT_SAMPLES, Chunk
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.yards import place_yards
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.models.environment_profile import YardRules
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot

CHUNK = Chunk(0, 0)
PLOT = Plot(
    "p", np.array([[20.0, 20], [180, 20], [180, 180], [20, 180]]), LanduseClass.RUBBLE,
    np.array([[20.0, 20.0], [180.0, 20.0]]), "0", side="left",
)  # fmt: skip


@pytest.fixture
def scene():
    heights = HeightMap(CHUNK, np.full((HEIGHT_SAMPLES, HEIGHT_SAMPLES), 2.5))
    road = RoadPlan(np.array([[[0.0, 95.0], [200.0, 95.0], [200.0, 105.0]]]))
    return Scene(CHUNK, None, road, Footprints([]), Ground(heights), 3)


@pytest.fixture
def landuse():
    classes = np.full((255, 255), LanduseClass.GRASS, dtype=np.uint8)
    classes[30:220, 30:220] = LanduseClass.RUBBLE
    return LanduseMap(CHUNK, classes, np.zeros((255, 255), dtype=np.int64))


def test_yards_hold_about_as_many_as_the_environment_says(scene, landuse):
    rules = YardRules(container=4.0, pallets=8.0, silo=1.0)
    made = place_yards(scene, landuse, (PLOT,), rules)
    counts = {name: sum(each.placement.template == name for each in made) for name in vars(rules)}
    # 190 cells of 0.784 m make 2.2 hectares; some are in the way of others.
    assert 5 <= counts["container"] <= 9
    assert 12 <= counts["pallets"] <= 18
    assert 1 <= counts["silo"] <= 3


def test_yards_are_clear_and_in_line_with_the_frontage(scene, landuse):
    made = place_yards(scene, landuse, (PLOT,), YardRules(container=20.0, pallets=20.0, silo=4.0))
    assert len({each.id for each in made}) == len(made) > 20
    for each in made:
        position, heading = each.placement.position, each.placement.heading
        assert position[2] == pytest.approx(2.5)
        assert 23.0 < position[0] < 173.0
        assert abs(np.sin(2 * heading)) < 1e-5
        assert not scene.road.near(position[None, :2], 1.4).any()
    for one, other in combinations(made, 2):
        gap = np.hypot(*(one.placement.position - other.placement.position)[:2])
        assert gap >= 1.5, (one.id, other.id)


def test_no_yard_without_rules(scene, landuse):
    assert place_yards(scene, landuse, (PLOT,), YardRules()) == ()

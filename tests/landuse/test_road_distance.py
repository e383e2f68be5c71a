"""Cells know how far from the road they are, as exactly as the land needs it."""

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.outer_land import land_limits
from envgen_usd.landuse.woodland import AROUND, road_distance


@pytest.mark.parametrize("name", ["winding", "hairpin", "x"])
@pytest.mark.parametrize("chunk", [Chunk(0, 0), Chunk(1, 1)])
def test_a_cell_lies_on_the_side_of_each_limit_of_its_exact_distance(
    make_roads, lines, name, chunk
):
    surface = make_roads(lines[name])
    limits = (*land_limits(read_profile("1", "residential")), 30.0, 31.0)
    away = road_distance(chunk, Outline.of(surface), limits)
    numbers = np.arange(-AROUND, LANDUSE_CELLS + AROUND) + 0.5
    x, y = (origin + numbers * CELL_SIZE for origin in chunk.origin)
    edge = shapely.multilinestrings(
        [shapely.linearrings(loop[:, :2]) for loop in surface.outline_loops()]
    )
    shapely.prepare(edge)
    exact = shapely.distance(edge, shapely.points(*np.meshgrid(x, y)))
    assert away.shape == exact.shape
    crossed = 0
    for limit in limits:
        clear = np.abs(exact - limit) > 1e-6
        assert np.array_equal((away < limit)[clear], (exact < limit)[clear])
        crossed += 0 < np.sum(exact < limit) < exact.size
    assert crossed >= 1


def test_without_a_road_all_land_is_far():
    away = road_distance(Chunk(0, 0), Outline(np.empty((0, 3)), np.empty((0, 3))), (5.0, 100.0))
    assert np.isinf(away).all()

"""Heights between samples, against the functions that were sampled."""

import numpy as np
import pytest

from envgen_usd.chunks import CELL_SIZE, HEIGHT_SAMPLES, Chunk
from envgen_usd.city.ground_heights import Ground
from envgen_usd.models.ground import HeightMap


def sampled(chunk, height):
    x, y = np.meshgrid(*chunk.corner_axes())
    return HeightMap(chunk, height(x, y))


def plane(x, y):
    return 3.0 + 0.1 * x - 0.05 * y


@pytest.fixture
def places():
    return np.random.default_rng(0).uniform(0.0, 400.0, (200, 2)) * (1.0, 0.5)


def test_heights_of_two_chunks_are_those_of_their_plane(places):
    ground = Ground(sampled(Chunk(0, 0), plane), [sampled(Chunk(1, 0), plane)])
    np.testing.assert_allclose(ground.heights(places), plane(*places.T), atol=1e-4)


def test_a_cell_is_the_bilinear_surface_through_its_corners():
    rng = np.random.default_rng(1)
    heights = rng.uniform(0.0, 9.0, (HEIGHT_SAMPLES, HEIGHT_SAMPLES))
    ground = Ground(HeightMap(Chunk(0, 0), heights))
    row, column, u, v = 7, 91, 0.3, 0.8
    a, b, c, d = heights[[row, row, row + 1, row + 1], [column, column + 1, column, column + 1]]
    place = np.array([[(column + u) * CELL_SIZE, (row + v) * CELL_SIZE]])
    # Expanded in monomials, as a textbook has it.
    expected = a + (b - a) * u + (c - a) * v + (a - b - c + d) * u * v
    assert ground.heights(place) == pytest.approx([expected])


def test_beyond_all_tiles_the_border_goes_on_level():
    ground = Ground(sampled(Chunk(0, 0), plane))
    outside = np.array([[-30.0, 50.0], [230.0, 50.0], [60.0, 999.0]])
    expected = [plane(0, 50), plane(200, 50), plane(60, 200)]
    np.testing.assert_allclose(ground.heights(outside), expected, atol=1e-4)


def test_the_range_under_a_turned_rectangle_is_at_its_corners():
    ground = Ground(sampled(Chunk(0, 0), plane))
    corners = np.array([[50.0, 60.0], [62.0, 65.0], [57.0, 77.0], [45.0, 72.0]])
    heights = plane(*corners.T)
    assert ground.range_under(corners) == pytest.approx((heights.min(), heights.max()), abs=1e-4)

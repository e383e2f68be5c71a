"""Parts of the ground that are fitted by themselves join without a step."""

import numpy as np
import pytest

from envgen_usd.chunks import Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.terrain.joined_terrain import SURROUNDINGS, joined_terrain
from envgen_usd.terrain.land_guess import guess_land
from envgen_usd.terrain.terrain_field import TerrainPart, fit_terrain

RULES = TerrainRules(12.0, 150.0, 0.5)
PARTS = ((-200.0, -200.0, 200.0, 200.0), (200.0, -200.0, 600.0, 200.0))


@pytest.fixture(scope="module")
def fields(make_surface, areas):
    """Fields of both parts, and the road's outline."""
    surface = make_surface(areas["straight"], lambda x, y: 3.0 * np.sin(x / 60.0) + 0.0 * y)
    land, outline = guess_land(surface, RULES, 3), Outline.of(surface)
    corrections = [
        (bounds, fit_terrain(surface, RULES, 3, None, (), TerrainPart(land, wide)).correction)
        for bounds in PARTS
        for wide in [tuple(np.add(bounds, SURROUNDINGS * np.array([-1, -1, 1, 1])))]
    ]
    return [joined_terrain(outline, land, corrections, bounds) for bounds in PARTS], outline


def test_chunks_of_two_parts_share_their_border(fields):
    (west, east), _ = fields
    for row in (-1, 0):
        left = west.on_grid(*Chunk(0, row).corner_axes())
        right = east.on_grid(*Chunk(1, row).corner_axes())
        assert np.abs(left[:, -1] - right[:, 0]).max() < 1e-12
        assert np.ptp(left) > 1.0


def test_the_ground_meets_the_road_in_both_parts(fields):
    (west, east), outline = fields
    samples, _ = outline.samples(1.0)
    for ground, bounds in zip((west, east), PARTS, strict=True):
        inside = np.all((samples[:, :2] > bounds[:2]) & (samples[:, :2] < bounds[2:]), axis=1)
        assert inside.sum() > 50
        assert np.abs(ground(samples[inside, :2]) - samples[inside, 2]).max() < 2e-3


def test_no_slope_shows_where_the_parts_meet(fields):
    (west, east), _ = fields
    x = np.array([198.0, 199.9, 200.1, 202.0])
    y = np.linspace(-150.0, 150.0, 200)
    heights = np.concatenate([west.on_grid(x[:2], y), east.on_grid(x[2:], y)], axis=1)
    assert np.abs(np.diff(heights, axis=1)).max() < 2.0 * RULES.bank_slope

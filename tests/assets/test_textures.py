from functools import lru_cache

import numpy as np
import pytest

from envgen_usd.assets.shipped_looks import TEXTURED, make_texture
from envgen_usd.assets.textures.masonry_textures import bond
from envgen_usd.assets.textures.procedural_texture import to_normals, to_srgb
from envgen_usd.assets.textures.texture_noise import cells, even_seeds, spectral

SEVERAL = [
    "asphalt_patched",
    "crop_rows",
    "flagstone",
    "hedge_privet",
    "meadow",
    "paving",
    "stone",
    "plaster",
    "asphalt",
    "grass",
    "brick_red",
]

texture = lru_cache(maxsize=5)(make_texture)
"""Several tests look at the last ones of the list; 40 MB each."""


@pytest.mark.parametrize("name", SEVERAL)
def test_texture_tiles(name):
    """Across the wrap neighbours differ no more than anywhere else."""
    albedo = texture(name).albedo
    for axis in (0, 1):
        steps = np.abs(np.diff(albedo, axis=axis)).mean(axis=(1 - axis, 2))
        ends = np.take(albedo, 0, axis) - np.take(albedo, -1, axis)
        assert np.abs(ends).mean() <= steps.max() * 1.05


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("asphalt", (0.08, 0.08, 0.08), (0.12, 0.12, 0.12)),
        ("grass", (0.05, 0.09, 0.02), (0.11, 0.16, 0.06)),
        ("brick_red", (0.22, 0.09, 0.06), (0.36, 0.18, 0.14)),
        ("marking_white", (0.45, 0.45, 0.43), (0.75, 0.75, 0.75)),
    ],
)
def test_mean_colour_is_natural(name, low, high):
    mean = texture(name).albedo.mean(axis=(0, 1))
    assert (mean > low).all()
    assert (mean < high).all()


FAMILIES = {name: made.relief for name, made in TEXTURED.items() if made.relief != name}


@pytest.mark.parametrize("name", ["brick_sooted", "curb_concrete", "plaster_blue", "rubble_brick"])
def test_materials_with_one_relief_have_the_same_structure(name):
    """Else the normals and the roughness that they share would not fit their colours."""
    made, first = make_texture(name), texture(FAMILIES[name])
    np.testing.assert_array_equal(made.height, first.height)
    np.testing.assert_array_equal(made.roughness, first.roughness)
    assert not np.allclose(made.albedo, first.albedo, rtol=0.05)


@pytest.mark.parametrize("name", ["asphalt", "brick_red", "curb_stone", "roof_slate"])
def test_roughness_map_agrees_with_the_figure_for_tools_without_maps(name):
    roughness = texture(name).roughness
    assert roughness.std() > 0.005
    assert roughness.mean() == pytest.approx(TEXTURED[name].roughness, abs=0.1)


def test_srgb_curve_has_its_known_points():
    linear = np.array([0.0, 0.0031308, 0.2140, 1.0])
    np.testing.assert_array_equal(to_srgb(linear), [0, 10, 127, 255])


def test_normals_of_a_slope():
    """A height that rises along u by 0.5 m a metre tilts the normal against u."""
    height = np.tile(np.arange(64) / 64 * 0.5, (64, 1))
    normal = to_normals(height, 1.0)[10, 30] / 255 * 2 - 1
    np.testing.assert_allclose(normal, np.array([-0.5, 0, 1]) / np.sqrt(1.25), atol=0.01)


def test_spectral_noise_is_normalised_and_keeps_to_its_band():
    field = spectral(np.random.default_rng(0), 128, 8, 16)
    assert field.mean() == pytest.approx(0, abs=1e-9)
    assert field.std() == pytest.approx(1)
    power = np.abs(np.fft.fft2(field)) ** 2
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(128, 1 / 128), np.fft.fftfreq(128, 1 / 128)))
    inside = power[(frequency > 6) & (frequency < 20)].sum()
    assert inside / power.sum() > 0.95


def test_cells_belong_to_the_nearest_seed_around_the_wrap():
    rng = np.random.default_rng(3)
    seeds = rng.random((12, 2))
    index = cells(seeds, 32).index
    axis = (np.arange(32) + 0.5) / 32
    pixel = np.stack(np.meshgrid(axis, axis), axis=-1)
    apart = (pixel[:, :, None] - seeds + 0.5) % 1.0 - 0.5
    np.testing.assert_array_equal(index, np.linalg.norm(apart, axis=-1).argmin(axis=-1))


def test_even_seeds_keep_their_distance():
    def nearest(points):
        apart = (points[:, None] - points + 0.5) % 1.0 - 0.5
        distance = np.linalg.norm(apart, axis=-1) + np.eye(len(points))
        return distance.min(axis=1).min()

    rng = np.random.default_rng(0)
    assert nearest(even_seeds(rng, 60)) > 2 * nearest(rng.random((60, 2)))


def test_bricks_have_the_size_of_the_standard():
    """24 courses of 8 stretchers on 2 m: 0.25 x 0.0833 m with the joint (DIN 4172)."""
    wall = bond(1024, 2.0, 8, 24)
    assert wall.count == 192
    areas = np.bincount(wall.index.ravel()) / 1024**2 * 4.0
    np.testing.assert_allclose(areas, 0.25 * 2 / 24, rtol=0.04)

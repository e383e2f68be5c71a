import numpy as np

from envgen_usd.geometry.smooth_noise import smooth_noise, smooth_noise_grid


def test_the_field_has_mean_zero_variance_one_and_its_wavelength():
    x = np.arange(0.0, 6000.0, 10.0)
    field = smooth_noise_grid(x, x, 100.0, np.random.default_rng(0))
    assert abs(field.mean()) < 0.05
    assert abs(field.std() - 1.0) < 0.05
    # A plane wave crosses zero twice a wavelength; along a line, a direction at random, less often.
    crossings = np.mean(np.diff(np.sign(field), axis=1) != 0) / 10.0
    assert 2 / 100.0 * 0.5 < crossings < 2 / 100.0


def test_points_and_grid_agree():
    x, y = np.linspace(-50.0, 300.0, 7), np.linspace(20.0, 90.0, 5)
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    one = smooth_noise(points, 60.0, np.random.default_rng(4))
    grid = smooth_noise_grid(x, y, 60.0, np.random.default_rng(4))
    assert np.allclose(one, grid.ravel())
    assert not np.allclose(one, smooth_noise(points, 60.0, np.random.default_rng(5)))


def test_a_place_has_the_same_bits_on_every_grid():
    """Chunks agree at their borders, whatever part of the land is laid out at a time."""
    x, y = np.linspace(-50.0, 300.0, 37), np.linspace(20.0, 90.0, 23)
    whole = smooth_noise_grid(x, y, 60.0, np.random.default_rng(4))
    for rows, columns in ((1, 1), (1, 37), (23, 1), (5, 2), (22, 13)):
        part = smooth_noise_grid(x[-columns:], y[:rows], 60.0, np.random.default_rng(4))
        assert np.array_equal(part, whole[:rows, -columns:])

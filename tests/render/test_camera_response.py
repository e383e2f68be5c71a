"""The camera: what each of its steps does to known light."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, uniform_filter

from envgen_usd.light.daylight import LUMINANCE
from envgen_usd.render.cameras.camera_response import (
    CameraSettings,
    camera_picture,
    draw_settings,
    ideal_picture,
)

PLAIN = CameraSettings(0, 0.5, 5.0, 0.0, 0.0, 0.0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0)


def taken(image, **changes):
    picture = camera_picture(image.astype(np.float32), replace(PLAIN, **changes),
                             np.random.default_rng(0))  # fmt: skip
    return picture.astype(float)


def srgb(linear):
    return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


@pytest.fixture
def scene():
    """A dark street below a bright sky, with texture."""
    rng = np.random.default_rng(1)
    image = np.full((90, 160, 3), (0.1, 0.11, 0.09)) * rng.uniform(0.7, 1.3, (90, 160, 1))
    image[:40] = (1.8, 2.0, 2.4)
    return image


@pytest.mark.parametrize("level", [1e-3, 0.2, 50.0])
def test_an_even_scene_becomes_middle_grey(level):
    assert taken(np.full((40, 60, 3), level)).mean() == pytest.approx(srgb(0.18), abs=1)


@pytest.mark.parametrize("stops", [-1.0, 1.0])
def test_an_error_of_one_stop_is_a_factor_of_two(stops):
    picture = taken(np.full((40, 60, 3), 0.4), exposure_error=stops)
    assert picture.mean() == pytest.approx(srgb(0.18 * 2.0**stops), abs=1)


def test_metering_on_the_street_saturates_the_sky(scene):
    street, sky = (taken(scene, sky_weight=weight) for weight in (0.0, 1.0))
    assert (street[:35] == 255).all()
    assert sky[:35].max() < 255
    assert street[50:].mean() > 1.5 * sky[50:].mean()


def test_a_car_in_the_low_beam_is_not_lost():
    """A dark street of which a car, 7 to 15 times as bright, covers an eighth of the lower half."""
    image = np.full((90, 160, 3), 0.01)
    image[50:70, 40:85] = np.linspace(0.07, 0.15, 45)[:, None]
    image[10:12, 100:102] = 50.0
    picture = taken(image, sky_weight=0.2)
    # A twelfth of the lower half may be lost: two thirds of the car.
    assert 0.5 < (picture[50:70, 40:85, 0] == 255).mean() < 0.7
    assert (picture[10:12, 100:102] == 255).all()


def test_vignetting_is_the_loss_in_the_corners():
    picture = taken(np.full((81, 121, 3), 0.3), vignetting=0.4)
    linear = (picture / 255 / 1.055 + 0.055 / 1.055) ** 2.4
    assert linear[0, 0, 0] / linear[40, 60, 0] == pytest.approx(0.6, rel=0.03)
    # The loss grows with the square of the distance from the middle.
    for row, column, share in ((40, 120, 3600 / 5200), (0, 60, 1600 / 5200)):
        expected = 0.6**share
        assert linear[row, column, 0] / linear[40, 60, 0] == pytest.approx(expected, rel=0.03)


def test_blur_is_a_gaussian_of_its_deviation():
    image = np.full((61, 61, 3), 0.01)
    image[30, 30] = 1.0
    picture = taken(image, blur=1.5, exposure_error=-2.0)[..., 0]
    linear = np.where(picture > 10, ((picture / 255 + 0.055) / 1.055) ** 2.4, picture / 255 / 12.92)
    spot = linear - linear[5, 5]
    assert spot[30, 32] / spot[30, 30] == pytest.approx(np.exp(-(2**2) / (2 * 1.5**2)), rel=0.1)


@pytest.mark.parametrize("shape", [(40, 61, 3), (1, 9, 3)])
def test_blur_and_sharpening_are_those_of_scipy(shape):
    image = np.random.default_rng(5).uniform(0.02, 0.3, shape).astype(np.float32)
    metered = 0.18 / max(image[shape[0] // 2 :].reshape(-1, 3).mean(axis=0) @ LUMINANCE, 1e-9)
    linear = np.clip(gaussian_filter(image, (0.8, 0.8, 0), truncate=3.0) * metered, 0, 1)
    encoded = srgb(linear)
    expected = np.clip(encoded + 0.6 * (encoded - uniform_filter(encoded, (3, 3, 1))), 0, 255)
    picture = taken(image, blur=0.8, sharpening=0.6, sky_weight=0.0)
    np.testing.assert_allclose(picture, expected, atol=1.5)


def test_noise_grows_with_the_root_of_the_light():
    image = np.concatenate([np.full((200, 200, 3), v) for v in (0.045, 0.18)], axis=1)
    picture = taken(image, noise=0.02)
    linear = ((picture / 255 + 0.055) / 1.055) ** 2.4
    dark, bright = linear[:, :200].std(), linear[:, 200:].std()
    assert bright / dark == pytest.approx(2.0, rel=0.1)


def test_white_balance_removes_the_colour_of_the_light(scene):
    warm = scene * (1.3, 1.0, 0.7)
    warm = np.minimum(warm, 0.3)
    cast = [np.ptp(taken(warm, adaptation=share).mean(axis=(0, 1))) for share in (0.0, 1.0)]
    assert cast[1] < 0.35 * cast[0]


def test_white_stays_white(scene):
    picture = taken(scene, sky_weight=0.0, warmth=0.3, green=0.1, saturation=0.5)
    assert (picture[:35] == 255).all()


def test_the_same_draws_give_the_same_picture(scene):
    def take(seed):
        rng = np.random.default_rng(seed)
        return camera_picture(scene.astype(np.float32), draw_settings(rng), rng)

    np.testing.assert_array_equal(take(3), take(3))
    assert (take(3) != take(4)).mean() > 0.5
    assert take(3).dtype == np.uint8


def test_the_ideal_picture_keeps_the_order_of_light():
    levels = np.linspace(0.0, 4.0, 300)
    picture = ideal_picture(np.repeat(levels[None, :, None], 3, axis=2).astype(np.float32))[0, :, 0]
    assert (np.diff(picture.astype(int)) >= 0).all()
    assert picture[0] == 0
    assert picture[-1] > 240


def test_the_gain_of_the_sensor_ends(scene):
    """At dusk, each stop that the gain lacks halves the light of the picture."""

    def linear(gain):
        settings = replace(PLAIN, gain=gain, noise=0.0, read_noise=0.0)
        drawn = np.random.default_rng(0)
        picture = camera_picture(scene.astype(np.float32), settings, drawn, white=0.005) / 255.0
        street = picture[50:]
        return np.where(street <= 0.04045, street / 12.92, ((street + 0.055) / 1.055) ** 2.4).mean()

    assert linear(3.0) / linear(2.0) == pytest.approx(2.0, rel=0.05)
    assert linear(4.0) / linear(3.0) == pytest.approx(2.0, rel=0.05)

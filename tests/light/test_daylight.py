"""Sun and sky against astronomy, photometry and the conventions of OpenEXR."""

from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from envgen_usd.light.daylight import (
    LUMINANCE,
    horizontal_illuminance,
    sky_luminance,
    sun_illuminance,
)
from envgen_usd.light.sky import make_atmosphere, sun_behind_clouds
from envgen_usd.light.sky_directions import (
    ground_illuminance,
    sky_directions,
    sky_places,
    solid_angles,
)
from envgen_usd.light.sun_position import sun_direction
from envgen_usd.light.weather import Moment, read_weathers

CLEAR = Moment(2.5, 0.0, 0.0, 0.0, 0.3, 1.0, 1e6, 0.0, 0.0, 0.0)
CLOSED = Moment(2.5, 0.0, 0.0, 1.0, 0.25, 0.0, 1e6, 0.0, 0.0, 0.0)


def towards(elevation, azimuth=180.0):
    up, east = np.radians(elevation), np.radians(azimuth)
    return np.array([np.cos(up) * np.sin(east), np.cos(up) * np.cos(east), np.sin(up)])


def elevation_of(sun):
    return float(np.degrees(np.arcsin(sun[2])))


@pytest.mark.parametrize("latitude", [-35.0, 0.0, 23.44, 48.1, 66.0])
@pytest.mark.parametrize(
    ("day", "declination"),
    [(date(2025, 3, 20), 0.0), (date(2025, 6, 21), 23.44), (date(2025, 12, 21), -23.44)],
)
def test_the_sun_at_noon_is_as_high_as_latitude_and_declination_say(latitude, day, declination):
    sun = sun_direction(latitude, day, 12.0)
    assert np.linalg.norm(sun) == pytest.approx(1.0)
    assert elevation_of(sun) == pytest.approx(90.0 - abs(latitude - declination), abs=0.5)
    assert sun[0] == pytest.approx(0.0, abs=1e-9)
    assert sun[1] * (declination - latitude) >= -0.01


def test_at_an_equinox_the_sun_rises_at_six_in_the_east():
    rise, fall = (sun_direction(48.0, date(2025, 3, 20), hour) for hour in (6.0, 18.0))
    np.testing.assert_allclose(rise, [1, 0, 0], atol=0.01)
    np.testing.assert_allclose(fall, [-1, 0, 0], atol=0.01)


def test_a_day_at_the_solstice_has_the_length_of_the_sunrise_equation():
    hours = np.linspace(0, 24, 4801)
    up = [sun_direction(48.0, date(2025, 6, 21), hour)[2] > 0 for hour in hours]
    expected = 2 / 15 * np.degrees(np.arccos(-np.tan(np.radians(48)) * np.tan(np.radians(23.44))))
    assert np.mean(up) * 24 == pytest.approx(expected, abs=0.05)


def test_a_map_follows_openexr_turned_to_z_up():
    """Longitude 0 is +z of the file, longitude 90 degrees +x; its y is up (OpenEXR, 2D maps)."""
    directions = sky_directions(64)
    assert directions.shape == (64, 128, 3)
    y_up = np.stack([directions[..., 0], directions[..., 2], -directions[..., 1]], axis=-1)
    np.testing.assert_allclose(y_up[0].mean(axis=0), [0, 1, 0], atol=0.01)
    np.testing.assert_allclose(y_up[31:33, 63:65].mean(axis=(0, 1)), [0, 0, 1], atol=0.01)
    np.testing.assert_allclose(y_up[31:33, 31:33].mean(axis=(0, 1)), [1, 0, 0], atol=0.01)
    rows, columns = np.moveaxis(sky_places(directions, 64), -1, 0)
    np.testing.assert_allclose(rows, np.broadcast_to(np.arange(64)[:, None], rows.shape), atol=1e-6)
    np.testing.assert_allclose(columns[0], np.arange(128), atol=1e-6)


def test_a_sky_of_one_luminance_lights_the_ground_with_pi():
    assert float((solid_angles(32) * 64).sum()) == pytest.approx(4 * np.pi)
    sky = np.full((32, 64, 3), 2.0)
    np.testing.assert_allclose(ground_illuminance(sky), 2.0 * np.pi, rtol=2e-3)


@pytest.mark.parametrize("elevation", [2.0, 10.0, 30.0, 60.0])
def test_the_ground_gets_the_light_of_the_almanac(elevation):
    """Janiczek and DeYoung (1987); sun and sky are separate models here."""
    sun = towards(elevation)
    air = make_atmosphere(CLEAR, sun, np.random.default_rng(0), 128)
    ground = (ground_illuminance(air.sky) + air.sun * sun[2]) @ LUMINANCE
    assert ground == pytest.approx(horizontal_illuminance(elevation), rel=0.05)


def test_daylight_has_the_known_magnitudes():
    """About 100 klx at noon in summer, 400 lx at sunset, 3 lx at the end of civil twilight."""
    assert horizontal_illuminance(65) == pytest.approx(110, rel=0.15)
    assert horizontal_illuminance(0) == pytest.approx(0.7, rel=0.4)
    assert horizontal_illuminance(-6) == pytest.approx(0.003, rel=0.4)
    elevations = np.linspace(-17, 90, 500)
    light = np.array([horizontal_illuminance(each) for each in elevations])
    assert (np.diff(light) > -0.02 * light[1:]).all()


def test_air_takes_blue_from_a_low_sun():
    high, low = sun_illuminance(60.0, 2.5), sun_illuminance(5.0, 2.5)
    assert high[0] / high[2] < 1.4
    assert low[0] / low[2] > 3
    assert sun_illuminance(60.0, 8.0)[1] < high[1]
    assert not sun_illuminance(-0.1, 2.5).any()


def test_a_clear_sky_is_blue_and_brightest_around_the_sun():
    directions = sky_directions(64)[:32].reshape(-1, 3)
    sun = towards(40.0, 120.0)
    sky = sky_luminance(directions.T, sun, 2.5).T
    brightest = directions[np.argmax(sky @ LUMINANCE)]
    assert brightest @ sun > np.cos(np.radians(5))
    far = sky[directions @ sun < 0.2]
    assert (far[:, 2] > far[:, 0]).mean() > 0.9
    hazy = sky_luminance(directions.T, sun, 8.0).T
    chroma = [np.ptp(each, axis=1).sum() / each.sum() for each in (sky, hazy)]
    assert chroma[1] < 0.8 * chroma[0]


def test_an_overcast_sky_is_three_times_as_bright_overhead():
    """Moon and Spencer (1942), the CIE standard overcast sky; the layer is mottled."""
    skies = [make_atmosphere(CLOSED, towards(40), np.random.default_rng(k), 64) for k in range(8)]
    luminance = np.mean([sky.sky[:32] @ LUMINANCE for sky in skies], axis=(0, 2))
    assert luminance[0] / luminance[-2] == pytest.approx(3.0, rel=0.2)
    ground = np.mean([ground_illuminance(sky.sky) @ LUMINANCE for sky in skies])
    assert ground == pytest.approx(0.25 * horizontal_illuminance(40), rel=0.1)
    assert not skies[0].sun.any()


@pytest.mark.parametrize("cover", [0.2, 0.5, 0.8])
def test_clouds_cover_their_share_of_the_sky(cover):
    moment = Moment(2.5, cover, 0.5, 0.0, 0.3, 1.0, 1e6, 0.0, 0.0, 0.0)
    clear, cloudy = (
        make_atmosphere(each, towards(50), np.random.default_rng(3), 128).sky[:64]
        for each in (Moment(2.5, 0.0, 0.5, 0.0, 0.3, 1.0, 1e6, 0.0, 0.0, 0.0), moment)
    )
    changed = np.abs(cloudy - clear).sum(axis=-1) > 0.1 * clear.sum(axis=-1)
    assert changed.mean() == pytest.approx(cover, abs=0.12)


def test_the_sun_shines_with_what_clouds_do_not_hide():
    moment, sun = replace(CLEAR, cover=0.5, depth=0.5), towards(50)
    free = make_atmosphere(CLEAR, sun, np.random.default_rng(0), 64).sun
    hidden = [sun_behind_clouds(moment, sun, np.random.default_rng(k), 64) for k in range(12)]
    for seed, share in enumerate(hidden):
        lit = make_atmosphere(moment, sun, np.random.default_rng(seed), 64).sun
        np.testing.assert_allclose(lit, (1.0 - share) * free, rtol=1e-9, atol=1e-12)
    assert min(hidden) == 0.0 < max(hidden) <= 1.0
    assert sun_behind_clouds(moment, towards(-3), np.random.default_rng(0), 64) == 0.0


def test_fog_hides_the_sky_and_the_sun():
    foggy = Moment(2.5, 0.3, 0.5, 0.0, 0.3, 1.0, 150.0, 0.0, 0.0, 0.0)
    air = make_atmosphere(foggy, towards(40), np.random.default_rng(0), 64)
    top = air.sky[:32] @ LUMINANCE
    assert top.std() < 0.01 * top.mean()
    assert air.sun.max() < 0.01 * top.mean()


@pytest.mark.parametrize("name", sorted(read_weathers()))
def test_every_shipped_weather_gives_finite_light(name):
    weather = read_weathers()[name]
    for k in range(3):
        rng = np.random.default_rng(k)
        sun = towards(float(rng.uniform(*weather.elevation)), float(rng.uniform(0, 360)))
        air = make_atmosphere(Moment.drawn(weather, rng), sun, rng, 64)
        assert np.isfinite(air.sky).all()
        assert air.sky.min() >= 0
        assert (ground_illuminance(air.sky) > 0).all()
    again = [make_atmosphere(Moment.drawn(weather), sun, np.random.default_rng(5), 64)
             for _ in range(2)]  # fmt: skip
    assert again[0] == again[1]

"""Rain in the air against what Marshall and Palmer's drops must give."""

import numpy as np
import pytest

from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.lens_models import KannalaBrandt
from envgen_usd.render.cameras.rain_streaks import add_rain

CAMERA = Camera(480, 360, 450.0, 450.0, 239.5, 179.5, 1.5, 0.3)


def rained(rate, depth=np.inf, seed=0):
    dark = np.zeros((360, 480, 3), np.float32)
    dark[:36] = 1.0  # a bright sky, so that drops are bright before the dark
    deep = np.full((360, 480), depth if np.isfinite(depth) else 0.0, np.float32)
    return add_rain(dark, deep, CAMERA, rate, np.random.default_rng(seed))[60:, :, 0]


def test_without_rain_the_picture_is_the_same():
    picture = np.random.default_rng(0).random((360, 480, 3)).astype(np.float32)
    wet = add_rain(picture, np.ones((360, 480), np.float32), CAMERA, 0.0, np.random.default_rng(0))
    assert wet is picture


def test_the_covered_share_is_that_of_the_drops():
    """The area of drops of more than 1 mm in a column from 0.4 to 6 m before the camera."""
    rate = 10.0
    slope = 4.1 * rate**-0.21
    sizes = np.linspace(1.0, 12.0, 4000)
    areas = 8000.0 * np.exp(-slope * sizes) * (sizes / 1000.0) ** 2
    per_metre = np.trapezoid(areas, sizes)  # m² of drops per m³
    expected = per_metre * (6.0 - 0.4) * 0.1  # the mean light of the picture is 0.1
    assert rained(rate).mean() == pytest.approx(expected, rel=0.3)


def test_more_rain_hides_more():
    means = [rained(rate).mean() for rate in (1.0, 5.0, 25.0)]
    assert 2 * means[0] < means[1] < means[2]


def test_no_drop_falls_behind_a_wall():
    near, far = rained(25.0, depth=1.0), rained(25.0, depth=50.0)
    assert 0.0 < near.mean() < 0.4 * far.mean()


def test_streaks_are_upright():
    wet = rained(25.0)
    along = np.abs(np.diff(wet, axis=0)).mean()
    across = np.abs(np.diff(wet, axis=1)).mean()
    assert across > 1.5 * along


def test_a_fisheye_shows_the_drops_of_its_field_and_none_outside():
    """Along every ray there is as much water as before a pinhole."""
    lens = KannalaBrandt("kannala_brandt", field=170.0)
    camera = Camera(300, 300, 100.0, 100.0, 149.5, 149.5, lens=lens)
    rows, columns = np.mgrid[:300, :300] - 149.5
    inside = np.hypot(rows, columns) < 100.0 * np.radians(85.0)
    dark = np.zeros((300, 300, 3), np.float32)
    dark[:100] = inside[:100, :, None]
    depth = np.zeros((300, 300), np.float32)
    wet = add_rain(dark, depth, camera, 4.0, np.random.default_rng(0), inside)
    assert (wet[~inside] == 0).all()
    slope = 4.1 * 4.0**-0.21
    sizes = np.linspace(1.0, 12.0, 4000)
    per_metre = np.trapezoid(8000.0 * np.exp(-slope * sizes) * (sizes / 1000.0) ** 2, sizes)
    light = inside[:100].sum() / inside.sum()
    for region in (inside & (rows > 0) & (rows < 40), inside & (rows > 60)):
        assert wet[region].mean() == pytest.approx(per_metre * 5.6 * light, rel=0.4)

"""Weathers from data: shipped, your own, and faulty files."""

import numpy as np
import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.light.weather import Moment, read_weather, read_weathers
from envgen_usd.recipe.report_pictures import ABOVE

FILE = """summary = "A test."
share = 1.0
elevation = [10.0, 20.0]
turbidity = [2.0, 4.0]
cover = [0.0, 0.5]
depth = [0.0, 1.0]
overcast = [0.0, 0.0]
light = [0.2, 0.4]
direct = [1.0, 1.0]
visibility = [100.0, 10000.0]
wetness = [0.0, 0.0]
rain = [0.0, 0.0]
glow = [0.0, 0.0]
"""


def test_what_is_drawn_lies_in_the_ranges(tmp_path):
    (tmp_path / "mine.toml").write_text(FILE)
    weather = read_weather(str(tmp_path / "mine.toml"))
    rng = np.random.default_rng(0)
    drawn = [Moment.drawn(weather, rng) for _ in range(500)]
    cover = np.array([moment.cover for moment in drawn])
    assert (cover.min(), cover.max()) == pytest.approx((0.0, 0.5), abs=0.01)
    assert np.median([moment.visibility for moment in drawn]) == pytest.approx(1000, rel=0.2)
    middle = Moment.drawn(weather)
    assert (middle.turbidity, middle.cover) == (3.0, 0.25)
    assert middle.visibility == pytest.approx(1000.0)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("cover = [0.0, 0.5]", "cover = [0.5, 0.0]", "cover: expected a range"),
        ("cover = [0.0, 0.5]", "cover = [0.0, 1.5]", "cover"),
        ("cover = [0.0, 0.5]\n", "", "cover"),
        ("visibility = [100.0,", "visibility = [nan,", "visibility"),
        ("share = 1.0", 'share = 1.0\nclouds = "many"', "clouds"),
    ],
)
def test_a_faulty_file_is_named_with_its_key(tmp_path, old, new, says):
    path = tmp_path / "mine.toml"
    path.write_text(FILE.replace(old, new))
    with pytest.raises(EnvgenError, match=says) as caught:
        read_weather(str(path))
    assert "mine.toml" in str(caught.value)


def test_an_unknown_weather_lists_those_that_exist():
    with pytest.raises(EnvgenError, match="known: after_rain, broken_clouds, clear"):
        read_weather("sunny")
    assert len(read_weathers()) >= 8


def test_haze_hides_nothing_in_the_view_of_a_whole_town():
    """Koschmieder: contrast falls by exp(-3.912 distance / visibility); towns reach over 5 km."""
    light = read_weather(ABOVE.weather)
    lowest = min(light.visibility)
    assert np.exp(-3.912 * 5000.0 / lowest) > 0.9
    assert min(light.elevation) > 30.0
    assert max(light.direct) == 0.0

"""Devices: what their data sheets say, and files that cannot be used."""

import re
from importlib import resources

import numpy as np
import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.render.lidar.lidar_model import known_lidars, read_lidar_model

GOOD = """name = "mine"
elevations = [2.0, 0.0, -2.0]
columns = 100
rate = 10.0
range = 50.0
dim_range = 20.0
"""


@pytest.mark.parametrize(
    ("name", "channels", "field", "points_a_second"),
    [
        ("Velodyne HDL-64E", 64, 26.3, 1.333e6),
        ("Velodyne HDL-32E", 32, 41.34, 695e3),
        ("Velodyne VLP-16", 16, 30.0, 289e3),
        ("Ouster OS1-64", 64, 33.2, 655_360),
        ("Ouster OS1-128", 128, 45.0, 1_310_720),
        ("Waymo TOP", 64, 20.0, 1.696e6),
    ],
)
def test_shipped_lidars_have_the_figures_of_their_data_sheets(
    name, channels, field, points_a_second
):
    model = read_lidar_model(name)
    assert len(model.elevations) == channels
    assert model.elevations[0] - model.elevations[-1] == pytest.approx(field, abs=0.05)
    assert model.shots * model.rate == pytest.approx(points_a_second, rel=0.005)


def test_the_table_above_lists_all_that_is_shipped():
    folder = resources.files("envgen_usd.renders") / "lidars"
    assert len(known_lidars()) == len(list(folder.iterdir())) == 6
    for name in known_lidars():
        assert read_lidar_model(name).name == name


def test_a_turn_is_clockwise_and_looks_ahead_in_its_middle():
    model = read_lidar_model("HDL-64E")
    ways = model.directions.reshape(64, model.columns, 3).astype(np.float64)
    np.testing.assert_allclose(np.linalg.norm(ways, axis=2), 1.0, atol=1e-6)
    for ring in (0, 31, 63):
        np.testing.assert_allclose(
            np.degrees(np.arcsin(ways[ring, :, 2])), model.elevations[ring], atol=1e-4
        )
    x, y = ways[0, :, 0], ways[0, :, 1]
    assert (x[:-1] * y[1:] - y[:-1] * x[1:] < 0.0).all()  # clockwise seen from above
    assert np.argmax(x) == model.columns // 2
    assert y[model.columns // 4] > 0.99 * np.abs(y).max()  # left comes before ahead
    assert model.times[model.columns // 2] == pytest.approx(0.0, abs=1e-9)
    steps = np.diff(model.times)
    np.testing.assert_allclose(steps, 0.1 / model.columns)


def test_the_maker_and_punctuation_do_not_count():
    for name in ("HDL-64E", "hdl64e".replace("64e", "-64e"), "velodyne HDL 64E"):
        assert read_lidar_model(name).name == "Velodyne HDL-64E"


@pytest.mark.parametrize("name", ["Luminar", "64E", "O", "64"])
def test_an_unknown_device_is_named_with_the_known_ones(name):
    with pytest.raises(EnvgenError, match=f"unknown lidar {name}; known: Ouster OS1-128"):
        read_lidar_model(name)


def test_a_rig_without_a_device_is_told_what_there_is():
    with pytest.raises(EnvgenError, match=r"is missing; known: .*Velodyne HDL-64E"):
        read_lidar_model("")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (GOOD.replace("50.0", "0.0"), "range: expected a number from 1 to 1000, not 0"),
        (
            GOOD.replace("-2.0]", "1.0]"),
            "elevations: expected angles from the uppermost down; 0 is",
        ),
        (GOOD.replace("-2.0]", "0.0]"), "0 is followed by 0"),
        (GOOD.replace("2.0, 0.0, -2.0", ""), "elevations: expected 1 to 1024 angles"),
        (GOOD.replace("-2.0]", "-91]"), "elevations: expected angles from -90 to 90"),
        (GOOD.replace("-2.0]", "nan]"), "elevations"),
        (GOOD.replace("columns = 100", "columns = 0"), "columns: expected a whole number from 1"),
        (GOOD.replace("rate = 10.0", "rate = 0.0"), "rate: expected a number from 0.01"),
        (GOOD + "nearest = 50.0\n", "nearest: expected less than the range of 50 m"),
        (GOOD + "drop_out = 1.5\n", "drop_out: expected a number from 0 to 1, not 1.5"),
        (GOOD + "noise = -0.1\n", "noise: expected a number from 0 to 1, not -0.1"),
        (GOOD + "colour = 1\n", "unknown colour; known: name, elevations"),
        (GOOD.replace("rate = 10.0\n", ""), "missing rate"),
        ("range = ", "cannot be read as TOML"),
    ],
)
def test_a_broken_file_is_named_with_its_key(tmp_path, text, said):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(EnvgenError, match=re.escape(said)) as caught:
        read_lidar_model(str(path))
    assert str(caught.value).startswith(str(path))


def test_a_missing_file_is_an_error(tmp_path):
    with pytest.raises(EnvgenError, match=r"none\.toml: cannot be read: No such file"):
        read_lidar_model(str(tmp_path / "none.toml"))

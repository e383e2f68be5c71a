"""A camera that takes the place of vehicles in the traffic of a stage."""

import json
from itertools import islice

import numpy as np
import pytest
from pxr import UsdGeom
from tests.render.test_moving_objects import CAMERA, RATE, add_traffic, on_stage

from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import label
from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_set import read_frames
from envgen_usd.render.trajectories.traffic_poses import Ride, spread_in_traffic
from envgen_usd.render.trajectories.trajectory import Trajectory

MIDDLE = 0.05
"""Of the asset of 2 m with a wheel that reaches 0.1 m beyond, before its origin."""
SPEED = {"first": 2.0, "second": 3.0}
START = {"first": (0.0, -8.0), "second": (20.0, -8.0)}
CODES = 31


@pytest.fixture(autouse=True)
def _own_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("ENVGEN_USD_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(f'[[camera]]\nname = "front"\n{CAMERA}')
    return str(path)


def place(name, time):
    """Where a car is at a time: it drives along +x."""
    x, y = START[name]
    return np.array([x + SPEED[name] * time, y])


def traffic_stage(author, folder, label_name="car"):
    """Two cars one behind the other; the first is there from 1 s to 2 s alone."""
    tracks = {
        name: [(*place(name, code / RATE), -1.9, 0.0) for code in range(CODES)] for name in SPEED
    }
    write = add_traffic(author, folder, tracks, label_name=label_name)
    seen = UsdGeom.Imageable(write.stage.GetPrimAtPath("/World/Traffic/first"))
    for code, token in ((0, "invisible"), (10, "inherited"), (21, "invisible")):
        seen.GetVisibilityAttr().Set(token, code)
    write.stage.Save()
    return on_stage(author, folder)


def rows(out):
    """Vehicle, time and place of each frame."""
    found = json.loads((out / "cameras.json").read_text())["frames"]
    matrices = np.array([row["camera_to_world"] for row in found])
    names = [row["vehicle"].rpartition("/")[2] for row in found]
    return names, np.array([row["time"] for row in found]), matrices


def test_frames_are_where_vehicles_are_at_their_times(opengl, author, rig, tmp_path):
    """The vehicle whose place it is shows in no frame of its own, and the one ahead does."""
    assert opengl
    stage, out = traffic_stage(author, tmp_path), tmp_path / "frames"
    way = Trajectory("traffic", jitter=False)
    result = render_frames(stage, out, 12, rig=rig, trajectory=way, outputs={"semantic"})
    assert "render.own_vehicle" not in {issue.code for issue in result.issues}
    names, times, matrices = rows(out)
    assert set(names) == set(SPEED)
    assert len(set(times)) == 12
    for name, time, matrix, frame in zip(names, times, matrices, read_frames(out), strict=True):
        assert name == "second" or 1.0 <= time <= 2.0
        x, y = place(name, time)
        np.testing.assert_allclose(matrix[:2, 3], (x + MIDDLE, y), atol=1e-3)
        np.testing.assert_allclose(matrix[2, 3], 1.55 - 1.9, atol=1e-3)
        np.testing.assert_allclose(matrix[:3, 2], (1.0, 0.0, 0.0), atol=1e-9)
        assert (frame.semantic == label("car").id).any() == (name == "first")


def test_frames_ride_along_at_a_rate(opengl, author, rig, tmp_path):
    assert opengl
    stage, out = traffic_stage(author, tmp_path), tmp_path / "frames"
    way = Trajectory("traffic", fps=5.0)
    result = render_frames(stage, out, 100, rig=rig, trajectory=way, outputs={"semantic"})
    names, times, matrices = rows(out)
    # 3 s and 1 s at five frames a second, first and last included; there is no further vehicle.
    assert result.rendered == 16 + 6
    for name, start in (("first", 1.0), ("second", 0.0)):
        those = np.flatnonzero(np.array(names) == name)
        np.testing.assert_array_equal(np.diff(those), 1)
        np.testing.assert_allclose(times[those], start + np.arange(len(those)) / 5.0, atol=1e-9)
        np.testing.assert_allclose(np.diff(matrices[those, 0, 3]), SPEED[name] / 5.0, atol=1e-3)


def test_fewer_frames_are_the_first_of_more(opengl, author, rig, tmp_path):
    assert opengl
    stage = traffic_stage(author, tmp_path)
    for count in (3, 7):
        out = tmp_path / str(count)
        render_frames(stage, out, count, rig=rig, trajectory="traffic", outputs={"semantic"})
    few, many = rows(tmp_path / "3"), rows(tmp_path / "7")
    assert few[0] == many[0][:3]
    np.testing.assert_array_equal(few[2], many[2][:3])


def test_a_metre_of_a_way_has_the_share_of_any_other():
    """Half of the cars stand for 9 of 10 s and then drive 20 m, the others drive all the time."""

    def at(y, starts):
        def matrix(time):
            place = np.eye(4)
            place[:2, 3] = 20.0 * np.clip((time - starts) / (10.0 - starts), 0.0, 1.0), y
            return place

        return matrix

    cars = 400
    rides = [Ride(str(n), 0.0, 10.0, at(50.0 * n, 9.0 * (n % 2))) for n in range(cars)]
    camera = read_rig("camvid").camera[0]
    poses = [*islice(spread_in_traffic(rides, camera, np.random.default_rng(0)), cars)]
    places, late = (
        np.array([pose.matrix[:2, 3] for pose in poses]),
        [int(p.vehicle) % 2 for p in poses],
    )
    # 20 m and 10 s, which count 5 m, each.
    assert np.mean(late) == pytest.approx(0.5, abs=0.03)
    assert (places[:, 0] < 1e-6).mean() == pytest.approx(0.5 * 4.5 / 25.0, abs=0.03)


@pytest.mark.parametrize("name", ["person", "car"])
def test_a_stage_without_vehicles_that_move_has_no_such_frames(author, rig, tmp_path, name):
    """People drive no camera; parked cars do not move."""
    stage = traffic_stage(author, tmp_path, name)
    if name == "car":
        (tmp_path / "traffic.usda").write_text("#usda 1.0\n")
    with pytest.raises(EnvgenError, match="envgen-usd traffic"):
        render_frames(stage, tmp_path / "frames", 2, rig=rig, trajectory="traffic")

"""Where the camera goes."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.render.cameras.camera_pose import look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.render_scene import Lane
from envgen_usd.render.stage.stage_reader import read_scene
from envgen_usd.render.trajectories.camera_route import Pace, all_lanes, around, drive, routes
from envgen_usd.seeds import generator


def _lane(name, *points, successors=()):
    return Lane(name, np.array(points, float), successors)


def _drive(lanes, camera, frames, spacing, rng):
    return tuple(islice(drive(lanes, camera, Pace(spacing, 10.0), rng), frames))


def test_kitti_360_is_the_default_rig():
    camera = read_rig().reference
    assert (camera.width, camera.height) == (1408, 376)
    assert (camera.fx, camera.cx, camera.cy) == (552.554261, 682.049453, 238.769549)
    assert camera.mount == 1.55


def test_an_unknown_rig_is_an_error_that_names_the_known_ones():
    with pytest.raises(EnvgenError, match="kitti_360"):
        read_rig("hubble")


def test_a_rig_of_ones_own(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("[camera]\nwidth=64\nheight=32\nfx=50.0\nfy=50.0\ncx=31.5\ncy=15.5\n")
    assert read_rig(str(path)).reference.width == 64
    path.write_text("[camera]\nwidth=64\n")
    with pytest.raises(EnvgenError, match=r"camera: missing height, fx, fy, cx, cy$"):
        read_rig(str(path))


def test_clip_space_is_the_pinhole_model():
    camera = read_rig().reference
    rng = np.random.default_rng(0)
    points = rng.uniform((-5, -3, 1), (5, 3, 80), (50, 3))
    clip = np.c_[points, np.ones(50)] @ camera.clip_matrix().T
    ndc = clip[:, :3] / clip[:, 3:]
    u = camera.fx * points[:, 0] / points[:, 2] + camera.cx
    v = camera.fy * points[:, 1] / points[:, 2] + camera.cy
    np.testing.assert_allclose((ndc[:, 0] + 1) * camera.width / 2 - 0.5, u)
    np.testing.assert_allclose((1 - ndc[:, 1]) * camera.height / 2 - 0.5, v)
    np.testing.assert_allclose(camera.near / ndc[:, 2], points[:, 2])


@pytest.mark.parametrize("radius", [8.0, 30.0])
def test_the_camera_looks_along_the_tangent_of_a_bend(radius):
    """The chord between the axles of a car on a circle is parallel to the tangent between them."""
    angle = np.linspace(0, np.pi, 2001)
    way = radius * np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle])
    camera = Camera(64, 32, 50.0, 50.0, 31.5, 15.5, mount=1.55)
    for pose in _drive([Lane("a", way)], camera, 5, 2.0, generator(0)):
        eye, ahead = pose.matrix[:3, 3], pose.matrix[:3, 2]
        spoke = (eye[:2] - (0, radius)) / radius
        assert np.linalg.norm(spoke) == pytest.approx(1, abs=1e-3)
        np.testing.assert_allclose(ahead, [-spoke[1], spoke[0], 0], atol=1e-3)


def test_the_camera_follows_heading_and_pitch_of_its_lane():
    slope = 0.1
    way = np.array([(s, 2 * s, slope * s * np.sqrt(5)) for s in np.linspace(0, 100, 11)])
    camera = Camera(64, 32, 50.0, 50.0, 31.5, 15.5, mount=1.55)
    poses = _drive([Lane("a", way)], camera, 8, 10.0, generator(0))
    assert len(poses) == 8
    for pose in poses:
        right, down, ahead = pose.matrix[:3, :3].T
        expected = np.array([1, 2, slope * np.sqrt(5)]) / np.sqrt(5 + 5 * slope**2)
        np.testing.assert_allclose(ahead, expected, atol=1e-3)
        assert right[2] == 0
        np.testing.assert_allclose(np.cross(right, down), ahead, atol=1e-12)
        x, y, z = pose.matrix[:3, 3]
        assert y == pytest.approx(2 * x, abs=1e-3)
        assert z - 1.55 == pytest.approx(slope * np.hypot(x, y), abs=1e-3)
    steps = np.linalg.norm(np.diff([p.matrix[:3, 3] for p in poses], axis=0), axis=1)
    np.testing.assert_allclose(steps, 10.0, atol=1e-2)


def test_a_route_goes_through_successors_and_never_against_traffic():
    lanes = [
        _lane("a", (0, 0, 0), (50, 0, 0), successors=("b",)),
        _lane("b", (50.8, 0, 0), (100, 0, 0)),
        _lane("against", (100, 0, 0), (50, 0, 0)),
        _lane("cut", (100, 0.1, 0), (150, 0.1, 0)),
    ]
    found = [routes(lanes, generator(seed)) for seed in range(20)]
    ways = {tuple(way[:, 0]) for drawn in found for way in drawn}
    assert ways == {
        (0, 50, 50.8, 100, 150),
        (50.8, 100, 150),
        (50.8, 100),
        (0, 50),
        (0, 50, 50.8, 100),
        (100, 50),
        (100, 150),
    }


def test_every_lane_is_driven_once_and_by_the_seed():
    lanes = [_lane(f"l{i}", (0, 9.0 * i, 0), (60 + i, 9.0 * i, 0)) for i in range(12)]
    ways = [way[0, 1] for way in routes(lanes, generator(1))]
    assert sorted(ways) == [9.0 * i for i in range(12)]
    assert ways == [way[0, 1] for way in routes(lanes, generator(1))]
    assert any(ways != [w[0, 1] for w in routes(lanes, generator(s))] for s in range(2, 6))


def test_short_lanes_are_driven_again_without_a_picture_twice():
    lanes = [_lane("a", (0, 0, 0), (90, 0, 0)), _lane("b", (0, 30, 0), (50, 30, 0))]
    poses = _drive(lanes, read_rig().reference, 70, 10.0, generator(0))
    assert len(poses) == 70
    places = np.array([pose.matrix[:3, 3] for pose in poses])
    assert len(np.unique(places, axis=0)) == 70
    first = sum(pose.turn == 0 for pose in poses)
    assert 8 <= first <= 14
    on_a = np.sort(places[places[:, 1] < 15, 0])
    assert np.diff(on_a).max() <= 10.0 / 4 + 1e-6


def test_a_lane_of_a_metre_does_not_stop_the_drive():
    lanes = [_lane("a", (0, 0, 0), (1, 0, 0))]
    assert len(_drive(lanes, read_rig().reference, 9, 10.0, generator(0))) == 9


def test_without_lanes_there_is_no_drive():
    assert _drive([], read_rig().reference, 9, 10.0, generator(0)) == ()


def test_times_are_those_of_a_car_at_its_speed():
    """On a straight route at 8 m/s, frames of 20 a second lie 0.4 m and 0.05 s apart."""
    lanes = [_lane("a", (0, 0, 0), (60, 0, 0)), _lane("b", (60, 0, 0), (120, 0, 0))]
    poses = tuple(
        islice(drive(lanes, read_rig().reference, Pace(8.0 / 20.0, 8.0), generator(0)), 150)
    )
    route = [pose for pose in poses if pose.route == poses[0].route]
    assert len(route) > 20
    x, t = np.array([(pose.matrix[0, 3], pose.time) for pose in route]).T
    assert t[0] == 0.0
    np.testing.assert_allclose(np.diff(t), 0.05, atol=1e-9)
    np.testing.assert_allclose(x - x[0], 8.0 * t, atol=1e-3)


def test_all_lanes_are_driven_once_in_their_direction_and_by_name():
    lanes = [
        _lane("road_10", (0, 9, 0), (40, 9, 0)),
        _lane("road_2", (40, 0, 0), (0, 0, 0)),
        _lane("stub", (0, 20, 0), (2, 20, 0)),
    ]
    poses = list(all_lanes(lanes, read_rig().reference, Pace(5.0, 10.0)))
    y = [pose.matrix[1, 3] for pose in poses]
    assert y == [0.0] * 8 + [9.0] * 8 + [20.0], "(40 - 2.7) / 5 + 1 places, and the stub's middle"
    assert [pose.route for pose in poses] == [0] * 8 + [1] * 8 + [2]
    ahead = np.array([pose.matrix[0, 2] for pose in poses])
    np.testing.assert_allclose(ahead, [-1] * 8 + [1] * 9)
    x = np.array([pose.matrix[0, 3] for pose in poses])
    np.testing.assert_allclose(np.diff(x[:8]), -5.0, atol=1e-3)
    np.testing.assert_allclose(np.diff(x[8:16]), 5.0, atol=1e-3)
    assert x[-1] == 1.0
    np.testing.assert_allclose([pose.time for pose in poses[:8]], np.arange(8) * 0.5)


def test_the_camera_goes_round_a_stage_without_lanes():
    bounds = np.array([[-3.0, -2.0, 0.0], [5.0, 4.0, 9.0]])
    for pose in around(bounds, read_rig().reference, 8):
        to_middle = bounds.mean(axis=0) - pose.matrix[:3, 3]
        cosine = to_middle @ pose.matrix[:3, 2] / np.linalg.norm(to_middle)
        assert cosine == pytest.approx(1.0, abs=1e-6)


def test_straight_down_has_a_pose():
    matrix = look_at(np.array([0.0, 0.0, 5.0]), np.zeros(3))
    np.testing.assert_allclose(np.linalg.det(matrix[:3, :3]), 1.0)


def test_lanes_are_read_from_the_stage(author):
    write = author(metres=0.01)
    write.lane("/World/Lanes/a", "road_1", [(0, 0, 0), (0, 0, 0), (0, 9000, 100)], ["road_2"])
    write.square("/World/wall", 1000.0, (-50, -50), (50, 50))
    lane = read_scene(write.stage).lanes[0]
    assert (lane.id, lane.successors) == ("road_1", ("road_2",))
    np.testing.assert_allclose(lane.points, [(0, 0, 0), (0, 90, 1)])


def test_the_rig_on_the_page_is_the_one_that_ships(tmp_path):
    page = Path(__file__).parents[2] / "docs" / "render.md"
    text = page.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    (tmp_path / "mine.toml").write_text(text)
    assert read_rig(str(tmp_path / "mine.toml")) == read_rig()

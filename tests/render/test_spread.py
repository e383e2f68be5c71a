"""Frames spread over all lanes."""

from itertools import islice

import numpy as np

from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.render_scene import Lane
from envgen_usd.render.trajectories.pose_jitter import jittered
from envgen_usd.render.trajectories.spread_poses import spread


def lanes():
    """Two lanes of a street of 300 m in opposite directions, and a street of 600 m across."""
    return [
        Lane("a", np.array([[0.0, -2, 0], [300, -2, 0]])),
        Lane("b", np.array([[300.0, 2, 0], [0, 2, 0]])),
        Lane("c", np.array([[150.0, -300, 0], [150, 300, 0]])),
        Lane("stub", np.array([[0.0, 0, 0], [1, 0, 0]])),
    ]


def poses(count, seed=0):
    raw = spread(lanes(), read_rig().reference, np.random.default_rng(seed))
    return tuple(islice(jittered(raw, 1.55, np.random.default_rng(seed)), count))


def test_frames_stand_on_all_lanes_by_length_and_look_along_them():
    found = np.array([pose.matrix for pose in poses(90)])
    eyes, ahead = found[:, :3, 3], found[:, :3, 2]
    across = np.abs(ahead[:, 1]) > 0.7
    west = ~across & (ahead[:, 0] < 0)
    assert 0.35 < across.mean() < 0.65
    assert 0.12 < west.mean() < 0.4
    assert (np.abs(ahead[across, 1]) > 0.95).all()
    assert (np.abs(ahead[~across, 0]) > 0.95).all()
    assert (np.sign(ahead[~across, 0]) == -np.sign(eyes[~across, 1])).mean() > 0.95
    assert np.abs(eyes[:, 2] - 1.55).max() < 0.65


def test_frames_keep_apart_while_there_is_room():
    eyes = np.array([pose.matrix[:2, 3] for pose in poses(60)])
    gaps = np.hypot(*(eyes[:, None] - eyes[None]).transpose(2, 0, 1)) + 1e3 * np.eye(60)
    assert (gaps.min(axis=1) < 5).mean() < 0.04


def test_fewer_frames_are_the_first_of_more():
    for one, other in zip(poses(7), poses(40), strict=False):
        np.testing.assert_array_equal(one.matrix, other.matrix)


def test_every_start_of_the_sequence_covers_the_map():
    for count in (12, 48):
        eyes = np.array([pose.matrix[:2, 3] for pose in poses(count, 5)])
        along = np.sort(eyes[np.abs(eyes[:, 0] - 150) < 1.5, 1])
        assert np.diff(np.concatenate([[-300], along, [300]])).max() < 5 * 600 / max(len(along), 1)


def test_no_lane_is_long_enough():
    assert not list(spread(lanes()[3:], read_rig().reference, np.random.default_rng(0)))

"""Optical flow, against closed forms and against the next frame."""

from dataclasses import replace

import numpy as np

from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.lens_models import KannalaBrandt
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_set import read_frames
from envgen_usd.render.frames.optical_flow import optical_flow
from envgen_usd.render.trajectories.trajectory import Trajectory

CAMERA = Camera(64, 48, 50.0, 60.0, 31.0, 23.0)
ROWS, COLUMNS = np.indices((48, 64)).astype(float)


def _moved(pose, forward=0.0, yaw=0.0):
    """A pose further ahead, turned to the right by radians."""
    turn = np.array([(np.cos(yaw), 0, np.sin(yaw)), (0, 1, 0), (-np.sin(yaw), 0, np.cos(yaw))])
    matrix = pose.matrix.copy()
    matrix[:3, 3] += forward * matrix[:3, 2]
    matrix[:3, :3] = matrix[:3, :3] @ turn
    return Pose(matrix)


def test_driving_ahead_moves_pixels_away_from_the_middle(ahead):
    depth = np.random.default_rng(1).uniform(5.0, 90.0, (48, 64)).astype(np.float32)
    flow = optical_flow(CAMERA, depth, ahead, _moved(ahead, forward=2.0))
    share = 2.0 / (depth - 2.0)
    np.testing.assert_allclose(flow[..., 0], (COLUMNS - 31.0) * share, atol=1e-3)
    np.testing.assert_allclose(flow[..., 1], (ROWS - 23.0) * share, atol=1e-3)


def test_the_sky_moves_with_the_rotation_alone(ahead):
    sky = np.zeros((48, 64), np.float32)
    flow = optical_flow(CAMERA, sky, ahead, _moved(ahead, forward=9.0, yaw=0.1))
    angle = np.arctan((COLUMNS - 31.0) / 50.0)
    np.testing.assert_allclose(flow[..., 0], 50.0 * np.tan(angle - 0.1) + 31.0 - COLUMNS, atol=1e-3)
    assert np.isnan(optical_flow(CAMERA, sky, ahead, None)).all()


def test_what_passes_the_camera_has_no_flow(ahead):
    depth = np.full((48, 64), 5.0, np.float32)
    assert np.isnan(optical_flow(CAMERA, depth, ahead, _moved(ahead, forward=6.0))).all()


def test_a_fisheye_measures_distances(ahead):
    """The lens r = f theta: a turn moves the middle row by the angle."""
    lens = KannalaBrandt("kannala_brandt", k1=0.0, k2=0.0, k3=0.0, k4=0.0)
    camera = replace(CAMERA, lens=lens)
    distance = np.full((48, 64), 7.0, np.float32)
    flow = optical_flow(camera, distance, ahead, _moved(ahead, yaw=0.05))
    np.testing.assert_allclose(flow[23, :, 0], -0.05 * 50.0, atol=1e-3)


def test_flow_leads_to_the_same_object_in_the_next_frame(opengl, street, tmp_path):
    assert opengl
    (tmp_path / "rig.toml").write_text(
        "[camera]\nwidth = 352\nheight = 94\nfx = 138.0\nfy = 138.0\ncx = 170.0\ncy = 59.0\n"
    )
    options = {"rig": str(tmp_path / "rig.toml"), "outputs": ("flow", "depth", "semantic")}
    drive = Trajectory("drive", 1.0)
    render_frames(street, tmp_path / "f", 2, trajectory=drive, **options)
    first, second = read_frames(tmp_path / "f")
    rows, columns = np.indices(first.depth.shape)
    x = np.round(columns + first.flow[..., 0])
    y = np.round(rows + first.flow[..., 1])
    seen = (x >= 0) & (x < 352) & (y >= 0) & (y < 94) & (first.depth > 0.0)
    there = y[seen].astype(int), x[seen].astype(int)
    assert seen.mean() > 0.3
    assert (second.semantic[there] == first.semantic[seen]).mean() > 0.97
    ahead = np.abs(second.depth[there] - (first.depth[seen] - 1.0)) < 0.03 * first.depth[seen]
    assert ahead.mean() > 0.9
    # The last frame has a flow, too: a longer run has the same bytes.
    assert np.isfinite(second.flow).any()
    before = (tmp_path / "f" / "flow" / "000001.flo").read_bytes()
    render_frames(street, tmp_path / "longer", 3, trajectory=drive, **options)
    assert (tmp_path / "longer" / "flow" / "000001.flo").read_bytes() == before


def test_frames_of_no_route_have_no_flow(opengl, street, tmp_path):
    assert opengl
    render_frames(street, tmp_path / "f", 2, rig="camvid", outputs=("flow",))
    assert all(np.isnan(frame.flow).all() for frame in read_frames(tmp_path / "f"))

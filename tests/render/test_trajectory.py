"""Poses from files, random offsets, and places that are left out."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.render.cameras.camera_clearance import refused_places
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.stage.stage_reader import read_scene
from envgen_usd.render.trajectories.pose_jitter import jittered
from envgen_usd.render.trajectories.trajectory import Trajectory, given_places, trajectory_poses
from envgen_usd.render.trajectories.trajectory_file import read_poses


def _file(tmp_path, text, name="poses.csv"):
    (tmp_path / name).write_text(text)
    return tmp_path / name


def _world(author, *, lane=200.0):
    """A road along +y with a lane in its middle."""
    write = author()
    write.mesh(
        "/World/road", [(-9, -9, 0), (9, -9, 0), (9, 300, 0), (-9, 300, 0)], [(0, 1, 2, 3)],
        label="road",
    )  # fmt: skip
    write.lane("/World/Lanes/a", "a", [(0, 0, 0), (0, lane, 0)])
    return write


def _eyes(places):
    return np.array([pose.matrix[:3, 3] for pose in places.poses])


def test_angles_of_a_table(tmp_path):
    text = "x, y, z, yaw, pitch, roll, time\n1,2,3,0,0,0,0\n1,2,3,90,30,,0.5\n0,0,0,0,0,90,1\n"
    level, up, rolled = read_poses(_file(tmp_path, text))
    np.testing.assert_allclose(level.matrix[:3, :3].T, [(0, -1, 0), (0, 0, -1), (1, 0, 0)])
    np.testing.assert_allclose(level.matrix[:3, 3], (1, 2, 3))
    np.testing.assert_allclose(up.matrix[:3, 2], (0, np.sqrt(3) / 2, 0.5), atol=1e-12)
    np.testing.assert_allclose(up.matrix[:3, 0], (1, 0, 0), atol=1e-12)
    right, down, ahead = rolled.matrix[:3, :3].T
    np.testing.assert_allclose(right, (0, 0, -1), atol=1e-12, err_msg="the right side is down")
    np.testing.assert_allclose(np.cross(right, down), ahead, atol=1e-12)
    assert [pose.time for pose in (level, up, rolled)] == [0.0, 0.5, 1.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "missing column x, y, z, yaw; known: x, y, z, yaw, pitch, roll, time, route$"),
        ("x,y,z,yaw\n", "has no poses"),
        ("x,y,z,yaw,tilt\n", "unknown column tilt"),
        ("x,y,z,yaw\n1,2,3,4\n1,2,,4\n", r"poses.csv: row 3: z: expected a number, not ''"),
        ("x,y,z,yaw\n1,2,3,north\n", "row 2: yaw: expected a number, not 'north'"),
        ("x,y,z,yaw\n1,2,3\n", "row 2: yaw: expected a number, not ''"),
        ("x,y,z,yaw\n1,2,3,4,5\n", "row 2: has more values than the header"),
        ("x,y,z,yaw\n1,2,nan,4\n", "row 2: .*finite"),
        ("x,y,z,yaw\n1,2,1e9,4\n", "row 2: lies farther than"),
        ("x,y,z,yaw,route\n1,2,3,4,0.5\n", "row 2: route and turn are whole numbers"),
        ("x,y,z,yaw,time\n1,2,3,4,1\n1,2,3,4,1\n", "pose 1: time 1 s is not after 1 s"),
    ],
)
def test_a_faulty_row_is_named(tmp_path, text, said):
    with pytest.raises(EnvgenError, match=said) as caught:
        read_poses(_file(tmp_path, text))
    assert "poses.csv" in str(caught.value)


EYE = np.eye(4).tolist()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "expected JSON with a table 'frames'"),
        ([], "expected JSON with a table 'frames'"),
        ({"frames": {}}, "no list of poses"),
        ({"frames": [{"camera_to_world": EYE}, {}]}, r"frames\[1\]: missing camera_to_world"),
        ({"frames": [{"camera_to_world": [1, 2]}]}, r"frames\[0\]: .*4 x 4"),
        ({"frames": [{"camera_to_world": "here"}]}, r"frames\[0\]: expected numbers"),
        ({"frames": [{"camera_to_world": (2 * np.eye(4)).tolist()}]}, "no rotation"),
        ({"frames": [{"camera_to_world": np.diag([1, 1, -1, 1]).tolist()}]}, "no rotation"),
    ],
)
def test_a_faulty_pose_of_a_json_file_is_named(tmp_path, content, said):
    text = content if isinstance(content, str) else json.dumps(content)
    with pytest.raises(EnvgenError, match=said) as caught:
        read_poses(_file(tmp_path, text, "mine.json"))
    assert "mine.json" in str(caught.value)


def test_a_missing_file_and_an_unknown_trajectory(street, tmp_path):
    with pytest.raises(EnvgenError, match=r"gone.csv: the trajectory cannot be read: No such file"):
        render_frames(street, tmp_path / "f", trajectory=str(tmp_path / "gone.csv"))
    with pytest.raises(
        EnvgenError, match=r"known: spread, drive, all-lanes, traffic, a .csv file, a .json"
    ):
        render_frames(street, tmp_path / "f", trajectory="flight")
    assert not (tmp_path / "f").exists()


def test_an_earlier_run_is_repeated_from_its_own_cameras(opengl, street, tmp_path):
    """The second run has the poses of the first: the same labels, pixel by pixel."""
    assert opengl
    options = {"rig": "camvid", "outputs": ("semantic", "depth")}
    drive = Trajectory("drive", fps=2.0, speed=9.0, jitter=True)
    render_frames(street, tmp_path / "a", 3, trajectory=drive, **options)
    again = str(tmp_path / "a" / "cameras.json")
    result = render_frames(street, tmp_path / "b", trajectory=again, **options)
    assert result.rendered == 3
    first, second = (json.loads((tmp_path / n / "cameras.json").read_text()) for n in "ab")
    assert first == second
    assert [frame["time"] for frame in first["frames"]] == [0.0, 0.5, 1.0]
    for kind in ("semantic", "depth"):
        for path in (tmp_path / "a" / kind).iterdir():
            assert path.read_bytes() == (tmp_path / "b" / kind / path.name).read_bytes()


def test_offsets_of_a_route_change_gradually_and_independent_places_do_not():
    route = [Pose(look_at(np.array([x, 0.0, 1.5]), np.array([x + 1.0, 0, 1.5]))) for x in
             np.arange(0.0, 4000.0, 1.0)]  # fmt: skip
    apart = [Pose(pose.matrix, number) for number, pose in enumerate(route)]
    for poses, correlation in ((route, np.exp(-1.0 / 15.0)), (apart, 0.0)):
        moved = list(jittered(poses, 1.5, np.random.default_rng(3)))
        aside = -np.array([pose.matrix[1, 3] for pose in moved])
        assert aside.std() == pytest.approx(0.35, rel=0.2)
        assert np.corrcoef(aside[1:], aside[:-1])[0, 1] == pytest.approx(correlation, abs=0.05)
        height = np.array([pose.matrix[2, 3] for pose in moved])
        assert height.std() == pytest.approx(0.15, rel=0.2)
        yaw = np.degrees(np.arcsin([pose.matrix[1, 2] for pose in moved]))
        pitch = np.degrees(np.arcsin([pose.matrix[2, 2] for pose in moved]))
        assert yaw.std() == pytest.approx(4.0, rel=0.2)
        assert pitch.std() == pytest.approx(1.2, rel=0.2)
        turns = np.array([pose.matrix[:3, :3] for pose in moved])
        np.testing.assert_allclose(np.linalg.det(turns), 1.0)
        np.testing.assert_allclose(turns[:, 2, 0], 0.0, atol=1e-12, err_msg="a level horizon")
    few = list(jittered(route[:9], 1.5, np.random.default_rng(3)))
    more = list(jittered(route[:99], 1.5, np.random.default_rng(3)))
    assert all(np.array_equal(a.matrix, b.matrix) for a, b in zip(few, more, strict=False))


def test_jitter_moves_a_drive_but_not_its_route(author):
    scene, camera = read_scene(_world(author).stage), read_rig().reference
    steady = _eyes(trajectory_poses(Trajectory("drive"), scene, camera, 9, 1))
    shaken = _eyes(trajectory_poses(Trajectory("drive", jitter=True), scene, camera, 9, 1))
    calm = _eyes(trajectory_poses(Trajectory(jitter=False), scene, camera, 9, 1))
    assert np.abs(steady[:, 0]).max() == 0.0
    assert np.abs(calm[:, 0]).max() == 0.0
    assert 0.01 < np.abs(shaken[:, 0]).max() <= 1.0
    np.testing.assert_allclose(shaken[:, 1], steady[:, 1], atol=1e-9)


@pytest.mark.parametrize("name", ["spread", "drive", "all-lanes"])
def test_places_in_a_house_give_way_to_the_next_ones(author, name):
    """A house covers the lane from 60 to 120 m: no camera stands within 0.5 m of it."""
    write = _world(author)
    free = _eyes(
        trajectory_poses(Trajectory(name), read_scene(write.stage), read_rig().reference, 90, 2)
    )
    write.box("/World/house", (-5, 60, -1), (5, 120, 30), label="building")
    scene = read_scene(write.stage)
    places = trajectory_poses(Trajectory(name), scene, read_rig().reference, 60, 2)
    eyes = _eyes(places)
    assert not ((eyes[:, 1] > 59.5) & (eyes[:, 1] < 120.5)).any()
    kept = free[(free[:, 1] <= 59.5) | (free[:, 1] >= 120.5)]
    np.testing.assert_array_equal(eyes[: len(kept)], kept[: len(eyes)])
    (issue,) = [issue for issue in places.issues if issue.kind == "render.places"]
    assert str(places.refused) in issue.message
    assert places.refused > 0
    fewer = _eyes(trajectory_poses(Trajectory(name), scene, read_rig().reference, 7, 2))
    np.testing.assert_array_equal(fewer, eyes[:7])


@pytest.mark.parametrize(
    ("low", "high", "label", "refused"),
    [
        ((0.4, -1, 0), (0.6, 1, 3), "building", True),  # a wall 0.4 m to the right
        ((0.6, -1, 0), (0.8, 1, 3), "building", False),
        ((-0.1, 0.4, 0), (0.1, 0.6, 9), "pole", True),  # a pole ahead
        ((-0.1, -0.7, 0), (0.1, -0.45, 9), "pole", True),  # and one behind
        ((0.4, 0.4, 0), (0.5, 0.5, 9), "pole", False),  # 0.57 m away
        ((-3, -3, 1.9), (3, 3, 2.5), "building", True),  # a slab 0.4 m above
        ((-3, -3, 4), (3, 3, 5), "building", False),  # a bridge
        ((-1, -2, 0), (1, 2, 1.2), "static", True),  # 0.3 m above the roof of a car
        ((-1, -2, 0), (1, 2, 1.2), "road", False),  # a road as high
        ((-40, -40, 0), (40, 40, 40), "building", True),  # far inside of a hall
    ],
)
def test_clear_places(author, low, high, label, refused):
    write = author()
    write.box("/World/thing", low, high, label=label)
    scene = read_scene(write.stage)
    pose = Pose(look_at(np.array([0.0, 0.0, 1.5]), np.array([0.0, 1.0, 1.5])))
    places = given_places(partial(refused_places, scene), [pose])
    assert places.refused == refused
    np.testing.assert_array_equal(places.poses[0].matrix, pose.matrix, "given poses stay")
    assert [issue.kind for issue in places.issues] == ["render.places"] * refused


def test_below_the_ground_is_inside(author):
    write = author()
    ground = [(-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0)]
    write.mesh("/World/land", ground, [(0, 1, 2, 3)], label="terrain")
    scene = read_scene(write.stage)
    heights = {-3.0: 1, -0.1: 1, 0.1: 0, 3.0: 0}
    for height, refused in heights.items():
        pose = Pose(look_at(np.array([1.0, 2.0, height]), np.array([1.0, 9.0, height])))
        assert given_places(partial(refused_places, scene), [pose]).refused == refused


def test_a_stage_that_surrounds_the_camera_everywhere_is_drawn_all_the_same(author):
    write = _world(author)
    write.box("/World/hall", (-20, -20, -2), (20, 310, 90), label="building")
    scene = read_scene(write.stage)
    places = trajectory_poses(Trajectory(), scene, read_rig().reference, 30, 0)
    assert (len(places.poses), places.refused) == (30, 0)
    (issue,) = places.issues
    assert issue.message.startswith("all places lie inside")
    few = trajectory_poses(Trajectory(), scene, read_rig().reference, 3, 0)
    np.testing.assert_array_equal(_eyes(few), _eyes(places)[:3])


def test_a_drive_says_how_many_passes_it_needs(author):
    places = trajectory_poses(
        Trajectory("drive"), read_scene(_world(author).stage), read_rig().reference, 50, 0
    )
    assert [issue.kind for issue in places.issues] == ["render.frames"]


def test_no_issue_passes_strictly(opengl, street, tmp_path):
    assert opengl
    lanes = {"trajectory": "all-lanes", "rig": "camvid", "outputs": ("depth",)}
    result = render_frames(street, tmp_path / "f", 2, strict=True, **lanes)
    assert (result.rendered, result.issues) == (2, ())
    poses = _file(tmp_path, "x,y,z,yaw\n13,30,1.5,0\n")
    with pytest.raises(
        EnvgenError, match=r"1 issues, and --strict.*render.places, 1 times: frame 0"
    ):
        render_frames(street, tmp_path / "g", trajectory=str(poses), rig="camvid", strict=True)
    assert not (tmp_path / "g").exists()


def test_the_table_on_the_page_can_be_read(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "render.md").read_text(encoding="utf-8")
    (text,) = [part for part in page.split("```") if part.startswith("\nx, y, z")]
    poses = read_poses(_file(tmp_path, text.lstrip()))
    assert [pose.time for pose in poses] == [0.0, 0.1]
    np.testing.assert_allclose(poses[1].matrix[:3, 3], (12.5, 41.0, 1.55), atol=2e-4)

"""Scans beside images: they agree, go on after a kill, and bad rigs are named."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.datasets import read_scans
from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import label
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.frames import shot_drawing
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_set import read_frames
from envgen_usd.render.frames.scan_export import lidar_shots, scan_issues
from envgen_usd.render.frames.scan_folder import LidarChoice
from envgen_usd.render.lidar.lidar_model import read_lidar_model
from envgen_usd.render.trajectories.trajectory import Trajectory

CAMERA = "width = 400\nheight = 300\nfx = 300.0\nfy = 300.0\ncx = 199.5\ncy = 149.5\n"
FRONT = f'[[camera]]\nname = "front"\nposition = [1.0, 0.0, 1.8]\n{CAMERA}'
BACK = f'[[camera]]\nname = "back"\nposition = [0.5, 0.0, 1.8]\nrotation = [0, 0, 180]\n{CAMERA}'
LIDAR = '[[lidar]]\nname = "roof"\nmodel = "exact.toml"\nposition = [1.0, 0.0, 1.8]\n'
EXACT = """name = "exact"
elevations = [8.0, 6.0, 4.0, 2.0, 1.0, 0.0, -1.0, -2.0, -3.0, -5.0, -8.0, -12.0, -16.0, -20.0]
columns = 900
rate = 10.0
nearest = 0.1
range = 100.0
dim_range = 10000.0
"""


@pytest.fixture
def rig(tmp_path):
    """A rig with a camera and a lidar at one place, that sees without noise."""
    (tmp_path / "exact.toml").write_text(EXACT)
    path = tmp_path / "rig.toml"
    path.write_text(FRONT + LIDAR)
    return str(path)


def files_of(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_points_in_an_image_have_its_depth_and_labels(opengl, street, rig, tmp_path):
    assert opengl
    out = tmp_path / "frames"
    outputs = ("semantic", "instance", "depth", "objects", "lidar")
    options = {"rig": rig, "trajectory": "drive", "lidar": LidarChoice("npy")}
    result = render_frames(street, out, 4, outputs=outputs, **options)
    assert (result.rendered, result.scanned, result.lidars) == (4, 4, ("roof",))
    assert json.loads((out / "cameras.json").read_text())["lidars"][0]["model"] == "exact.toml"
    assert not any(str(tmp_path).encode() in content for content in files_of(out).values())
    table = json.loads((out / "roof" / "lidar.json").read_text())
    total = agreeing = 0
    kinds = set()
    for frame, row in zip(read_frames(out), table["frames"], strict=True):
        points = np.load(out / "roof" / "points" / f"{frame.number:06d}.npy")
        local = np.stack([points[name] for name in "xyz"], axis=1).astype(np.float64)
        to_world = np.array(row["lidar_to_world"])
        world = local @ to_world[:3, :3].T + to_world[:3, 3]
        eye, axes = frame.camera_to_world[:3, 3], frame.camera_to_world[:3, :3]
        seen = (world - eye) @ axes
        u = 300.0 * seen[:, 0] / seen[:, 2] + 199.5
        v = 300.0 * seen[:, 1] / seen[:, 2] + 149.5
        inside = (seen[:, 2] > 0.5) & (np.abs(u - 199.5) < 195) & (np.abs(v - 149.5) < 145)
        x, y = np.round(u[inside]).astype(int), np.round(v[inside]).astype(int)
        around = [frame.instance[y + dy, x + dx] for dy in (-2, 0, 2) for dx in (-2, 0, 2)]
        plain = (np.array(around) == around[4]).all(axis=0)
        total += np.count_nonzero(plain)
        same = points["instance"][inside][plain] == frame.instance[y, x][plain]
        same &= points["semantic"][inside][plain] == frame.semantic[y, x][plain]
        agreeing += np.count_nonzero(same)
        # Depth of a pixel is that of its middle: on the ground, it changes within half a pixel.
        depth, mine = frame.depth[y, x][plain][same], seen[inside, 2][plain][same]
        slack = 0.003 * mine + mine**2 * 0.5 / 300.0 / 1.8
        assert (np.abs(depth - mine) < slack).all()
        kinds |= set(points["semantic"][inside][plain][same].tolist())
        named = json.loads((out / "roof" / "objects" / f"{frame.number:06d}.json").read_text())
        for value, prim in named.items():
            assert frame.objects.get(int(value), prim) == prim
        assert set(map(int, named)) == {v for v in points["instance"].tolist() if v % 10_000_000}
    assert total > 5000
    assert agreeing / total > 0.99
    assert len(kinds) >= 3


def test_files_of_kitti_and_of_numpy_are_read_alike(street, rig, tmp_path):
    """KITTI's files have no numbers of lasers; the elevations of the points tell them."""
    (tmp_path / "exact.toml").write_text(EXACT + "noise = 0.02\nresolution = 0.002\n")
    options = {"rig": rig, "outputs": ("lidar",), "trajectory": "drive"}
    for name in ("kitti", "npy"):
        render_frames(street, tmp_path / name, 2, lidar=LidarChoice(name), **options)
    read, truth = (read_scans(tmp_path / name / "roof") for name in ("kitti", "npy"))
    assert len(read) == len(truth) == 2
    for number, (one, other) in enumerate(zip(read, truth, strict=True)):
        rows = np.load(tmp_path / "npy" / "roof" / "points" / f"{number:06d}.npy")
        for scan in (one, other):
            assert scan.number == number
            for column, name in enumerate(("x", "y", "z", "intensity")):
                np.testing.assert_array_equal(scan.points[:, column], rows[name])
            np.testing.assert_array_equal(scan.rings, rows["ring"])
            np.testing.assert_array_equal(scan.classes, rows["semantic"])
            np.testing.assert_array_equal(scan.instances, rows["instance"])
        assert one.objects == other.objects
        assert len(set(one.rings.tolist())) > 8
        # The road is at z = 0, and the lidar 1.8 m above it: the points are in the world.
        road = one.world[one.classes == label("road").id]
        assert len(road) > 500
        assert np.abs(road[:, 2]).max() < 0.03
    with pytest.raises(EnvgenError, match="read the folder of a lidar: roof"):
        read_scans(tmp_path / "npy")
    render_frames(street, tmp_path / "las", 1, lidar=LidarChoice("las"), **options)
    with pytest.raises(EnvgenError, match="lidar_format kitti or npy, not las"):
        read_scans(tmp_path / "las" / "roof")[0]


def test_scans_alone_need_no_opengl(street, rig, tmp_path, monkeypatch):
    def refused():
        raise AssertionError("OpenGL was opened")

    monkeypatch.setattr(shot_drawing, "open_context", refused)
    result = render_frames(street, tmp_path / "f", 2, rig=rig, outputs=("lidar",))
    assert (result.rendered, result.kept, result.scanned) == (0, 0, 2)
    assert not (tmp_path / "f" / "rgb").exists()
    assert (tmp_path / "f" / "roof" / "labels" / "000001.label").stat().st_size > 1000


def test_an_interrupted_run_goes_on_to_the_same_bytes(street, rig, tmp_path):
    noisy = EXACT + "noise = 0.02\ndrop_out = 0.05\n"
    (tmp_path / "exact.toml").write_text(noisy)
    options = {"rig": rig, "outputs": ("lidar",), "trajectory": "drive"}
    whole, part = tmp_path / "whole", tmp_path / "part"
    render_frames(street, whole, 12, **options)
    render_frames(street, part, 12, numbers=[7, 8], **options)
    (part / "roof" / "points" / "000008.bin").unlink()
    result = render_frames(street, part, 12, numbers=range(6, 12), **options)
    assert (result.scanned, result.scans_kept) == (5, 1)
    result = render_frames(street, part, 12, **options)
    assert (result.scanned, result.scans_kept, result.removed) == (6, 6, 0)
    assert files_of(whole) == files_of(part)


def test_another_stage_sensor_or_drive_removes_scans(street, rig, tmp_path):
    out = tmp_path / "f"
    options = {"rig": rig, "outputs": ("lidar",)}
    render_frames(street, out, 2, **options)
    assert render_frames(street, out, 2, **options).removed == 0
    assert render_frames(street, out, 2, seed=1, **options).removed == 2
    drive = {"trajectory": Trajectory("drive", spacing=7.0), "seed": 1}
    assert render_frames(street, out, 2, **drive, **options).removed == 2
    assert render_frames(street, out, 3, **drive, **options).removed == 0
    drive = {"trajectory": Trajectory("drive", spacing=8.0), "seed": 1}
    assert render_frames(street, out, 2, **drive, **options).removed == 3
    assert render_frames(street, out, 2, seed=1, **options).removed == 2
    las = render_frames(street, out, 2, seed=1, lidar=LidarChoice("las"), **options)
    assert (las.removed, las.scanned) == (2, 2)
    assert not list((out / "roof").glob("*/*.bin"))
    (tmp_path / "exact.toml").write_text(EXACT.replace("columns = 900", "columns = 90"))
    assert render_frames(street, out, 2, seed=1, lidar=LidarChoice("las"), **options).removed == 2
    (tmp_path / "rig.toml").write_text(FRONT + LIDAR.replace("roof", "top"))
    result = render_frames(street, out, 2, seed=1, **options)
    assert (result.removed, result.lidars) == (2, ("top",))
    assert not (out / "roof").exists()


def test_a_run_without_the_output_keeps_scans_and_says_so(opengl, street, rig, tmp_path):
    assert opengl
    out = tmp_path / "f"
    render_frames(street, out, 2, rig=rig, outputs=("lidar",))
    result = render_frames(street, out, 2, rig=rig, outputs=("semantic",))
    assert (result.rendered, result.removed) == (2, 0)
    (issue,) = [each for each in result.issues if each.kind == "render.lidar"]
    assert "--outputs lidar" in issue.action
    assert (out / "roof" / "points" / "000001.bin").is_file()


def test_a_drive_has_motion_and_single_places_have_none(street, rig, tmp_path):
    moving = {"rig": rig, "outputs": ("lidar",), "lidar": LidarChoice("npy", motion=True)}
    drive = render_frames(street, tmp_path / "a", 3, trajectory="drive", **moving)
    assert not [each for each in drive.issues if each.kind == "render.lidar_motion"]
    still = {**moving, "lidar": LidarChoice("npy")}
    render_frames(street, tmp_path / "b", 3, trajectory="drive", **still)
    fronts = np.array([20.0, 40.0, 50.0, 70.0, 80.0, 100.0])
    count = 0
    for run, speed in (("a", 10.0), ("b", 0.0)):
        rows = json.loads((tmp_path / run / "roof" / "lidar.json").read_text())["frames"]
        for row in rows:
            points = np.load(tmp_path / run / "roof" / "points" / f"{row['frame']:06d}.npy")
            # The road leads along y; fronts of houses are across it, further out than 6.01 m.
            houses = points[(points["semantic"] == 11) & (np.abs(points["y"]) > 6.01)]
            along = row["lidar_to_world"][1][3] + houses["x"] + speed * houses["time"]
            gaps = np.abs(along[:, None] - fronts).min(axis=1)
            flat = houses["z"] < 6.5  # below the roof, 9 m above the road
            assert gaps[flat].max() < 0.01
            count += np.count_nonzero(flat)
    assert count > 500
    spread = render_frames(street, tmp_path / "c", 2, **moving)
    (issue,) = [each for each in spread.issues if each.kind == "render.lidar_motion"]
    assert issue.message.startswith("2 of 2 frames")


def test_a_laser_beyond_the_near_infrared_is_told(rig):
    sensors, scene = read_rig(rig), SimpleNamespace(scene_objects=())
    for length, count in ((0.0, 0), (850.0, 0), (905.0, 0), (1550.0, 1)):
        model = replace(read_lidar_model("HDL-64E"), wavelength=length)
        pose = Pose(sensors.camera[0].vehicle_from_camera, route=0)
        shots = lidar_shots(
            sensors, {"roof": model}, {"roof": None}, [pose], 1, LidarChoice(), range(1)
        )
        kinds = [each.kind for each in scan_issues(sensors, scene, shots, LidarChoice())]
        assert kinds.count("render.lidar_wavelength") == count


def test_motion_is_that_of_one_drive(rig):
    """Two drives of two frames and one of a single frame; poses of no drive have no motion."""
    sensors = read_rig(rig)
    places = [(0.0, 0, 0.0), (2.0, 0, 0.1), (50.0, 1, 0.0), (51.0, 1, 0.1), (90.0, 2, 0.5)]
    poses = []
    for x, route, time in places:
        matrix = sensors.camera[0].vehicle_from_camera.copy()
        matrix[0, 3] += x
        poses.append(Pose(matrix, route=route, time=time))
    poses.append(Pose(poses[-1].matrix, route=2))
    model = {"roof": read_lidar_model("HDL-64E")}
    choice = LidarChoice(motion=True)
    (shot,) = lidar_shots(sensors, model, {"roof": None}, poses, 6, choice, range(6))
    speeds = [None if each is None else each.shift[0] for each in shot.motions]
    assert speeds == pytest.approx([20.0, 20.0, 10.0, 10.0, None, None])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (FRONT, "lidar: the rig has none; leave lidar out of the outputs"),
        (FRONT + LIDAR.replace("exact.toml", "HDL-65E"), "lidar[0]: model: unknown lidar HDL-65E"),
        (FRONT + LIDAR.replace('model = "exact.toml"\n', ""), "lidar[0]: model: is missing; known"),
        (FRONT + LIDAR.replace("roof", "depth"), "lidar[0]: name: depth is the folder of a kind"),
        (FRONT + LIDAR.replace("exact", "none"), "none.toml: cannot be read"),
        (FRONT + LIDAR.replace("exact", "flat"), "flat.toml: range: expected a number from 1"),
    ],
)
def test_a_rig_that_cannot_scan_is_named(street, rig, tmp_path, text, said):
    (tmp_path / "flat.toml").write_text(EXACT.replace("range = 100.0", "range = 0"))
    (tmp_path / "rig.toml").write_text(text)
    command = ["render", str(street), "--rig", rig, "--outputs", "lidar", "--out"]
    result = CliRunner().invoke(app, [*command, str(tmp_path / "f")])
    assert isinstance(result.exception, EnvgenError)
    assert str(result.exception).startswith(rig)
    assert said in str(result.exception)
    assert not (tmp_path / "f").exists()


def test_an_unknown_format_is_named(street, rig, tmp_path):
    with pytest.raises(EnvgenError, match="unknown lidar format pcd; known: kitti, npy, las"):
        render_frames(street, tmp_path, 1, rig=rig, outputs=("lidar",), lidar=LidarChoice("pcd"))


def test_the_command_scans_and_says_where(street, rig, tmp_path):
    out = tmp_path / "f"
    options = ["--rig", rig, "--outputs", "lidar", "--lidar-format", "las", "--frames", "1"]
    CliRunner().invoke(
        app, ["render", str(street), *options, "--out", str(out)], catch_exceptions=False
    )
    assert (out / "roof" / "points" / "000000.las").is_file()

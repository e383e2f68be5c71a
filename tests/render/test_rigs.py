"""Rigs: cameras and lidars of a vehicle, their folders, and their prims."""

import json
import re
from importlib import resources

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom

from envgen_usd.errors import EnvgenError
from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_set import read_frames
from envgen_usd.render.stage.stage_reader import open_stage, read_scene
from envgen_usd.render.trajectories.trajectory import Trajectory, trajectory_poses

CAMERA = "width = 64\nheight = 48\nfx = 40.0\nfy = 44.0\ncx = 30.0\ncy = 25.0\n"
FRONT = f'[[camera]]\nname = "front"\nposition = [1.7, 0.0, 1.5]\n{CAMERA}'
LEFT = f'[[camera]]\nname = "left"\nposition = [0.8, 0.3, 1.9]\nrotation = [0, 0, 90]\n{CAMERA}'
FISHEYE = f'{LEFT}lens = {{ model = "kannala_brandt", k1 = 0.01 }}\n'
LIDAR = '[[lidar]]\nname = "roof"\nmodel = "HDL-32E"\nposition = [0.9, 0.0, 1.9]\n'


def read(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return read_rig(str(path))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (LIDAR, "camera: expected at least one camera"),
        ("camera = []", "camera: expected at least one camera"),
        (FRONT + LEFT.replace("left", "Front"), "camera[1]: name: Front is the name of camera[0]"),
        (FRONT + LIDAR.replace("roof", "front"), "lidar[0]: name: front is the name of camera[0]"),
        (FRONT.replace("front", "a/b"), "camera[0]: name: expected letters, digits and _, not 'a/"),
        (FRONT.replace("1.7, ", ""), "camera[0]: position: expected 3 numbers"),
        (FRONT.replace("1.7", "nan"), "camera[0]: position: expected 3 numbers"),
        (FRONT.replace("fx = 40.0", "fx = nan"), "camera[0]: fx: expected a number from 1 to"),
        (FRONT.replace("width = 64", "width = 0"), "camera[0]: width: expected a whole number"),
        (FRONT + "zoom = 2\n", "camera[0]: unknown zoom; known: width"),
        (
            FRONT + 'lens = { model = "anamorphic" }',
            "camera[0]: lens: model: expected one of p",
        ),
        (FRONT + 'lens = { model = "mei" }', "camera[0]: lens: missing xi"),
        (
            FRONT + 'lens = { model = "mei", xi = 1, k3 = 1 }',
            "camera[0]: lens: unknown k3",
        ),
        (FRONT + 'lens = { model = "mei", xi = 1, field = 300 }', "lens: field: expected a number"),
        (FRONT + LIDAR + "channels = 32\n", "lidar[0]: unknown channels"),
    ],
)
def test_a_broken_rig_is_named_with_file_and_key(tmp_path, text, said):
    with pytest.raises(EnvgenError, match=re.escape(said)) as caught:
        read(tmp_path, text)
    assert str(caught.value).startswith(str(tmp_path / "mine.toml"))


SHIPPED = sorted(
    file.name.removesuffix(".toml")
    for file in (resources.files("envgen_usd.renders") / "rigs").iterdir()
)


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_rig_is_read(name):
    rig = read_rig(name)
    for camera in rig.camera:
        axes = camera.vehicle_from_camera[:3, :3]
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        assert 1.0 < camera.vehicle_from_camera[2, 3] < 2.5


def test_the_rotation_is_that_of_iso_8855(tmp_path):
    """A positive yaw turns left, a positive pitch lowers the view, a positive roll the right."""
    turned = FRONT + "rotation = [%s]\n"
    views = {"0, 0, 90": (0, 1, 0), "0, 10, 0": (np.cos(0.1745329), 0, -np.sin(0.1745329))}
    for rotation, ahead in views.items():
        (camera,) = read(tmp_path, turned % rotation).camera
        np.testing.assert_allclose(camera.vehicle_from_camera[:3, 2], ahead, atol=1e-6)
    (camera,) = read(tmp_path, turned % "10, 0, 0").camera
    assert camera.vehicle_from_camera[2, 0] == pytest.approx(-np.sin(np.radians(10)))


def test_nuscenes_has_the_quaternions_of_its_table():
    """CAM_FRONT_LEFT: rotation (w, x, y, z) of calibrated_sensor."""
    w, x, y, z = 0.6757265034669446, -0.6736266522251881, 0.21214015046209478, -0.21122827103904068
    expected = Gf.Matrix3d(Gf.Quatd(w, x, y, z))
    camera = next(c for c in read_rig("nuscenes").camera if c.name == "CAM_FRONT_LEFT")
    axes = camera.vehicle_from_camera[:3, :3]
    np.testing.assert_allclose(axes.T, np.array(expected), atol=1e-5)


def test_kitti_360_has_its_calibration():
    """The fisheyes look to the left and right; the baseline of the others is 0.594 m."""
    zero, one, two, three = (c.vehicle_from_camera for c in read_rig("kitti_360_rig").camera)
    assert np.linalg.norm(zero[:3, 3] - one[:3, 3]) == pytest.approx(0.5942, abs=1e-3)
    np.testing.assert_allclose(zero[:3, :3], one[:3, :3], atol=1e-4)
    assert zero[2, 3] == 1.55
    assert (two[1, 2], three[1, 2]) == pytest.approx((1.0, -1.0), abs=2e-3)
    # image_02 in calib_cam_to_pose.txt; that frame has y to the right and z down.
    row = (0.9995185086, 0.0041276589, -0.0307524527)
    np.testing.assert_allclose(two[0, :3], row, atol=1e-4)


def test_every_camera_of_a_rig_must_have_room(tmp_path, street):
    """The right camera passes through houses 6 to 16 m beside the lane, 30 m apart."""
    scene, box = read_scene(open_stage(street)), FRONT.replace("[1.7, 0.0, 1.5]", "[1.35, -8, 2]")
    rig = read(tmp_path, FRONT + box.replace("front", "right"))
    way, lead = Trajectory("drive", spacing=5.0), rig.reference
    free = trajectory_poses(way, scene, lead, 20, 0)
    both = trajectory_poses(way, scene, lead, 20, 0, rig.eyes(lead))
    assert free.refused == 0
    assert both.refused >= 4
    for pose in rig.camera_poses(rig.camera[1], both.poses, lead):
        x, y, _ = pose.matrix[:3, 3]
        assert x == pytest.approx(10.0, abs=0.01)
        assert all(not low - 0.5 < y < low + 20.5 for low in (20, 50, 80))


def test_cameras_of_a_rig_share_their_settings_but_no_noise(opengl, street, tmp_path):
    """Two cameras at one place: the same picture but for the noise."""
    assert opengl
    path = tmp_path / "mine.toml"
    path.write_text(FRONT + FRONT.replace("front", "twin"))
    render_frames(street, tmp_path / "f", 1, rig=str(path), outputs=("rgb",))
    one, other = (read_frames(tmp_path / "f" / name)[0].rgb for name in ("front", "twin"))
    assert (one != other).any()
    assert abs(one.mean() - other.mean()) < 1.0
    assert np.abs(one.astype(float) - other).mean() < 12.0


def test_a_rig_places_its_headlamps(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(FRONT)
    assert len(read_rig(str(path)).headlamps) == 2
    path.write_text("headlamps = []\n" + FRONT)
    assert read_rig(str(path)).headlamps == ()
    path.write_text("headlamps = [[3.0, 0.0, 0.6], [3, 1, 1], [3, 2, 1]]\n" + FRONT)
    with pytest.raises(EnvgenError, match="headlamps"):
        read_rig(str(path))


def test_several_cameras_have_a_folder_each(opengl, street, tmp_path):
    assert opengl
    out, path = tmp_path / "frames", tmp_path / "mine.toml"
    path.write_text(FRONT + FISHEYE + LIDAR)
    options = {"rig": str(path), "trajectory": "drive", "outputs": ("semantic", "rgb", "depth")}
    result = render_frames(street, out, 3, **options)
    assert (result.rendered, result.cameras) == (6, ("front", "left"))
    assert [issue.kind for issue in result.issues].count("render.lidar") == 1
    with pytest.raises(EnvgenError, match="several cameras; read the folder of one: front, left"):
        read_frames(out)
    front, left = read_frames(out / "front"), read_frames(out / "left")
    assert (len(front), len(left)) == (3, 3)
    assert left.camera.lens.model == "kannala_brandt"
    table = json.loads((out / "cameras.json").read_text())
    assert [row["name"] for row in table["cameras"]] == ["front", "left"]
    assert table["lidars"][0]["vehicle_from_lidar"][2][3] == 1.9
    assert "from the camera" in table["cameras"][1]["depth"]
    for row, one, other in zip(table["frames"], front, left, strict=True):
        vehicle = np.array(row["vehicle_to_world"])
        for calibration, frame in zip(table["cameras"], (one, other), strict=True):
            expected = vehicle @ np.array(calibration["vehicle_from_camera"])
            np.testing.assert_allclose(frame.camera_to_world, expected, atol=3e-4)
        # The left camera looks to the left, and the vehicle stands on the road.
        ahead, side = one.camera_to_world[:3, 2], other.camera_to_world[:3, 2]
        np.testing.assert_allclose(np.cross((0, 0, 1), ahead), side, atol=1e-6)
        assert vehicle[2, 3] == pytest.approx(0.0, abs=1e-3)
    (out / "left" / "rgb" / "000001.png").unlink()
    again = render_frames(street, out, 3, **options)
    assert (again.rendered, again.kept, again.removed) == (1, 5, 0)


def test_other_cameras_remove_the_frames_of_the_former(opengl, street, tmp_path):
    assert opengl
    out, path = tmp_path / "frames", tmp_path / "mine.toml"
    options = {"rig": str(path), "outputs": ("semantic",)}
    path.write_text(FRONT)
    render_frames(street, out, 2, **options)
    assert (out / "semantic" / "000001.png").is_file()
    path.write_text(FRONT + LEFT)
    result = render_frames(street, out, 2, **options)
    assert (result.rendered, result.removed) == (4, 2)
    assert not (out / "semantic").exists()
    path.write_text(LEFT)
    result = render_frames(street, out, 2, **options)
    assert (result.rendered, result.removed) == (2, 4)
    assert not (out / "front").exists()
    assert len(read_frames(out)) == 2


def test_given_poses_are_those_of_the_first_camera(opengl, street, tmp_path):
    assert opengl
    path = tmp_path / "mine.toml"
    path.write_text(LEFT + FRONT)
    render_frames(street, tmp_path / "a", 2, rig=str(path), outputs=("semantic",))
    trajectory = str(tmp_path / "a" / "cameras.json")
    options = {"rig": str(path), "outputs": ("semantic",), "trajectory": trajectory}
    render_frames(street, tmp_path / "b", 2, **options)
    for name in ("left", "front"):
        one, other = (read_frames(tmp_path / run / name) for run in "ab")
        for number in range(2):
            places = one[number].camera_to_world, other[number].camera_to_world
            np.testing.assert_allclose(*places, atol=3e-4)


@pytest.mark.parametrize(("metres", "up"), [(1.0, "Z"), (0.01, "Y")])
def test_the_cameras_on_the_stage_see_what_the_images_show(opengl, author, tmp_path, metres, up):
    """A point of the world has the same pixel by the intrinsics and by the prim's frustum."""
    assert opengl
    write = author(tmp_path / "stage.usda", metres=metres, up=up)
    write.box("/World/box", (-900, -900, -900), (-899, -899, -899), label="building")
    write.stage.Save()
    rig, out = tmp_path / "mine.toml", tmp_path / "frames"
    rig.write_text(FRONT + LEFT + LIDAR)
    render_frames(tmp_path / "stage.usda", out, 2, rig=str(rig), outputs=("semantic",))
    stage = Usd.Stage.Open(str(out / "cameras.usda"))
    assert stage.GetPrimAtPath("/World/box")
    assert stage.GetPrimAtPath("/Rig/roof").GetAttribute("userProperties:sensor").Get() == "lidar"
    lamp = UsdGeom.Xformable(stage.GetPrimAtPath("/Rig/headlamp_1"))
    beam = np.array(lamp.ComputeLocalToWorldTransform(0)).T
    vehicle = np.array(UsdGeom.Xformable(stage.GetPrimAtPath("/Rig")).GetLocalTransformation(0)).T
    x, y, z = np.linalg.inv(vehicle[:3, :3]) @ (beam[:3, 3] - vehicle[:3, 3]) * metres
    assert (x, y, z) == pytest.approx((3.5, -0.6, 0.65), abs=1e-5)
    ahead, _, high = np.linalg.inv(vehicle[:3, :3]) @ -beam[:3, 2]
    assert np.degrees(np.arctan2(-high, ahead)) == pytest.approx(2.0, abs=0.01)
    for name in ("front", "left"):
        frames = read_frames(out / name)
        for frame in frames:
            prim = UsdGeom.Camera(stage.GetPrimAtPath(f"/Rig/{name}"))
            frustum = prim.GetCamera(frame.number).frustum
            to_clip = frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()
            for local in np.array([(0.5, -0.3, 2.0), (-2.0, 1.0, 6.0), (0.0, 0.0, 40.0)]):
                world = frame.camera_to_world[:3, :3] @ local + frame.camera_to_world[:3, 3]
                if up == "Y":
                    world = np.array([world[0], world[2], -world[1]])
                x, y, _ = to_clip.Transform(Gf.Vec3d(*(world / metres)))
                camera = frames.camera
                u = (x + 1.0) * camera.width / 2.0 - 0.5
                v = (1.0 - y) * camera.height / 2.0 - 0.5
                assert u == pytest.approx(camera.fx * local[0] / local[2] + camera.cx, abs=0.02)
                assert v == pytest.approx(camera.fy * local[1] / local[2] + camera.cy, abs=0.02)

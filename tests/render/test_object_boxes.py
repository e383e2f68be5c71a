"""Boxes of objects, against closed forms."""

import json

import numpy as np
import pytest
from pxr import UsdGeom

from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_set import read_frames
from envgen_usd.render.frames.object_boxes import image_box, world_box

RIG = "[camera]\nwidth = 200\nheight = 100\nfx = 100.0\nfy = 100.0\ncx = 99.5\ncy = 49.5\n"
CAMERA = Camera(200, 100, 100.0, 100.0, 99.5, 49.5)


def _object(write, name, parts, label="building"):
    prim = UsdGeom.Xform.Define(write.stage, f"/World/{name}").GetPrim()
    write.kind(prim, "component")
    write.label(prim, label)
    for number, (y, low, high) in enumerate(parts):
        write.square(f"/World/{name}/part{number}", y, low, high)


@pytest.fixture
def boxes(opengl, author, tmp_path, ahead):
    """Draws a frame of a new stage; returns its boxes by the names of their prims."""
    assert opengl

    def drawn(fill):
        write = author(tmp_path / "stage.usda")
        fill(write)
        write.stage.Save()
        (tmp_path / "rig.toml").write_text(RIG)
        rig = str(tmp_path / "rig.toml")
        outputs = ("boxes", "instance")
        render_frames(
            tmp_path / "stage.usda", tmp_path / "f", rig=rig, poses=[ahead], outputs=outputs
        )
        rows = read_frames(tmp_path / "f")[0].boxes
        return {row["path"].rsplit("/", 1)[1]: row for row in rows}

    return drawn


def test_an_object_half_behind_another_one(boxes):
    def fill(write):
        _object(write, "back", [(20.0, (-2, -2), (2, 2))])
        _object(write, "front", [(10.0, (0, -2), (1, 2))])

    found = boxes(fill)
    back, front = found["back"], found["front"]
    assert back["visible"] == [90, 40, 100, 60]
    assert back["full"] == pytest.approx([90, 40, 110, 60], abs=0.01)
    assert (back["pixels"], back["occlusion"], back["truncation"]) == (200, 0.5, 0.0)
    assert front["visible"] == [100, 30, 110, 70]
    assert (front["occlusion"], front["truncation"]) == (0.0, 0.0)
    assert back["class"] == "building"
    assert back["instance"] // 10_000_000 == 11


def test_a_simple_mesh_that_reaches_farther_lies_in_the_box(boxes):
    """At 20 m the simple mesh is drawn, 4 m wide in place of 2 m: 20 pixels."""

    def fill(write):
        _object(write, "tree", [(20.0, (-1, -1), (1, 1))], label="vegetation")
        far = write.square("/World/tree/far", 20.0, (-2, -2), (2, 2))
        far.CreatePurposeAttr("proxy")
        near = UsdGeom.Imageable(write.stage.GetPrimAtPath("/World/tree/part0"))
        near.CreateProxyPrimRel().SetTargets([far.GetPath()])

    tree = boxes(fill)["tree"]
    assert tree["visible"] == [90, 40, 110, 60]
    assert tree["full"] == pytest.approx([90.5, 40.5, 109.5, 59.5], abs=0.01)
    assert (tree["truncation"], tree["occlusion"]) == (0.0, 0.0)


def test_an_object_beyond_the_border_is_truncated(boxes):
    found = boxes(lambda write: _object(write, "wide", [(10.0, (5, -2), (20, 2))]))["wide"]
    assert found["visible"] == [150, 30, 200, 70]
    assert found["full"] == pytest.approx([150, 30, 300, 70], abs=0.01)
    assert found["truncation"] == pytest.approx(2 / 3, abs=1e-3)
    assert found["occlusion"] == 0.0


def test_parts_of_an_object_are_counted_once(boxes):
    """A part in front of another part of the same object hides nothing of the object."""
    parts = [(20.0, (-2, -2), (2, 2)), (10.0, (-0.5, -0.5), (0.5, 0.5))]
    found = boxes(lambda write: _object(write, "house", parts))["house"]
    assert (found["pixels"], found["occlusion"]) == (400, 0.0)
    assert found["box_3d"]["centre"] == [0.0, 15.0, 0.0]
    assert sorted(found["box_3d"]["size"]) == [4.0, 4.0, 10.0]
    assert abs(found["box_3d"]["yaw"]) == pytest.approx(np.pi / 2, abs=1e-4)


def test_boxes_of_a_street_follow_from_its_numbers(opengl, street, tmp_path):
    assert opengl
    (tmp_path / "rig.toml").write_text(RIG)
    options = {"rig": str(tmp_path / "rig.toml"), "trajectory": "drive"}
    render_frames(street, tmp_path / "f", 1, outputs=("boxes", "instance"), **options)
    frame = read_frames(tmp_path / "f")[0]
    rows = {row["path"]: row for row in frame.boxes}
    assert {row["instance"] for row in frame.boxes} == {
        value for value in np.unique(frame.instance).tolist() if value % 10_000_000
    }
    for index in range(3):
        row = rows.get(f"/World/Houses/h{index}")
        if row is None:
            continue
        assert row["box_3d"]["centre"] == [13.0, 30.0 + 30 * index, 4.5]
        assert row["box_3d"]["size"] == [20.0, 10.0, 9.0]
        assert (frame.instance == row["instance"]).sum() == row["pixels"]
        low, high = np.array((8, 20 + 30 * index, 0)), np.array((18, 40 + 30 * index, 9))
        corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
        matrix = frame.camera_to_world
        x, y, z = ((corners - matrix[:3, 3]) @ matrix[:3, :3]).T
        if (z > 0.3).all():
            u, v = 100.0 * x / z + 100.0, 100.0 * y / z + 50.0
            assert row["full"] == pytest.approx([u.min(), v.min(), u.max(), v.max()], abs=0.02)


def test_what_lies_behind_the_camera_is_cut_off(ahead):
    """A wall from 5 m behind to 10 m ahead, 2 m to the right: it begins at the near plane."""
    wall = np.array([(2.0, y, z) for y in (-5.0, 10.0) for z in (-1.0, 3.0)])
    left, top, right, bottom = image_box(CAMERA, ahead, [wall])
    near = 0.3
    assert left == pytest.approx(100 * 2 / 10 + 100)
    assert right == pytest.approx(100 * 2 / near + 100)
    assert (top, bottom) == pytest.approx((50 - 100 * 3 / near, 50 + 100 * 1 / near))


@pytest.mark.parametrize("seed", range(8))
def test_the_least_box_of_a_turned_cuboid_is_the_cuboid(seed):
    rng = np.random.default_rng(seed)
    length, width, height = np.sort(rng.uniform(0.5, 9.0, 3))[::-1] if seed else (4.0, 2.0, 0.0)
    yaw, centre = rng.uniform(-1.5, 1.5), rng.uniform(-50, 50, 3)
    local = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2.0
    inner = rng.uniform(-0.5, 0.5, (40, 3))
    turn = np.array([(np.cos(yaw), -np.sin(yaw), 0), (np.sin(yaw), np.cos(yaw), 0), (0, 0, 1)])
    points = np.concatenate((local, inner)) * (length, width, height) @ turn.T + centre
    box = world_box(points)
    assert box.centre == pytest.approx(centre)
    assert box.size == pytest.approx((length, width, height))
    assert box.yaw == pytest.approx(yaw)


def test_the_box_of_a_line_has_no_width():
    box = world_box(np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (3.0, 3.0, 2.0)]))
    assert box.size == pytest.approx((np.hypot(3, 3), 0.0, 2.0), abs=1e-6)
    assert box.yaw == pytest.approx(np.pi / 4)
    assert world_box(np.ones((3, 3))).size == (0.0, 0.0, 0.0)


def test_boxes_do_not_depend_on_other_frames(opengl, street, tmp_path):
    assert opengl
    (tmp_path / "rig.toml").write_text(RIG)
    options = {"rig": str(tmp_path / "rig.toml"), "trajectory": "drive", "outputs": ("boxes",)}
    render_frames(street, tmp_path / "all", 3, **options)
    render_frames(street, tmp_path / "one", 3, numbers=[2], **options)
    files = [(tmp_path / name / "boxes" / "000002.json").read_text() for name in ("all", "one")]
    assert files[0] == files[1]
    assert len(json.loads(files[0])) > 1
    assert not (tmp_path / "one" / "boxes" / "000001.json").exists()

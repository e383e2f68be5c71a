"""Normals of surfaces, by closed forms."""

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
import rasterio
from PIL import Image

from envgen_usd.label_taxonomy import label
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.lens_models import KannalaBrandt
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_set import read_frames
from envgen_usd.render.frames.image_files import write_normals
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.stage.stage_reader import read_scene

CAMERA = Camera(200, 120, 110.0, 90.0, 97.0, 64.5)


@pytest.fixture
def normals(opengl):
    """Draws the normals of a stage, in camera space."""
    assert opengl

    def draw(stage, pose, camera=CAMERA):
        scene = read_scene(stage)
        with open_context():
            from envgen_usd.render.drawing.lens_drawing import frame_drawing  # noqa: PLC0415 - binds the platform

            drawing = frame_drawing(scene, pack(scene), camera)
            frame = drawing.draw(FrameRequest(pose, colour=False, normals=True))
            assert drawing.draw(FrameRequest(pose, colour=False)).normals is None
        return frame.normals, frame.depth

    return draw


def _rays(camera=CAMERA):
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    ones = np.ones(u.shape)
    return np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, ones], axis=-1)


def _seen_from(eye, target):
    return Pose(look_at(np.array(eye, float), np.array(target, float)))


@pytest.mark.parametrize("tilt", [0.0, 0.3, 5.0])
@pytest.mark.parametrize("far", [4.0, 400.0])
def test_a_plane_has_one_normal(author, normals, tilt, far):
    """The plane z = tilt x from above, up to the horizon."""
    write = author()
    side = 40.0 * far
    corners = [(x, y, tilt * x) for x, y in ((-side, -side), (side, -side), (side, side))]
    corners.append((-side, side, -tilt * side))
    write.mesh("/World/plane", corners, [(0, 1, 2, 3)])
    pose = _seen_from((0.4 * far, 0.0, far * (1 + tilt)), (1.3, far, 0.0))
    found, depth = normals(write.stage, pose)
    expected = np.array([-tilt, 0.0, 1.0]) / np.hypot(1.0, tilt) @ pose.matrix[:3, :3]
    seen = depth > 0
    assert seen.mean() > 0.3
    np.testing.assert_allclose(found[seen], np.broadcast_to(expected, found[seen].shape), atol=1e-5)
    assert (found[~seen] == 0.0).all()


def test_a_box_has_three_normals_that_face_the_camera(author, normals):
    write = author()
    write.box("/World/box", (-1, -1, -1), (1, 1, 1))
    pose = _seen_from((4, 5, 3), (0, 0, 0))
    found, depth = normals(write.stage, pose)
    world = found[depth > 0] @ pose.matrix[:3, :3].T
    axes = np.eye(3)[np.abs(world).argmax(axis=1)]
    np.testing.assert_allclose(world, axes, atol=1e-5)
    assert len(np.unique(axes, axis=0)) == 3


def test_the_back_of_a_leaf_faces_the_camera_too(author, normals):
    write = author()
    write.square("/World/leaf", 5.0, (-9, -9), (9, 9)).CreateDoubleSidedAttr(True)
    for y, ahead in ((0.0, 1.0), (10.0, -1.0)):
        found, depth = normals(write.stage, _seen_from((0, y, 0), (0, y + ahead, 0)))
        assert (depth > 0).all()
        np.testing.assert_allclose(found, np.broadcast_to((0.0, 0.0, -1.0), found.shape), atol=1e-5)


def test_a_sphere_has_radial_normals(author, normals):
    """A face of a sphere of 128 x 256 faces has a corner within 1 degree of its normal.

    The rasteriser rounds corners to parts of a pixel, which moves places on the rim by 0.2 degrees.
    """
    write = author()
    polar, around = np.linspace(0, np.pi, 129)[1:-1], np.linspace(0, 2 * np.pi, 257)[:-1]
    p, a = np.meshgrid(polar, around, indexing="ij")
    points = 2.0 * np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    grid = np.arange(127 * 256).reshape(127, 256)
    nxt = np.roll(grid, -1, axis=1)
    quads = np.stack([grid[:-1], grid[1:], nxt[1:], nxt[:-1]], axis=-1).reshape(-1, 4)
    write.mesh("/World/ball", points.reshape(-1, 3), quads.tolist())
    pose = _seen_from((0, -6, 1), (0, 0, 0))
    found, depth = normals(write.stage, pose)
    seen = depth > 0
    place = (_rays()[seen] * depth[seen][:, None]) @ pose.matrix[:3, :3].T + pose.matrix[:3, 3]
    radial = place / np.linalg.norm(place, axis=1, keepdims=True)
    cosine = (found[seen] @ pose.matrix[:3, :3].T * radial).sum(axis=1)
    angles = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert angles.max() < 1.2
    assert np.median(angles) < 0.6
    assert seen.mean() > 0.1


def test_normals_ignore_authored_ones(author, normals):
    write = author()
    mesh = write.square("/World/wall", 5.0, (-9, -9), (9, 9))
    mesh.CreateNormalsAttr([(0.6, -0.8, 0.0)] * 4)
    mesh.SetNormalsInterpolation("vertex")
    found, _ = normals(write.stage, _seen_from((0, 0, 0), (0, 1, 0)))
    np.testing.assert_allclose(found, np.broadcast_to((0.0, 0.0, -1.0), found.shape), atol=1e-5)


def test_files_hold_16_bits_of_each_part(tmp_path):
    """GDAL reads them: n = (v - 32768) / 32767, as v / 32767.5 - 1 nearly; 0 without a surface."""
    rng = np.random.default_rng(2)
    vectors = rng.normal(size=(7, 9, 3)).astype(np.float32)
    vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
    vectors[3] = 0.0
    write_normals(tmp_path / "n.png", vectors)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        with rasterio.open(tmp_path / "n.png") as image:
            assert image.dtypes == ("uint16",) * 3
            values = image.read().transpose(1, 2, 0)
    assert (values[3] == 0).all()
    for read in ((values - 32768.0) / 32767, values / 32767.5 - 1):
        np.testing.assert_allclose(np.delete(read, 3, 0), np.delete(vectors, 3, 0), atol=5e-5)


def test_rendered_normals_agree_with_depth_and_labels(opengl, street, tmp_path):
    """On flat ground the normal is up; the sky has none."""
    assert opengl
    out = tmp_path / "f"
    kinds = ("normals", "depth", "semantic")
    render_frames(street, out, 2, rig="camvid", trajectory="drive", outputs=kinds)
    assert {path.name for path in out.iterdir() if path.is_dir()} == set(kinds)
    frame = read_frames(out)[1]
    world = frame.normals @ frame.camera_to_world[:3, :3].T
    road, sky = (frame.semantic == label(name).id for name in ("road", "sky"))
    np.testing.assert_allclose(
        world[road], np.broadcast_to((0, 0, 1), world[road].shape), atol=1e-5
    )
    assert (frame.normals[sky] == 0).all()
    np.testing.assert_allclose(np.linalg.norm(frame.normals[~sky], axis=1), 1.0, atol=1e-4)
    assert "normals" in json.loads((out / "cameras.json").read_text())


def test_a_lens_keeps_the_axes_of_its_camera(author, normals):
    """A fisheye sees ground and walls at right angles to its axis."""
    write = author()
    write.box("/World/room", (-3, -3, 0), (3, 3, 4)).CreateOrientationAttr("leftHanded")
    camera = replace(CAMERA, lens=KannalaBrandt("kannala_brandt"))
    pose = _seen_from((0.5, 0.2, 1.5), (0.5, 9.0, 1.2))
    found, depth = normals(write.stage, pose, camera)
    world = found[depth > 0] @ pose.matrix[:3, :3].T
    axes = np.eye(3)[np.abs(world).argmax(axis=1)]
    np.testing.assert_allclose(np.abs(world), axes, atol=1e-5)
    assert len(np.unique(np.round(world), axis=0)) == 5


@pytest.mark.parametrize("share", [0.25, 0.75])
def test_gaps_in_a_crown_have_the_normal_of_what_is_labelled(author, normals, tmp_path, share):
    """Leaves face the camera; the wall behind them is turned by 45 degrees."""
    leaves = np.random.default_rng(0).random((64, 64)) < share
    pixels = np.zeros((256, 256, 4), np.uint8)
    pixels[..., 3] = 255 * np.kron(leaves, np.ones((4, 4), np.uint8))
    Image.fromarray(pixels).save(tmp_path / "leaves.png")
    write = author(tmp_path / "crown.usda")
    crown = write.square("/World/crown", 30.0, (-9, -9), (9, 9), label="vegetation")
    write.uvs(crown, [(-4, -4), (5, -4), (5, 5), (-4, 5)])
    look = write.material("/World/m", texture=tmp_path / "leaves.png", cut=0.5)
    write.bind(crown.GetPrim(), look)
    wall = [(-25.0, 75.0, -40.0), (25.0, 125.0, -40.0), (25.0, 125.0, 40.0), (-25.0, 75.0, 40.0)]
    write.mesh("/World/wall", wall, [(0, 1, 2, 3)], label="building")
    found, depth = normals(write.stage, _seen_from((0, 0, 0), (0, 10, 0)))
    inner = np.s_[45:85, 70:110]
    on_crown = depth[inner] < 35.0
    assert share - 0.1 < on_crown.mean() < share + 0.25
    assert np.abs(found[inner][on_crown] - (0.0, 0.0, -1.0)).max() < 1e-3
    turned = np.abs(found[inner][~on_crown]) - (np.sqrt(0.5), 0.0, np.sqrt(0.5))
    assert np.abs(turned).max(initial=0.0) < 1e-3

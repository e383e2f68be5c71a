"""The path tracer against closed forms, and its camera against that of the drawn labels."""

from dataclasses import replace

import numpy as np
import pytest
from tests.render.half_lit_plate import add_half_lit_plate

from envgen_usd.errors import EnvgenError
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.frames.film import MITSUBA
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.path_tracing import mitsuba_variants
from envgen_usd.render.path_tracing.tracer_geometry import meshes_near
from envgen_usd.render.stage.stage_reader import read_scene

OFF_CENTRE = Camera(width=60, height=40, fx=50.0, fy=50.0, cx=20.0, cy=25.0)
DOWN = Pose(look_at(np.array([0.0, 0.0, 20.0]), np.array([0.0, 0.01, 0.0])))


def air(elevation, power, sky):
    up = np.radians(elevation)
    level = np.full((64, 128, 3), sky, np.float32)
    level[32:] = 0.0
    return Atmosphere(np.array([0.0, -np.cos(up), np.sin(up)]), np.full(3, power), level, 1e9, 0.0)


@pytest.fixture
def trace(opengl):
    """Traces a scene with a camera; skipped without Mitsuba."""
    assert opengl
    pytest.importorskip("mitsuba")

    def shot(scene, camera, pose, light):
        with open_context():
            from envgen_usd.render.path_tracing.path_tracer import PathTracer  # noqa: PLC0415 - binds the platform

            return PathTracer(scene, camera, samples=64).radiance(pose, light)

    return shot


def plane(write, albedo=0.5):
    points = [(-400, -400, 0), (400, -400, 0), (400, 400, 0), (-400, 400, 0)]
    mesh = write.mesh("/World/plane", points, [(0, 1, 2, 3)], label="terrain")
    write.bind(mesh.GetPrim(), write.material("/World/matt", colour=(albedo,) * 3))


@pytest.mark.parametrize(("power", "sky"), [(0.0, 1.0), (60.0, 1.0)])
def test_open_ground_reflects_its_albedo(trace, author, power, sky):
    write = author()
    plane(write)
    traced = trace(read_scene(write.stage), OFF_CENTRE, DOWN, air(60.0, power, sky))
    assert traced.mean() == pytest.approx(0.5, rel=0.08)  # and a little gloss


def test_a_shadow_keeps_the_share_of_the_sky(trace, author):
    """A high roof shades the ground from the sun and from little of the sky."""
    write = author()
    plane(write)
    lit = trace(read_scene(write.stage), OFF_CENTRE, DOWN, air(45.0, 20.0, 2.0))
    # The sun shines from the south at 45 degrees, so the shadow lies as far north as it is high.
    write.box("/World/roof", (-8, -88, 80), (8, -72, 80.1))
    shaded = trace(read_scene(write.stage), OFF_CENTRE, DOWN, air(45.0, 20.0, 2.0))
    of_sky, of_sun = 2.0 * np.pi, 20.0 * np.sin(np.radians(45.0))
    ratio = shaded[20:30, 15:25].mean() / lit[20:30, 15:25].mean()
    assert ratio == pytest.approx(of_sky / (of_sky + of_sun), abs=0.05)


def test_a_surface_emits_the_light_of_its_texture(trace, author, tmp_path):
    write = author()
    add_half_lit_plate(write.stage, tmp_path)
    light = replace(air(45.0, 0.0, 0.01), lamp_unit=3.0)  # white ground has 0.01
    low = Pose(look_at(np.array([0.0, 0.0, 4.0]), np.array([0.0, 0.01, 0.0])))
    traced = trace(read_scene(write.stage), OFF_CENTRE, low, light).mean(axis=2)
    levels = sorted([traced[25, 12], traced[25, 28]])
    np.testing.assert_allclose(levels, [30.0, 60.0], rtol=0.03)


def test_the_camera_is_that_of_the_labels(trace, author, ahead):
    """White boxes before black ground cover the pixels that the labels give to them."""
    write = author()
    black = write.material("/World/black", colour=(0.0, 0.0, 0.0))
    points = [(-90, 1, -1.5), (90, 1, -1.5), (90, 300, -1.5), (-90, 300, -1.5)]
    write.bind(write.mesh("/World/plane", points, [(0, 1, 2, 3)]).GetPrim(), black)
    white = write.material("/World/white", colour=(0.9, 0.9, 0.9))
    for number, x in enumerate((-3.0, 1.0, 6.0)):
        low, high = (x, 12.0 + number, -1.5), (x + 1.5, 14.0 + number, 2.0 - number)
        box = write.box(f"/World/box{number}", low, high, label="building")
        write.bind(box.GetPrim(), white)
    scene = read_scene(write.stage)
    light = air(60.0, 0.0, 1.0)
    traced = trace(scene, OFF_CENTRE, ahead, light).mean(axis=2)
    with open_context():
        from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

        objects = FrameRenderer(scene, pack(scene), OFF_CENTRE).draw(
            FrameRequest(ahead, colour=False)
        )
    labels = np.array([item.label for item in scene.scene_objects])[objects.scene_objects]
    covered = labels == "building"
    ground = ~covered & (labels != "sky")
    assert covered.sum() > 60
    assert traced[covered].mean() > 5 * traced[ground].mean()
    seen = (traced > 0.2) & (labels != "sky")
    assert (seen & covered).sum() / (seen | covered).sum() > 0.85


def test_only_near_objects_are_placed(author):
    write = author()
    write.box("/World/near", (10, -1, -1), (12, 1, 1))
    write.box("/World/far", (500, -1, -1), (502, 1, 1))
    (mesh,) = meshes_near(read_scene(write.stage), np.zeros(3), 100.0).values()
    assert mesh.points[:, 0].min() == pytest.approx(10.0)
    assert mesh.points[:, 0].max() == pytest.approx(12.0)
    assert len(mesh.triangles) == 12


def test_mirrored_placements_keep_their_outside(author):
    """Windings and normals point away from the middle of a mirrored, stretched box."""
    from pxr import Gf, UsdGeom  # noqa: PLC0415

    write = author()
    box = write.box("/World/box", (-1, -1, -1), (1, 1, 1))
    UsdGeom.Xformable(box).AddScaleOp().Set(Gf.Vec3f(-3.0, 1.0, 2.0))
    eye = np.array([5.0, 6.0, 7.0])
    (mesh,) = meshes_near(read_scene(write.stage), eye, 100.0).values()
    corners = mesh.points[mesh.triangles] + eye
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", facing, corners.mean(axis=1)) > 0).all()
    for normals in mesh.normals[mesh.triangles].transpose(1, 0, 2):
        np.testing.assert_allclose(
            normals, facing / np.linalg.norm(facing, axis=1, keepdims=True), atol=1e-6
        )


def test_without_mitsuba_a_line_says_so(monkeypatch, street, tmp_path):
    monkeypatch.setattr(mitsuba_variants.util, "find_spec", lambda _name: None)
    with pytest.raises(EnvgenError, match=r"pip install 'envgen-usd\[mitsuba\]'"):
        render_frames(street, tmp_path / "frames", 1, engine=MITSUBA)


def test_traced_pictures_have_drawn_labels(opengl, street, tmp_path):
    assert opengl
    pytest.importorskip("mitsuba")
    rig = tmp_path / "rig.toml"
    rig.write_text("[camera]\nwidth = 48\nheight = 32\nfx = 30\nfy = 30\ncx = 24\ncy = 16\n")
    result = render_frames(street, tmp_path / "frames", 1, rig=str(rig), engine=MITSUBA)
    assert "Mitsuba" in result.renderer
    assert (tmp_path / "frames" / "rgb" / "000000.png").is_file()
    assert (tmp_path / "frames" / "semantic" / "000000.png").is_file()

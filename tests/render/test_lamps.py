"""Lamps on the stage: illuminance against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from pxr import Gf, Sdf, UsdGeom, UsdLux, UsdShade
from tests.render.half_lit_plate import add_half_lit_plate

from envgen_usd.light.daylight import LUMINANCE
from envgen_usd.light.sky import make_atmosphere
from envgen_usd.light.weather import Moment, read_weather
from envgen_usd.models.atmosphere import STAGE_UNIT
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.lighting.headlamps import headlamps_at
from envgen_usd.render.lighting.sky_texture import LIT_STREET, open_illuminance
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.stage.stage_reader import read_scene

HEIGHT, GREY = 6.0, 0.5
DOWN = Pose(look_at(np.array([0.0, 0.0, 30.0]), np.zeros(3)))


def at_night():
    rng = np.random.default_rng(0)
    sun = np.array([np.cos(-0.6), 0.0, np.sin(-0.6)])
    air = make_atmosphere(Moment.drawn(read_weather("night")), sun, rng, 64)
    return replace(air, wetness=0.0, visibility=1e9)


def at_noon():
    rng = np.random.default_rng(0)
    return make_atmosphere(Moment.drawn(read_weather("clear")), np.array([0.0, 0.6, 0.8]), rng, 64)


def bulb(stage, path="/World/lamp"):
    light = UsdLux.SphereLight.Define(stage, path)
    light.CreateRadiusAttr(0.2)
    light.CreateIntensityAttr(0.15)
    UsdGeom.Xformable(light).AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, HEIGHT))
    return light


def panel(stage):
    light = UsdLux.DiskLight.Define(stage, "/World/lamp")
    light.CreateRadiusAttr(0.2)
    light.CreateIntensityAttr(0.15)
    UsdGeom.Xformable(light).AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, HEIGHT))
    return light


@pytest.fixture
def draw(opengl, author, small_camera):
    """The radiance of a rough grey plane from above, and where each pixel lies."""
    assert opengl

    def shot(air, add):
        write = author()
        points = [(-900, -900, 0), (900, -900, 0), (900, 900, 0), (-900, 900, 0)]
        plane = write.mesh("/World/plane", points, [(0, 1, 2, 3)])
        write.bind(plane.GetPrim(), write.material("/World/grey", colour=(GREY,) * 3))
        add(write.stage)
        scene = read_scene(write.stage)
        with open_context():
            from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

            return (
                FrameRenderer(scene, pack(scene), small_camera)
                .draw(FrameRequest(DOWN, air))
                .radiance
            )

    return shot


def away_of(radiance, camera):
    rows, columns = np.indices(radiance.shape[:2])
    x, y = (columns - camera.cx) / camera.fx * 30.0, (rows - camera.cy) / camera.fy * 30.0
    return np.hypot(x, y)


@pytest.mark.parametrize(("add", "power"), [(bulb, 3), (panel, 4)])
def test_the_ground_below_a_lamp_is_lit_by_its_inverse_square(draw, small_camera, add, power):
    """A sphere lights with I cos / d², a disk with I cos² / d²; I is luminance times area seen."""
    dark = draw(at_night(), lambda _: None).mean(axis=2)
    lit = draw(at_night(), add).mean(axis=2) - dark
    away = away_of(lit, small_camera)
    intensity = 0.15 * STAGE_UNIT * np.pi * 0.2**2  # kcd
    illuminance = intensity / HEIGHT**2 * (1 + (away / HEIGHT) ** 2) ** (-power / 2)
    expected = GREY * illuminance / LIT_STREET
    seen = (away > 1.0) & (away < 10.0)
    np.testing.assert_allclose(lit[seen], expected[seen], rtol=0.1)
    assert np.median(lit[seen] / expected[seen]) == pytest.approx(1.0, abs=0.06)


SCREEN = 25.0  # metres, as UN Regulation 112 measures headlamps
LEAST = {(0.57, -1.15): 10.1, (0.86, -1.72): 10.1, (0.86, 0): 5.1, (1.72, 9): 1.7, (1.72, -9): 1.7}
MOST = {(-0.57, 3.43): 0.35, (0.57, 3.43): 10.6, (0.86, 3.43): 13.2}


def test_headlamps_keep_to_the_regulation_of_low_beams(opengl, author, small_camera):
    """Intensities in kcd at the test points of UN Regulation 112, class B: (degrees down, left)."""
    assert opengl
    write = author()
    points = [(SCREEN, y, z) for y, z in ((9, -9), (-9, -9), (-9, 9), (9, 9))]
    screen = write.mesh("/World/screen", points, [(0, 1, 2, 3)])
    write.bind(screen.GetPrim(), write.material("/World/grey", colour=(GREY,) * 3))
    scene = read_scene(write.stage)
    pose = Pose(look_at(np.zeros(3), np.array([1.0, 0.0, 0.0])))
    lamp = headlamps_at(np.zeros((1, 3)), np.eye(4))
    camera = replace(small_camera, fx=3 * small_camera.fx, fy=3 * small_camera.fy)
    with open_context():
        from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

        drawn = FrameRenderer(scene, pack(scene), camera)
        dark = drawn.draw(FrameRequest(pose, at_night())).radiance
        lit = drawn.draw(FrameRequest(pose, at_night(), headlamps=lamp)).radiance
        by_day = [
            drawn.draw(FrameRequest(pose, at_noon(), headlamps=h)).radiance for h in (None, lamp)
        ]
    np.testing.assert_array_equal(*by_day)

    def intensity(down, left):
        across, below = np.tan(np.radians((-left, down)))
        row, column = round(camera.cy + camera.fy * below), round(camera.cx + camera.fx * across)
        cosine = 1.0 / np.sqrt(1.0 + across**2 + below**2)
        radiance = (lit - dark)[row, column] @ LUMINANCE
        return radiance / GREY * LIT_STREET * SCREEN**2 / cosine**3

    for point, least in LEAST.items():
        assert intensity(*point) >= least, point
    for point, most in MOST.items():
        assert intensity(*point) <= most, point


def test_a_normalized_light_keeps_its_power(draw):
    def small(stage):
        light = bulb(stage)
        light.CreateNormalizeAttr(True)
        light.CreateIntensityAttr(0.15 * 4 * np.pi * 0.2**2)
        light.CreateRadiusAttr(0.01)

    np.testing.assert_allclose(draw(at_night(), small), draw(at_night(), bulb), rtol=1e-3)


def test_a_cone_ends_the_beam(draw, small_camera):
    def spot(stage):
        UsdLux.ShapingAPI.Apply(panel(stage).GetPrim()).CreateShapingConeAngleAttr(30.0)

    dark = draw(at_night(), lambda _: None).mean(axis=2)
    lit = draw(at_night(), spot).mean(axis=2) - dark
    away = away_of(lit, small_camera) / HEIGHT
    assert lit[away < 0.5].min() > 10 * lit[away > 0.65].max()


def test_lamps_are_too_faint_to_see_at_noon(draw):
    np.testing.assert_array_equal(draw(at_noon(), bulb), draw(at_noon(), lambda _: None))


def test_instances_carry_their_lamps(author):
    """A lamp in a class that two instances inherit, one of them twice as large."""
    write = author()
    write.stage.CreateClassPrim("/Post")
    bulb(write.stage, "/Post/lamp")
    for number in (0, 1):
        prim = UsdGeom.Xform.Define(write.stage, f"/World/post{number}").GetPrim()
        prim.GetInherits().AddInherit("/Post")
        prim.SetInstanceable(True)
        UsdGeom.Xformable(prim).AddTranslateOp().Set(Gf.Vec3d(10.0 * number, 0.0, 0.0))
        UsdGeom.Xformable(prim).AddScaleOp().Set(Gf.Vec3f(1.0 + number))
    write.box("/World/box", (0, 0, 0), (1, 1, 1))
    lamps = read_scene(write.stage).lamps
    np.testing.assert_allclose(lamps.places, [(0, 0, HEIGHT), (10, 0, 2 * HEIGHT)])
    np.testing.assert_allclose(lamps.powers[1], 4 * lamps.powers[0])
    np.testing.assert_allclose(lamps.powers[0], 0.15 * np.pi * 0.2**2, rtol=1e-5)


def test_an_emissive_surface_has_its_luminance(draw):
    """A luminous plate of 3 kcd/m² in a street of 20 lx."""

    def plate(stage):
        mesh = UsdGeom.Mesh.Define(stage, "/World/plate")
        mesh.CreatePointsAttr([(-3, -3, 1), (3, -3, 1), (3, 3, 1), (-3, 3, 1)])
        mesh.CreateFaceVertexCountsAttr([4])
        mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
        material = UsdShade.Material.Define(stage, "/World/glow")
        shader = UsdShade.Shader.Define(stage, "/World/glow/Surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set((0, 0, 0))
        shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set((0.15, 0.15, 0.15))
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)

    radiance = draw(at_night(), plate)
    height, width = radiance.shape[:2]
    middle = radiance[height // 2 + 8, width // 2].mean()
    assert middle == pytest.approx(0.15 * STAGE_UNIT * np.pi / LIT_STREET, rel=0.02)


def test_a_lit_room_is_bright_where_its_texture_is(draw, tmp_path):
    radiance = draw(at_night(), lambda stage: add_half_lit_plate(stage, tmp_path))
    row = radiance[radiance.shape[0] // 2].mean(axis=-1)
    middle = radiance.shape[1] // 2
    levels = sorted([row[middle - 8], row[middle + 8]])
    unit = STAGE_UNIT * np.pi / LIT_STREET
    np.testing.assert_allclose(levels, [0.1 * unit, 0.2 * unit], rtol=0.03)


def test_a_night_is_darker_than_a_lit_street():
    assert open_illuminance(at_night()) == pytest.approx(LIT_STREET)
    assert open_illuminance(at_noon()) > 50.0

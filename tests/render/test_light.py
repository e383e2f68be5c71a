"""Light on surfaces against closed forms; the light on the stage and in the picture is the same."""

import numpy as np
import pytest
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from envgen_usd.layers.atmosphere_layer import write_atmosphere
from envgen_usd.light.daylight import LUMINANCE, sun_illuminance
from envgen_usd.light.sky import make_atmosphere
from envgen_usd.light.sky_directions import ground_illuminance, sky_directions
from envgen_usd.light.weather import Moment, read_weathers
from envgen_usd.models.atmosphere import GROUND, Atmosphere
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.stage.stage_reader import read_scene
from envgen_usd.render.stage.sun_and_sky import read_light

TIME = Usd.TimeCode.EarliestTime()
DOWN = Pose(look_at(np.array([0.0, 0.0, 20.0]), np.zeros(3)))


def plain_sky(level, rows=128):
    sky = np.full((rows, 2 * rows, 3), level, np.float32)
    sky[rows // 2 :] = 0.0
    return sky


def atmosphere(sun=(0.0, 0.0, 1.0), power=0.0, sky=1.0, visibility=1e9, wetness=0.0):
    direction = np.array(sun) / np.linalg.norm(sun)
    return Atmosphere(direction, np.full(3, power), plain_sky(sky), visibility, wetness)


def stage_of(folder, seed):
    """A stage with the layer as its only sublayer."""
    write_atmosphere(folder, seed)
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, "Z")
    stage.GetRootLayer().subLayerPaths.append(str(folder / "layers" / "atmosphere.usda"))
    UsdGeom.Xform.Define(stage, "/World")
    return stage


def leaf_of(image, height):
    """Adds a level, grey leaf of 8 by 8 metres at a height; its texture is written to a file."""
    Image.new("RGBA", (8, 8), (180, 180, 180, 255)).save(image)

    def add(write):
        card = [(-4, -4, height), (4, -4, height), (4, 4, height), (-4, 4, height)]
        mesh = write.mesh("/World/leaf", card, [(0, 1, 2, 3)])
        mesh.CreateDoubleSidedAttr(True)
        write.uvs(mesh, [(0, 0), (1, 0), (1, 1), (0, 1)])
        write.bind(mesh.GetPrim(), write.material("/World/look", texture=str(image), cut=0.5))

    return add


@pytest.fixture
def draw(opengl, author, small_camera):
    """Draws a rough grey plane, or more, in an atmosphere; returns the radiance."""
    assert opengl

    def shot(air, add=lambda _: None, grey=0.18, pose=DOWN):
        write = author()
        points = [(-900, -900, 0), (900, -900, 0), (900, 900, 0), (-900, 900, 0)]
        plane = write.mesh("/World/plane", points, [(0, 1, 2, 3)])
        write.bind(plane.GetPrim(), write.material("/World/grey", colour=(grey,) * 3))
        add(write)
        scene = read_scene(write.stage)
        with open_context():
            from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

            return (
                FrameRenderer(scene, pack(scene), small_camera)
                .draw(FrameRequest(pose, air))
                .radiance
            )

    return shot


@pytest.mark.parametrize(("power", "sky"), [(0.0, 1.0), (60.0, 1.0), (60.0, 10.0)])
@pytest.mark.parametrize("elevation", [25.0, 60.0])
def test_open_ground_reflects_its_albedo(draw, power, sky, elevation):
    """Exposure gives a white surface on open ground 1; the rest is a little gloss."""
    up = np.radians(elevation)
    air = atmosphere((np.cos(up), 0.0, np.sin(up)), power, sky)
    radiance = draw(air)[30:70, 60:140]
    assert radiance.mean() == pytest.approx(0.18, rel=0.12)
    assert radiance.std() < 0.02


def test_ground_far_below_a_high_camera_is_in_the_sun(draw):
    air = atmosphere((0.3, 0.0, 0.95), 60.0)
    high = Pose(look_at(np.array([0.0, 0.0, 450.0]), np.array([0.0, 1.0, 0.0])))
    radiance = draw(air, pose=high)[30:70, 60:140]
    assert radiance.mean() == pytest.approx(draw(air)[30:70, 60:140].mean(), rel=0.05)
    assert radiance.std() < 0.02


def test_a_shadow_keeps_the_share_of_the_sky(draw):
    """The ground gets E_sun sin h + E_sky in the sun and E_sky in a shadow in the open."""
    high = np.radians(45.0)
    air = atmosphere((np.cos(high), 0.0, np.sin(high)), 20.0, 2.0)

    def roof(write):
        write.box("/World/roof", (19, -1, 20), (21, 1, 20.1))

    pose = Pose(look_at(np.array([0.0, -12.0, 3.0]), np.zeros(3)))
    lit, shaded = draw(air, pose=pose), draw(air, roof, pose=pose)
    darkest = (shaded / lit).mean(axis=2).min()
    of_sky, of_sun = 2.0 * np.pi, 20.0 * np.sin(high)
    assert darkest == pytest.approx(of_sky / (of_sky + of_sun), abs=0.06)


def test_without_a_sun_all_is_as_with_the_faintest_sun(draw):
    def house(write):
        write.box("/World/house", (4, -3, 0), (9, 3, 8))

    pose = Pose(look_at(np.array([0.0, -14.0, 3.0]), np.array([5.0, 0.0, 2.0])))
    none, faint = (draw(atmosphere((1.0, 0.0, 1.0), sun), house, pose=pose) for sun in (0.0, 1e-6))
    assert none == pytest.approx(faint, abs=1e-3)


def test_black_rough_ground_still_mirrors_some_of_the_sky(draw):
    """Mitsuba's principled BSDF of roughness 1 mirrors 1.3 % from above and 3.7 % at 8 degrees."""
    flat = Pose(look_at(np.array([0.0, 0.0, 1.5]), np.array([0.0, 12.0, 0.0])))
    for pose in (DOWN, flat):
        mirrored = draw(atmosphere(), grey=0.0, pose=pose)[60:]
        assert 0.01 < mirrored.mean() < 0.05


def test_a_wall_loses_the_low_sky_behind_the_houses_opposite(draw):
    """Before a long row whose top stands at 45 degrees, a wall sees 1 - sin 45 of the sky's light.

    The ground reflects `GROUND` of the light of the open sky to the lower half of both walls.
    """

    def wall(write):
        bright = write.material("/World/bright", colour=(0.5,) * 3)
        write.bind(write.box("/World/wall", (-40, 6, 0), (40, 16, 12)).GetPrim(), bright)

    def street(write):
        wall(write)
        write.box("/World/row", (-40, -30, 0), (40, -2, 10.5))

    pose = Pose(look_at(np.array([0.0, 0.0, 2.0]), np.array([0.0, 6.0, 2.0])))
    open_wall, wall_in_street = (draw(atmosphere(), add, pose=pose) for add in (wall, street))
    middle = slice(45, 55), slice(90, 110)
    ratio = wall_in_street[middle].mean() / open_wall[middle].mean()
    of_sky, of_ground = 1.0 - np.sin(np.radians(45.0)), GROUND
    assert ratio == pytest.approx((of_sky + of_ground) / (1.0 + of_ground), abs=0.12)


@pytest.mark.parametrize("height", [4.0, 8.0, 16.0])
def test_the_ground_of_a_street_loses_the_sky_behind_its_rows(draw, height):
    """Amid long rows whose tops stand at an angle a, level ground sees cos a of the sky's light.

    Sunlit walls send a little back, half of `GROUND` at most.
    """

    def street(write):
        for name, x in (("left", -18), ("right", 8)):
            write.box(f"/World/{name}", (x, -90, 0), (x + 10, 90, height))

    low = Pose(look_at(np.array([0.0, 0.0, 3.0]), np.zeros(3)))
    freely, amid = (draw(atmosphere(), add, pose=low) for add in (lambda _: None, street))
    middle = slice(40, 60), slice(80, 120)
    share = amid[middle].mean() / freely[middle].mean()
    seen = np.cos(np.arctan2(height, 8.0))
    assert seen - 0.04 < share < seen + 0.04 + 0.5 * GROUND * (1.0 - seen)


def test_light_comes_in_below_a_crown(draw, tmp_path):
    """Leaves hide what a square above the ground hides (form factor of a rectangle), no column."""
    crown = leaf_of(tmp_path / "leaf.png", height=5)
    below = Pose(look_at(np.array([0.0, -0.5, 2.5]), np.zeros(3)))
    freely, hidden = (draw(atmosphere(), add, pose=below) for add in (lambda _: None, crown))
    middle = slice(40, 60), slice(80, 120)
    share = hidden[middle].mean() / freely[middle].mean()
    side = 4.0 / 5.0
    seen = 1.0 - 4.0 / np.pi * side / np.hypot(1.0, side) * np.arctan(side / np.hypot(1.0, side))
    assert seen - 0.06 < share < seen + 0.06 + 0.5 * GROUND * (1.0 - seen)


def test_the_border_of_the_image_is_lit_as_its_inside(draw):
    """The ground of a street, from above: no row or column differs from its neighbours."""

    def street(write):
        for name, x in (("left", -35), ("right", 25)):
            write.box(f"/World/{name}", (x, -60, 0), (x + 10, 60, 30))

    low = Pose(look_at(np.array([0.0, 0.0, 8.0]), np.zeros(3)))
    ground = draw(atmosphere(), street, pose=low).mean(axis=2)
    assert ground.mean() < 0.9 * draw(atmosphere(), pose=low).mean()
    for picture in (ground, ground.T, ground[::-1], ground.T[::-1]):
        strips = picture[:12].reshape(6, 2, -1).mean(axis=(1, 2))
        np.testing.assert_allclose(strips, strips[-1], rtol=0.03)


def test_haze_follows_koschmieder(draw):
    """Contrast to the horizon falls to 2 % at the visibility; here by half of its exponent."""
    level = Pose(look_at(np.array([0.0, 0.0, 1.0]), np.array([0.0, 100.0, 1.0])))
    for visibility in (200.0, 2000.0):

        def wall(write):
            wall = write.mesh(
                "/World/wall",
                [(-50, 100, 0), (50, 100, 0), (50, 100, 60), (-50, 100, 60)], [(0, 1, 2, 3)],
            )  # fmt: skip
            write.bind(wall.GetPrim(), write.material("/World/black", colour=(0.0,) * 3))

        radiance = draw(atmosphere(visibility=visibility), wall, pose=level)
        through = 1.0 - float(radiance[40:48, 95:105].mean())
        black = 1.0 - float(draw(atmosphere(), wall, pose=level)[40:48, 95:105].mean())
        assert through / black == pytest.approx(np.exp(-3.912 * 100 / visibility), abs=0.02)


def test_wet_ground_is_darker_and_mirrors_the_sky(draw):
    flat = Pose(look_at(np.array([0.0, 0.0, 1.5]), np.array([0.0, 12.0, 0.0])))
    dry, wet = (draw(atmosphere(wetness=w), pose=flat).mean(axis=2) for w in (0.0, 1.0))
    near, far = (slice(80, 100), slice(60, 140)), (slice(40, 46), slice(60, 140))
    assert np.median(wet[near]) < 0.9 * np.median(dry[near])
    assert wet[near].std() > 3 * dry[near].std()
    assert wet[far].mean() > dry[far].mean()


def test_wet_soil_mirrors_less_than_a_wet_road(draw, tmp_path):
    """Ground of patches that wears no stains is loose: water sinks in. Black shows the mirror."""
    Image.new("RGB", (8, 8)).save(tmp_path / "black.png")
    low = Pose(look_at(np.array([0.0, 0.0, 1.5]), np.array([0.0, 12.0, 1.2])))

    def laid(**inputs):
        def add(write):
            side = [(-40, -40, 0.01), (40, -40, 0.01), (40, 40, 0.01), (-40, 40, 0.01)]
            mesh = write.mesh("/World/ground", side, [(0, 1, 2, 3)])
            write.uvs(mesh, [(x, y) for x, y, _ in side])
            material = write.material("/World/black", texture=str(tmp_path / "black.png"))
            for name, figure in inputs.items():
                kind = Sdf.ValueTypeNames.Float
                material.CreateInput(name.replace("__", ":"), kind).Set(figure)
            write.bind(mesh.GetPrim(), material)

        return draw(atmosphere(wetness=0.7), add, pose=low).mean(axis=2)[60:90, 60:140]

    road = laid(bombing__patch=0.5, wear__lanes=0.5, wear__stains=0.5)
    soil = laid(bombing__patch=0.5)
    assert soil.mean() < 0.6 * road.mean()


def test_the_sky_shines_through_leaves(draw, tmp_path):
    """From below, a leaf under the sky is lit by what it lets through: half, and less of blue."""
    leaf = leaf_of(tmp_path / "leaf.png", height=8)
    up = Pose(look_at(np.array([0.0, 0.0, 1.5]), np.array([0.0, 0.001, 8.0])))
    red, green, blue = draw(atmosphere(), leaf, pose=up)[40:60, 90:110].mean(axis=(0, 1))
    assert red == pytest.approx(green, rel=0.01)
    assert 1.25 < green / blue < 1.95


def test_wet_ground_mirrors_a_wall(draw):
    """The ground before a wall mirrors it: white brightens it, black darkens it."""
    low = Pose(look_at(np.array([0.0, 0.0, 1.5]), np.array([0.0, 12.0, 1.5])))

    def wall(grey):
        def add(write):
            points = [(-50, 12, 0), (50, 12, 0), (50, 12, 30), (-50, 12, 30)]
            mesh = write.mesh("/World/wall", points, [(0, 1, 2, 3)])
            write.bind(mesh.GetPrim(), write.material("/World/paint", colour=(grey,) * 3))

        return add

    black, white = (
        draw(atmosphere(wetness=1.0), wall(grey), pose=low).mean(axis=2) for grey in (0.0, 1.0)
    )
    foot = (slice(64, 68), slice(60, 140))  # wet ground 8 to 10 m ahead, below the wall
    dry = draw(atmosphere(), wall(0.0), pose=low).mean(axis=2)
    assert np.median(white[foot]) > 1.5 * np.median(black[foot])
    assert np.median(black[foot]) < np.median(dry[foot])


@pytest.mark.parametrize("distance", [12.0, 40.0])
def test_a_mirrored_wall_has_no_gaps(draw, distance):
    """Before a black wall that the picture cuts off, wet ground mirrors nothing of the sky.

    Its film is not smooth: more than half of what it returns is scattered light.
    """
    low = Pose(look_at(np.array([0.0, 0.0, 1.5]), np.array([0.0, 12.0, 1.2])))
    foot = slice(50 + int(150.0 / distance) + 4, 90)  # rows below the wall, and below its foot

    def wall(write):
        points = [(-90, distance, 0), (90, distance, 0), (90, distance, 80), (-90, distance, 80)]
        mesh = write.mesh("/World/wall", points, [(0, 1, 2, 3)])
        write.bind(mesh.GetPrim(), write.material("/World/paint", colour=(0.0,) * 3))

    freely = draw(atmosphere(wetness=1.0), pose=low, grey=0.02).mean(axis=2)[foot, 60:140]
    before = draw(atmosphere(wetness=1.0), wall, pose=low, grey=0.02).mean(axis=2)[foot, 60:140]
    wet = freely > 0.3
    assert wet.mean() > 0.05
    assert (before[wet] < 0.75 * freely[wet]).mean() > 0.99


def test_no_pixel_is_without_a_number(draw):
    """Rounding once gave NaN where a surface faces the camera exactly."""
    air = make_atmosphere(Moment.drawn(read_weathers()["clear"]), np.array([0.5, 0.1, 0.86]),
                          np.random.default_rng(0), 64)  # fmt: skip
    for x in range(6):
        pose = Pose(look_at(np.array([0.37 * x, 0.0, 3.0]), np.array([0.37 * x, 0.001, 0.0])))
        assert np.isfinite(draw(air, pose=pose)).all()


def test_a_stage_carries_the_light_of_its_weathers(tmp_path):
    stage = stage_of(tmp_path, 4)
    prim = stage.GetPrimAtPath("/World/Environment")
    weathers = prim.GetVariantSet("weather")
    assert set(weathers.GetVariantNames()) == set(read_weathers())
    lights = {}
    for name in weathers.GetVariantNames():
        weathers.SetVariantSelection(name)
        lights[name], issues = read_light(stage, TIME)
        assert not issues
    clear, closed = lights["clear"], lights["overcast"]
    by_sun = clear.sun @ LUMINANCE * clear.sun_direction[2]
    assert 1.5 < by_sun / (ground_illuminance(clear.sky) @ LUMINANCE) < 8.0
    assert (closed.sun @ LUMINANCE) < 0.05 * (ground_illuminance(closed.sky) @ LUMINANCE)
    assert lights["fog"].visibility < 600 < lights["clear"].visibility
    assert lights["after_rain"].wetness > 0.5
    assert lights["dusk"].sun_direction[2] < 0.05


@pytest.mark.parametrize("seed", [0, 1, 5])
def test_clouds_of_a_sunny_weather_leave_the_sun_free(tmp_path, seed):
    """The sun of a stage stands still: behind a cloud, a low sun would never cast a shadow."""
    stage = stage_of(tmp_path, seed)
    weathers = stage.GetPrimAtPath("/World/Environment").GetVariantSet("weather")
    for name in ("clear", "low_sun", "broken_clouds"):
        weathers.SetVariantSelection(name)
        light, _ = read_light(stage, TIME)
        weather = read_weathers()[name]
        free = sun_illuminance(float(np.mean(weather.elevation)), np.mean(weather.turbidity))
        assert light.sun.max() * 20.0 > 0.5 * np.mean(weather.direct) * free.max()


def test_a_dome_light_means_the_same_with_and_without_exposure(tmp_path):
    """By UsdLux, intensity times two to the exposure; Blender 5.0 drops the exposure of domes.

    It also lights with four times the intensity of a distant light.
    """
    stage = stage_of(tmp_path, 0)
    sky = UsdLux.LightAPI(stage.GetPrimAtPath("/World/Environment/Sky"))
    intensity, exposure = sky.GetIntensityAttr().Get(), sky.GetExposureAttr().Get()
    assert intensity * 2.0**exposure == 1.0
    assert intensity == 4.0


def test_the_map_of_the_stage_lies_where_the_sun_is(tmp_path):
    """The glow around the sun of a hazy sky, through file, texture and both conventions."""
    stage = stage_of(tmp_path, 0)
    stage.GetPrimAtPath("/World/Environment").GetVariantSet("weather").SetVariantSelection(
        "low_sun"
    )
    light, _ = read_light(stage, TIME)
    upper = light.sky[: len(light.sky) // 2]
    directions = sky_directions(len(light.sky))[: len(upper)]
    bright = upper @ LUMINANCE
    middle = (directions * (bright**6)[..., None]).sum(axis=(0, 1))
    middle /= np.linalg.norm(middle)
    assert middle @ light.sun_direction > np.cos(np.radians(12))


def test_a_dome_light_turns_with_its_prim(tmp_path, author):
    """A texture with one bright quarter, turned about the vertical by 90 degrees."""
    from envgen_usd.light.radiance_map import write_radiance_map  # noqa: PLC0415

    image = np.full((16, 32, 3), 0.1)
    image[2:6, 14:18] = 50.0
    write_radiance_map(tmp_path / "sky.exr", image)
    brightest = {}
    for turn in (0.0, 90.0):
        write = author()
        dome = UsdLux.DomeLight.Define(write.stage, "/World/Sky")
        dome.CreateTextureFileAttr(Sdf.AssetPath(str(tmp_path / "sky.exr")))
        UsdGeom.Xformable(dome).AddRotateZOp().Set(turn)
        UsdGeom.Xformable(dome).AddRotateXOp().Set(90.0)
        sky = read_light(write.stage, TIME)[0].sky
        middle = (sky_directions(len(sky)) * (sky[..., :1] > 10)).sum(axis=(0, 1))
        brightest[turn] = middle / np.linalg.norm(middle)
    assert brightest[0.0][1] < -0.5  # the middle of the image looks south
    turned = np.array([-brightest[0.0][1], brightest[0.0][0], brightest[0.0][2]])
    np.testing.assert_allclose(brightest[90.0], turned, atol=0.05)


def test_a_texture_that_is_no_image_is_an_issue(tmp_path, author):
    (tmp_path / "sky.exr").write_text("no image")
    write = author()
    dome = UsdLux.DomeLight.Define(write.stage, "/World/Sky")
    dome.CreateTextureFileAttr(Sdf.AssetPath(str(tmp_path / "sky.exr")))
    dome.CreateColorAttr(Gf.Vec3f(0.5, 0.6, 0.7))
    light, (issue,) = read_light(write.stage, TIME)
    assert issue.where == "/World/Sky"
    np.testing.assert_allclose(light.sky[0, 0], (0.5, 0.6, 0.7), rtol=1e-6)


def test_shadows_follow_the_light_of_each_frame(opengl, author, small_camera):
    """The same pose in the morning and in the evening, drawn by one renderer and by two."""
    assert opengl
    write = author()
    points = [(-90, -90, 0), (90, -90, 0), (90, 90, 0), (-90, 90, 0)]
    write.mesh("/World/plane", points, [(0, 1, 2, 3)])
    write.box("/World/box", (-1, -1, 0), (1, 1, 4))
    write.box("/World/other", (59, -1, 0), (61, 1, 4))
    scene = read_scene(write.stage)
    pose = Pose(look_at(np.array([0.0, -12.0, 12.0]), np.zeros(3)))
    lights = [atmosphere((x, 0.0, 1.0), 20.0, 1.0) for x in (1.0, -1.0, 1.0)]
    away = Pose(look_at(np.array([60.0, -12.0, 12.0]), np.array([60.0, 0.0, 0.0])))
    drives = [[(pose, lights[0]), (pose, lights[1]), (pose, lights[2]), (away, lights[2])],
              [(pose, lights[1])], [(away, lights[2])]]  # fmt: skip
    drawn = []
    for drive in drives:
        with open_context():
            from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

            drawer = FrameRenderer(scene, pack(scene), small_camera)
            drawn.append([drawer.draw(FrameRequest(*step)).radiance for step in drive])
    first, other, again, moved = drawn[0]
    np.testing.assert_array_equal(other, drawn[1][0])
    np.testing.assert_array_equal(moved, drawn[2][0])
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other[:, ::-1]).mean() < 0.2 * np.abs(first - other).mean()


def test_scenes_in_one_context_do_not_change_each_other(author, small_camera, opengl):
    """The first scene, drawn after a second was made and drawn, looks as before."""
    assert opengl
    scenes = []
    for height in (2.0, 5.0):
        write = author()
        points = [(-90, -90, 0), (90, -90, 0), (90, 90, 0), (-90, 90, 0)]
        write.mesh("/World/plane", points, [(0, 1, 2, 3)])
        write.box("/World/box", (-1, -1, 0), (1, 1, height))
        scenes.append(read_scene(write.stage))
    pose = Pose(look_at(np.array([0.0, -12.0, 12.0]), np.zeros(3)))
    request = FrameRequest(pose, atmosphere((1.0, 0.0, 1.0), 20.0, 1.0))
    with open_context():
        from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

        low = FrameRenderer(scenes[0], pack(scenes[0]), small_camera)
        alone = low.draw(request)
        high = FrameRenderer(scenes[1], pack(scenes[1]), small_camera)
        other = high.draw(request)
        again = low.draw(request)
    np.testing.assert_array_equal(again.radiance, alone.radiance)
    np.testing.assert_array_equal(again.depth, alone.depth)
    assert (other.depth != alone.depth).sum() > 100

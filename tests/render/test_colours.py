"""What the colour image shows: textures the right way up, light from the right side, shadows."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Gf, Usd, UsdGeom, UsdLux, Vt

from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.stage.sun_and_sky import read_light

TIME = Usd.TimeCode.EarliestTime()


def _hue(frame, rows, columns):
    """Which of red, green and blue is strongest."""
    return "rgb"[int(np.argmax(frame.rgb[rows, columns].mean(axis=(0, 1))))]


@pytest.fixture
def quarters(author, tmp_path):
    """A stage with a material of red, green (upper row), blue, red (lower row)."""
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:32, :32, 0] = pixels[:32, 32:, 1] = pixels[32:, :32, 2] = pixels[32:, 32:, 0] = 200
    Image.fromarray(pixels).save(tmp_path / "quarters.png")
    write = author(tmp_path / "wall.usda")
    return write, write.material("/World/m", texture="./quarters.png")


@pytest.mark.parametrize("interpolation", ["vertex", "faceVarying"])
def test_a_texture_is_the_right_way_up(shoot, small_camera, ahead, quarters, interpolation):
    write, material = quarters
    mesh = write.square("/World/wall", 10.0, (-4, -4), (4, 4), label="building")
    write.uvs(mesh, [(0, 0), (1, 0), (1, 1), (0, 1)], interpolation)
    write.bind(mesh.GetPrim(), material)
    frame, _ = shoot(write.stage, small_camera, ahead)
    upper, lower = slice(15, 45), slice(55, 85)
    left, right = slice(65, 95), slice(105, 135)
    found = [_hue(frame, rows, columns) for rows in (upper, lower) for columns in (left, right)]
    assert found == ["r", "g", "b", "r"]


def test_textures_repeat(shoot, small_camera, ahead, quarters):
    write, material = quarters
    mesh = write.square("/World/wall", 10.0, (-8, -4), (8, 4), label="building")
    write.uvs(mesh, [(0, 0), (4, 0), (4, 2), (0, 2)])
    write.bind(mesh.GetPrim(), material)
    frame, _ = shoot(write.stage, small_camera, ahead)
    green = frame.rgb[20, :, 1].astype(int) > frame.rgb[20, :, 0].astype(int) + 30
    inside = green[20:180]
    starts = np.flatnonzero(np.diff(inside.astype(int)) == 1) + 1
    np.testing.assert_array_equal(np.diff(starts), 40)
    assert abs(int(starts[0]) - 20) <= 1


def test_a_mesh_without_material_has_its_display_colour(author, shoot, small_camera, ahead):
    write = author()
    mesh = write.square("/World/wall", 10.0, (-9, -9), (9, 9), label="building")
    mesh.CreateDisplayColorAttr([(0.02, 0.6, 0.05)])
    frame, _ = shoot(write.stage, small_camera, ahead)
    assert _hue(frame, slice(30, 70), slice(50, 150)) == "g"


def test_an_instance_takes_the_material_bound_above_it(author, shoot, small_camera, ahead):
    write = author()
    source = write.stage.CreateClassPrim("/Sign")
    write.square("/Sign/plate", 0.0, (-1, -1), (1, 1))
    for index, colour in enumerate([(0.7, 0, 0), (0, 0.7, 0), (0, 0, 0.7)]):
        sign = UsdGeom.Xform.Define(write.stage, f"/World/s{index}")
        sign.AddTranslateOp().Set(Gf.Vec3d(4.0 * index - 4.0, 10.0, 0.0))
        sign.GetPrim().GetInherits().AddInherit(source.GetPath())
        sign.GetPrim().SetInstanceable(True)
        write.bind(sign.GetPrim(), write.material(f"/World/m{index}", colour=colour))
    frame, _ = shoot(write.stage, small_camera, ahead)
    rows = slice(42, 58)
    found = [_hue(frame, rows, slice(x - 8, x + 8)) for x in (60, 100, 140)]
    assert found == ["r", "g", "b"]


def _ground_and_box(write):
    write.mesh(
        "/World/ground", [(-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0)], [(0, 1, 2, 3)]
    )
    write.box("/World/box", (-1, -1, 2), (1, 1, 3))


def test_the_sun_casts_shadows_away_from_itself(author, shoot, small_camera):
    write = author()
    _ground_and_box(write)
    light = UsdLux.DistantLight.Define(write.stage, "/World/sun")
    light.CreateIntensityAttr(5.0)
    UsdGeom.Xformable(light).AddRotateXYZOp().Set(Gf.Vec3f(0, 45, 0))  # from +x, half-way up
    UsdLux.DomeLight.Define(write.stage, "/World/sky").CreateIntensityAttr(1.0)
    np.testing.assert_allclose(
        read_light(write.stage, TIME)[0].sun_direction, (0.5**0.5, 0, 0.5**0.5), atol=1e-6
    )
    pose = Pose(look_at(np.array([0.0, 0.0, 20.0]), np.zeros(3)))
    frame, _ = shoot(write.stage, small_camera, pose)
    grey = frame.rgb.mean(axis=2)
    # A point at (x, y) lies at column 99.5 + 5 x; the shadow at x from -4 to -1 and 1 to -2.
    column = {x: grey[46:54, round(99.5 + 5 * x)].mean() for x in (-3.3, -2.5, 3.0, -8.0)}
    assert column[-2.5] < 0.75 * column[3.0]
    assert column[-8.0] == pytest.approx(column[3.0], rel=0.05)


def test_walls_that_face_the_sun_are_brighter(author, shoot, small_camera, ahead):
    write = author()
    for name, x, turn in (("a", -4, 0.9), ("b", 4, -0.9)):
        points = [(x - 2, 10 - turn, -2), (x + 2, 10 + turn, -2)]
        points += [(x + 2, 10 + turn, 2), (x - 2, 10 - turn, 2)]
        write.mesh(f"/World/{name}", points, [(0, 1, 2, 3)], label="building")
    light = UsdLux.DistantLight.Define(write.stage, "/World/sun")
    UsdGeom.Xformable(light).AddRotateXYZOp().Set(Gf.Vec3f(60, 0, -70))
    UsdLux.DomeLight.Define(write.stage, "/World/sky").CreateIntensityAttr(0.3)
    towards = np.array(read_light(write.stage, TIME)[0].sun_direction)
    normals = {"a": np.array([0.9, -2, 0]), "b": np.array([-0.9, -2, 0])}
    facing = {name: max(normal @ towards, 0) for name, normal in normals.items()}
    frame, _ = shoot(write.stage, small_camera, ahead)
    grey = {"a": frame.rgb[40:60, 50:70].mean(), "b": frame.rgb[40:60, 130:150].mean()}
    assert (grey["a"] > grey["b"]) == (facing["a"] > facing["b"])
    assert abs(grey["a"] - grey["b"]) > 10


def test_only_the_ratio_of_sun_to_sky_counts(author):
    def light(sun, sky):
        write = author()
        UsdLux.DistantLight.Define(write.stage, "/World/sun").CreateIntensityAttr(sun)
        UsdLux.DomeLight.Define(write.stage, "/World/sky").CreateIntensityAttr(sky)
        return read_light(write.stage, TIME)[0]

    one, other = light(3.0, 1.0), light(3000.0, 1000.0)
    np.testing.assert_allclose(1000.0 * one.sun, other.sun)
    np.testing.assert_allclose(1000.0 * one.sky, other.sky)
    assert max(light(0.0, 1.0).sun) == 0


def test_leaves_seen_from_afar_hide_as_much(author, shoot, small_camera, ahead, tmp_path):
    """A fine cut-out of one part in four hides a quarter of the sky also where it is tiny.

    Labels show gaps among so few leaves.
    """
    some = np.random.default_rng(0).random((64, 64)) < 0.25
    for distance in (0.5, 3.0, 30.0):
        light, labels = {}, {}
        for name, blocks in (("open", 0 * some), ("solid", 0 * some + 1), ("leaves", some)):
            write = author(tmp_path / f"{name}_{distance}.usda")
            frame, scene_objects = shoot(_crown(write, blocks, distance), small_camera, ahead)
            inner, share = _middle(some, distance)
            light[name] = float(frame.radiance[inner].mean())
            labels[name] = _labelled(frame, scene_objects, inner)
        hidden = (light["open"] - light["leaves"]) / (light["open"] - light["solid"])
        assert hidden == pytest.approx(share, abs=0.04)
        assert labels["leaves"] == pytest.approx(share, abs=0.02 if distance < 1.0 else 0.05)


def test_narrow_gaps_in_a_dense_crown_are_labelled_as_crown(
    author, shoot, small_camera, ahead, tmp_path
):
    """Where leaves are more than half of what is around a gap; near by, it is seen."""
    dense = np.random.default_rng(0).random((64, 64)) < 0.75
    for distance in (0.5, 3.0, 30.0):
        write = author(tmp_path / f"{distance}.usda")
        frame, scene_objects = shoot(_crown(write, dense, distance), small_camera, ahead)
        inner, share = _middle(dense, distance)
        labelled = _labelled(frame, scene_objects, inner)
        assert labelled == pytest.approx(share, abs=0.02) if distance < 1.0 else labelled > 0.98


def test_leaves_cover_the_same_share_of_all_pixels_and_layers_multiply(
    author, shoot, small_camera, ahead, tmp_path
):
    """Blocks far smaller than pixels: no pixel shows them one by one, whatever is drawn first."""
    draws = np.random.default_rng(1)
    thin, thick = (draws.random((64, 64)) < share for share in (0.25, 0.5))
    light = {}
    for name, layers in {
        "open": (np.zeros((64, 64), bool),),
        "solid": (np.ones((64, 64), bool),),
        "one": (thin,),
        "two": (thin, thick),
        "two, the far one first": (thick, thin),
    }.items():
        write = author(tmp_path / f"{name}.usda")
        for number, blocks in enumerate(layers):
            place = f"/World/crown_{number}"
            distance = 40.0 if blocks is thick else 30.0
            _crown(write, blocks, distance, place=place, tiles=9)
        UsdLux.DomeLight.Define(write.stage, "/World/Sky").CreateIntensityAttr(1.0)
        frame, _ = shoot(write.stage, small_camera, ahead)
        light[name] = frame.radiance[40:60, 80:120].mean(axis=2)
    sky, leaves = light["open"].mean(), light["solid"].mean()
    open_share = {name: (each - leaves) / (sky - leaves) for name, each in light.items()}
    assert open_share["one"].mean() == pytest.approx(1.0 - thin.mean(), abs=0.01)
    both = (1.0 - thin.mean()) * (1.0 - thick.mean())
    assert open_share["two"].mean() == pytest.approx(both, abs=0.02)
    np.testing.assert_allclose(light["two"], light["two, the far one first"], atol=2e-3)
    for name in ("one", "two"):
        assert open_share[name].std() < 0.05


def test_leaves_behind_a_wall_do_not_shine_through(author, shoot, small_camera, ahead, tmp_path):
    """The wall spans the columns 80 to 119, and leaves show right beside it."""
    blocks = np.random.default_rng(2).random((64, 64)) < 0.5
    light = []
    for with_leaves in (False, True):
        write = author(tmp_path / f"{with_leaves}.usda")
        UsdLux.DomeLight.Define(write.stage, "/World/Sky").CreateIntensityAttr(1.0)
        write.square("/World/wall", 10.0, (-2, -9), (2, 9), label="building")
        if with_leaves:
            _crown(write, blocks, 30.0)
        light.append(shoot(write.stage, small_camera, ahead)[0].radiance)
    np.testing.assert_allclose(light[1][:, 81:119], light[0][:, 81:119], atol=1e-3)
    assert np.abs(light[1][50, 121:125] - light[0][50, 121:125]).min() > 0.05


def test_the_edge_of_a_wall_before_leaves_is_smooth(author, shoot, small_camera, ahead, tmp_path):
    """The wall ends in a pixel's left third: two of its corners show it, its centre leaves."""
    write = author(tmp_path / "stage.usda")
    write.square("/World/wall", 10.0, (-9, -9), (2.03, 9), label="building")
    stage = _crown(write, np.ones((64, 64), bool), 30.0)
    row = shoot(stage, small_camera, ahead)[0].radiance[50].mean(axis=1)
    wall, leaves = row[115], row[125]
    assert wall > leaves + 0.1
    assert row[120] == pytest.approx(0.25 * wall + 0.75 * leaves, abs=0.02)


def test_a_pole_half_a_pixel_wide_covers_half_a_pixel_in_every_row(
    author, shoot, small_camera, ahead
):
    """It leans by 3 pixels over the image; a sample at each centre would show it in dots."""
    light = {}
    for name, half in (("wide", 0.5), ("thin", 0.025)):
        write = author()
        UsdLux.DomeLight.Define(write.stage, "/World/Sky").CreateIntensityAttr(1.0)
        points = [(-half, 10, -6), (half, 10, -6), (half + 0.3, 10, 6), (0.3 - half, 10, 6)]
        mesh = write.mesh("/World/pole", points, [(0, 1, 2, 3)], label="pole")
        write.bind(mesh.GetPrim(), write.material("/World/look", colour=(0.0, 0.0, 0.0)))
        light[name] = shoot(write.stage, small_camera, ahead)[0].radiance.mean(axis=2)
    sky, pole = light["thin"][:, :5].mean(), light["wide"][50, 100:102].mean()
    covered = (sky - light["thin"][5:95, 90:115]).sum(axis=1) / (sky - pole)
    # Of three samples across a pixel, one or two lie in the pole.
    assert covered.mean() == pytest.approx(0.5, abs=0.06)
    assert covered.min() > 0.3
    assert covered.max() < 0.85


def _middle(blocks, distance):
    """Part of the image within the crown, and the share of the blocks there that are leaves."""
    half = min(int(100.0 / distance), 45) if distance < 10.0 else 20
    visible = min(round(32 * half * distance / 100.0), 32)
    seen = np.s_[32 - visible : 32 + visible]
    return np.s_[50 - half : 50 + half, 100 - half : 100 + half], blocks[seen, seen].mean()


def _labelled(frame, scene_objects, part):
    labels = np.array([each.label for each in scene_objects])[frame.scene_objects[part]]
    return float((labels == "vegetation").mean())


def _crown(write, blocks, distance, *, place="/World/crown", tiles=1):
    """Black leaves before an even sky; the texture is 2 m wide, each block 4 x 4 texels.

    With tiles, it is repeated more often on as large a square.
    """
    UsdLux.DomeLight.Define(write.stage, "/World/Sky").CreateIntensityAttr(1.0)
    pixels = np.zeros((256, 256, 4), np.uint8)
    pixels[..., 3] = 255 * np.kron(blocks, np.ones((4, 4), np.uint8))
    image = Path(write.stage.GetRootLayer().realPath).with_suffix(f".{Path(place).name}.png")
    Image.fromarray(pixels).save(image)
    mesh = write.square(place, distance, (-9, -9), (9, 9), label="vegetation")
    corners = np.array([(-4, -4), (5, -4), (5, 5), (-4, 5)])
    write.uvs(mesh, tiles * corners)
    write.bind(mesh.GetPrim(), write.material(f"{place}_look", texture=image, cut=0.5))
    return write.stage


def test_smooth_and_flat_normals(author, shoot, small_camera, ahead):
    """A fold without normals: flat if it is no subdivision surface, smooth if it is one."""
    contrast = {}
    for scheme in ("none", "catmullClark"):
        write = author()
        points = [(x, 10 - abs(x) / 2, z) for z in (-4, 4) for x in (-4, 0, 4)]
        faces = [(0, 1, 4, 3), (1, 2, 5, 4)]
        mesh = write.mesh("/World/fold", points, faces, label="building", subdivision=scheme)
        assert mesh.GetPointsAttr().Get() == Vt.Vec3fArray([Gf.Vec3f(*p) for p in points])
        frame, _ = shoot(write.stage, small_camera, ahead)
        grey = frame.rgb.mean(axis=2)[45:55]
        contrast[scheme] = abs(grey[:, 97].mean() - grey[:, 102].mean())
    assert contrast["none"] > 4 * contrast["catmullClark"]


def test_further_suns_and_skies_are_issues_unless_they_are_hidden(author):
    write = author()
    first = UsdLux.DistantLight.Define(write.stage, "/World/a_sun")
    first.CreateIntensityAttr(3.0)
    second = UsdLux.DistantLight.Define(write.stage, "/World/b_sun")
    second.CreateIntensityAttr(30.0)
    UsdLux.DomeLight.Define(write.stage, "/World/c_sky")
    UsdLux.DomeLight.Define(write.stage, "/World/d_sky")
    _, issues = read_light(write.stage, TIME)
    assert [(issue.kind, issue.where) for issue in issues] == [
        ("light.unused", "/World/b_sun"),
        ("light.unused", "/World/d_sky"),
    ]
    assert all("/World/a_sun" in x.message or "/World/c_sky" in x.message for x in issues)
    for path in ("/World/a_sun", "/World/d_sky"):
        UsdGeom.Imageable(write.stage.GetPrimAtPath(path)).MakeInvisible()
    assert read_light(write.stage, TIME)[1] == []

"""What materials say besides their shader: bombed textures, tints, wear of lanes and walls."""

import numpy as np
import pytest
from PIL import Image
from pxr import Gf, Sdf, UsdGeom, UsdLux, UsdShade, Vt

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.layers.sill_strips import sill_periods
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera

ABOVE = np.array([0.0, 0.0, 30.0])
TILE = 2.0
KINDS = Sdf.ValueTypeNames


@pytest.fixture
def above():
    """A camera that looks straight down and sees 24 m x 24 m of the ground, 0.1 m a pixel."""
    camera = Camera(width=240, height=240, fx=300.0, fy=300.0, cx=119.5, cy=119.5)
    return camera, Pose(look_at(ABOVE, np.array([0.0, 1e-6, 0.0])))


def blotches(path, side=256):
    """A texture that tiles, with blotches of a tenth of its side."""
    rng = np.random.default_rng(5)
    white = np.fft.fft2(rng.standard_normal((side, side)))
    frequency = np.hypot(*np.meshgrid(*2 * [np.fft.fftfreq(side, 1 / side)]))
    field = np.fft.ifft2(white * np.exp(-(((frequency - 8) / 4) ** 2))).real
    pixels = np.clip(110 + 35 * field / field.std(), 0, 255).astype(np.uint8)
    Image.fromarray(np.repeat(pixels[..., None], 3, axis=2)).save(path)


def ground(write, material, size=TILE, side=64.0):
    """A square of ground with texture coordinates in repeats of the texture."""
    low, high = -side / 2, side / 2
    corners = [(low, low, 0), (high, low, 0), (high, high, 0), (low, high, 0)]
    mesh = write.mesh("/World/ground", corners, [(0, 1, 2, 3)], label="terrain")
    write.uvs(mesh, [(x / size, y / size) for x, y, _ in corners])
    write.bind(mesh.GetPrim(), material)
    material.GetPrim().SetCustomDataByKey("texture_size", size)
    return mesh


def give(material, **figures):
    """Authors inputs of a material; `__` stands for a colon."""
    for name, figure in figures.items():
        kind = KINDS.Float2 if isinstance(figure, Gf.Vec2f) else KINDS.Float
        material.CreateInput(name.replace("__", ":"), kind).Set(figure)


def repetition(image, period):
    """Correlation of an image with itself, moved by a period along its rows or columns."""
    field = image - image.mean()
    moved = [(field[:, period:], field[:, :-period]), (field[period:], field[:-period])]
    return max(float(np.corrcoef(a.ravel(), b.ravel())[0, 1]) for a, b in moved)


@pytest.mark.parametrize(
    ("bombing", "limits"),
    [
        ({}, (0.8, 1.0)),
        ({"bombing__patch": 0.5, "bombing__turn": 180.0}, (-0.2, 0.15)),
        ({"bombing__patch": 0.5}, (-0.2, 0.15)),
    ],
)
def test_patches_hide_the_repeats_of_a_texture(  # noqa: PLR0917 - fixtures
    author, shoot, above, tmp_path, bombing, limits
):
    """30 m above ground with a tile of 2 m: without patches the image repeats every 20 pixels."""
    blotches(tmp_path / "blotches.png")
    write = author(tmp_path / "ground.usda")
    material = write.material("/World/m", texture="./blotches.png")
    give(material, **bombing)
    ground(write, material)
    frame, _ = shoot(write.stage, *above)
    seen = frame.radiance[..., 1].astype(float)
    assert limits[0] <= repetition(seen, 20) <= limits[1]


def test_patches_keep_brightness_and_contrast(author, shoot, above, tmp_path):
    """A plain mean of patches would grey the texture."""
    blotches(tmp_path / "blotches.png")
    seen = {}
    for patch in (0.0, 0.5):
        write = author(tmp_path / f"ground_{patch}.usda")
        material = write.material("/World/m", texture="./blotches.png")
        give(material, bombing__patch=patch, bombing__turn=180.0)
        ground(write, material)
        frame, _ = shoot(write.stage, *above)
        seen[patch] = frame.radiance[..., 1].astype(float)
    assert seen[0.5].mean() == pytest.approx(seen[0.0].mean(), rel=0.03)
    assert seen[0.5].std() == pytest.approx(seen[0.0].std(), rel=0.15)


def test_no_patch_divides_a_brick(author, shoot, above, tmp_path):
    """Bricks of 4 x 8 on a tile of 4 m, of one grey each, laid half a brick apart."""
    rng = np.random.default_rng(1)
    rows, columns = np.indices((256, 256))
    course = rows // 32
    brick = ((columns + 32 * (course % 2)) % 256) // 64
    greys = rng.integers(40, 220, (8, 4)).astype(np.uint8)[course, brick]
    Image.fromarray(np.repeat(greys[::-1, :, None], 3, axis=2)).save(tmp_path / "wall.png")
    write = author(tmp_path / "ground.usda")
    material = write.material("/World/m", texture="./wall.png")
    give(material, bombing__patch=0.25, bombing__unit=Gf.Vec2f(0.25, 0.125), bombing__bond=0.5)
    ground(write, material, size=4.0)
    frame, _ = shoot(write.stage, *above)
    seen = frame.radiance[::-1, :, 1].astype(float)  # first row at the lowest y
    x, y = (np.arange(240) - 119.5) * 0.1, (np.arange(240) - 119.5) * 0.1
    course = np.floor(y / 0.5)
    across = (x[None, :] + 0.5 * (course % 2)[:, None]) % 1.0
    inside = (np.abs((y % 0.5) - 0.25) < 0.12)[:, None] & (np.abs(across - 0.5) < 0.3)
    numbers = course[:, None] * 100 + np.floor(x[None, :] + 0.5 * (course % 2)[:, None])
    spreads = [np.ptp(seen[inside & (numbers == n)]) for n in np.unique(numbers[inside])]
    assert np.median(spreads) < 0.02 * seen.mean()
    assert np.quantile(spreads, 0.95) < 0.05 * seen.mean()
    assert repetition(seen, 40) < 0.35


def test_a_tint_multiplies_the_colour_where_a_mesh_has_one(author, shoot, above):
    seen = {}
    for tint in (None, (0.25, 0.5, 1.0)):
        write = author()
        material = write.material("/World/m", colour=(0.5, 0.5, 0.5))
        material.CreateInput("tinted", KINDS.Bool).Set(True)
        mesh = ground(write, material)
        if tint:
            UsdGeom.Gprim(mesh).CreateDisplayColorAttr(Vt.Vec3fArray([Gf.Vec3f(*tint)]))
        frame, _ = shoot(write.stage, *above)
        seen[tint] = frame.radiance.mean(axis=(0, 1))
    plain, tinted = seen.values()
    np.testing.assert_allclose(tinted / plain, (0.25, 0.5, 1.0), rtol=0.25)
    assert plain[0] == pytest.approx(plain[2], rel=0.3)


def across_lane(author, shoot, above, height):
    """Median profile across ground with a lane along y, whose centre line is at x = 3."""
    write = author()
    write.lane("/World/lane", "lane", [(3.0, -30.0, height), (3.0, 30.0, height)])
    material = write.material("/World/m", colour=(0.2, 0.2, 0.2))
    give(material, wear__lanes=1.0)
    ground(write, material)
    frame, _ = shoot(write.stage, *above)
    return np.median(frame.radiance[..., 1], axis=0)


def test_tyres_polish_two_tracks_of_a_lane(author, shoot, above):
    """Tracks lie 0.8 m beside the centre line, oil between them."""
    profile = across_lane(author, shoot, above, 0.0)
    column = {x: round(119.5 + 10 * x) for x in (-6.0, 2.2, 3.0, 3.8)}
    away = profile[column[-6.0]]
    assert profile[column[2.2]] > 1.05 * away
    assert profile[column[3.8]] > 1.05 * away
    assert profile[column[3.0]] < 0.95 * away


def test_a_lane_on_a_bridge_does_not_wear_the_road_below(author, shoot, above):
    profile = across_lane(author, shoot, above, 6.0)
    np.testing.assert_allclose(profile[100:200], profile[119], rtol=0.05)


@pytest.mark.parametrize("amount", [0.0, 1.0])
def test_walls_are_dirty_at_their_foot(  # noqa: PLR0917 - fixtures
    author, shoot, small_camera, ahead, tmp_path, amount
):
    """`wear:of_walls` scales what the material can show; coordinates count metres from the foot."""
    Image.new("RGB", (8, 8), (150, 150, 150)).save(tmp_path / "plain.png")
    write = author(tmp_path / "wall.usda")
    mesh = write.square("/World/wall", 10.0, (-9, -4), (9, 4), label="building")
    write.uvs(mesh, [(0, 0), (18, 0), (18, 8), (0, 8)])
    material = write.material("/World/m", texture="./plain.png")
    give(material, wear__foot=1.0, wear__of_walls=amount)
    write.bind(mesh.GetPrim(), material)
    frame, _ = shoot(write.stage, small_camera, ahead)
    rows = frame.radiance[..., 1].mean(axis=1)
    foot, middle = rows[86:89].mean(), rows[45:55].mean()  # 0.1 to 0.4 m, and 4 m, above the foot
    assert (foot < 0.85 * middle) == (amount > 0.0)


def test_far_ground_is_as_even_as_its_mean(author, shoot):
    """Asphalt below a grey sky: far off, where no texel is seen, no patch may stand out."""
    write = author()
    material = UsdShade.Material.Define(write.stage, "/World/m")
    catalogue = read_catalogue()
    path = catalogue.folder / catalogue.materials["asphalt"].path
    material.GetPrim().GetReferences().AddReference(str(path))
    size = float(material.GetPrim().GetCustomDataByKey("texture_size"))
    ground(write, material, size, side=600.0)
    UsdLux.DomeLight.Define(write.stage, "/World/Sky").CreateIntensityAttr(1.0)
    camera = Camera(width=320, height=160, fx=400.0, fy=400.0, cx=159.5, cy=79.5)
    pose = Pose(look_at(np.array([0.0, -250.0, 1.6]), np.array([0.0, 0.0, 1.6])))
    frame, _ = shoot(write.stage, camera, pose)
    depth, seen = frame.depth, frame.radiance[..., 1].astype(float)
    rows = [row for row in range(160) if 60.0 < np.median(depth[row]) < 250.0]
    assert len(rows) > 5
    for row in rows:
        assert seen[row].std() < 0.1 * seen[row].mean()


@pytest.mark.parametrize("amount", [0.0, 1.0])
def test_streaks_run_down_from_a_sill_and_fade(  # noqa: PLR0917 - fixtures
    author, shoot, small_camera, ahead, tmp_path, amount
):
    """Below a sill 6 m above the foot of a wall, the right half is darker, near it most."""
    Image.new("RGB", (8, 8), (150, 150, 150)).save(tmp_path / "plain.png")
    write = author(tmp_path / "wall.usda")
    sides, (du, dv) = ((-9.0, 0.0), (0.0, 9.0)), sill_periods(np.array([6.0]))[0]
    corners = [(x, 10.0, z) for low, high in sides for x, z in
               ((low, -4.0), (high, -4.0), (high, 2.0), (low, 2.0))]  # fmt: skip
    mesh = write.mesh("/World/wall", corners, [(0, 1, 2, 3), (4, 5, 6, 7)], label="building")
    shift = np.repeat([0.0, 1.0], 4)
    write.uvs(
        mesh,
        [(x + 9 + du * k, z + 4 + dv * k) for (x, _, z), k in zip(corners, shift, strict=True)],
    )
    material = write.material("/World/m", texture="./plain.png")
    give(material, wear__streaks=1.0, wear__of_walls=amount)
    write.bind(mesh.GetPrim(), material)
    frame, _ = shoot(write.stage, small_camera, ahead)
    green, scale = frame.radiance[..., 1], small_camera.fy / 10.0  # pixels a metre
    middle, row = round(small_camera.cx), lambda z: round(small_camera.cy - z * scale)
    dark = []
    for low, high in ((1.6, 1.9), (-3.0, -0.5)):
        band = green[row(high) : row(low), middle - int(4 * scale) : middle + int(4 * scale)]
        half = band.shape[1] // 2
        dark.append(float(1.0 - band[:, half + 2 :].mean() / band[:, : half - 2].mean()))
    if amount:
        assert dark[0] > 0.25
        assert abs(dark[1]) < 0.1
    else:
        assert max(map(abs, dark)) < 0.02

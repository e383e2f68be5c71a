"""The whole way from a stage's file to the folder of images."""

import hashlib
import json
import resource
import warnings
from importlib import resources

import numpy as np
import pytest
import rasterio
from PIL import Image
from pxr import Sdf, Usd, UsdLux

from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import label, labels
from envgen_usd.light.radiance_map import write_radiance_map
from envgen_usd.light.weather import read_weather
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_folder import DEFAULT_OUTPUTS, SUFFIXES
from envgen_usd.render.frames.frame_light import LightChoice
from envgen_usd.render.frames.frame_set import read_frames
from envgen_usd.render.frames.image_files import write_depth, write_instances
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR, LabelImages
from envgen_usd.render.trajectories.trajectory import Trajectory

WHOLE = "[camera]\nwidth = 64\nheight = 48\nfx = 40\nfy = 40\ncx = 32\ncy = 24\n"
FOLDERS = (
    "rgb", "semantic", "semantic_colour", "instance", "part", "depth", "normals", "objects",
)  # fmt: skip


@pytest.fixture
def rig(tmp_path):
    """A small camera, so that tests are quick."""
    path = tmp_path / "small.toml"
    text = "width=352\nheight=94\nfx=138.0\nfy=138.0\ncx=170.0\ncy=59.0\nmount=1.55\nnear=0.3\n"
    path.write_text(f"[camera]\n{text}")
    return str(path)


@pytest.fixture
def rendered(opengl, street, rig, tmp_path):
    assert opengl
    out = tmp_path / "frames"
    result = render_frames(street, out, 3, rig=rig, trajectory="drive")
    assert (result.rendered, result.kept) == (3, 0)
    return out


def _digests(folder):
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def _tables(folder):
    return [json.loads(path.read_text()) for path in sorted((folder / "objects").iterdir())]


def _read(folder, name, number=0):
    return np.asarray(Image.open(next((folder / name).glob(f"{number:06d}.*"))))


def test_all_outputs_are_there_and_have_their_types(rendered):
    assert set(FOLDERS) == set(DEFAULT_OUTPUTS) == SUFFIXES.keys() - {"boxes", "flow"}
    assert all(len(list((rendered / name).iterdir())) == 3 for name in FOLDERS)
    kinds = {name: _read(rendered, name) for name in FOLDERS if name != "objects"}
    assert {name: (a.dtype.name, a.shape) for name, a in kinds.items()} == {
        "rgb": ("uint8", (94, 352, 3)),
        "semantic": ("uint8", (94, 352)),
        "semantic_colour": ("uint8", (94, 352, 3)),
        "instance": ("int32", (94, 352)),
        "part": ("uint8", (94, 352)),
        "depth": ("float32", (94, 352)),
        "normals": ("uint8", (94, 352, 3)),  # of 16 bits, Pillow reads 8
    }


def test_images_agree_with_each_other(rendered):
    colours = {entry.id: entry.colour for entry in labels()}
    for number in range(3):
        semantic = _read(rendered, "semantic", number)
        instance = _read(rendered, "instance", number)
        depth = _read(rendered, "depth", number)
        assert {"road", "terrain", "building", "sky", "vegetation"} == {
            entry.name for entry in labels() if (semantic == entry.id).any()
        }
        np.testing.assert_array_equal(instance // INSTANCE_FACTOR, semantic)
        np.testing.assert_array_equal(depth == 0, semantic == label("sky").id)
        painted = np.array([colours.get(i, (0, 0, 0)) for i in range(256)])[semantic]
        np.testing.assert_array_equal(_read(rendered, "semantic_colour", number), painted)
        objects = json.loads((rendered / "objects" / f"{number:06d}.json").read_text())
        seen = {value for value in np.unique(instance).tolist() if value % INSTANCE_FACTOR}
        assert {int(value) for value in objects} == seen


def test_an_object_has_one_value_in_all_frames(rendered):
    """All values of all frames name one path each, and each path has one value."""
    tables = _tables(rendered)
    pairs = {pair for table in tables for pair in table.items()}
    assert sum(map(len, tables)) > len(pairs), "frames share objects"
    assert len({value for value, _ in pairs}) == len({path for _, path in pairs}) == len(pairs)


def test_values_do_not_depend_on_the_frames_that_are_drawn(rendered, street, rig, tmp_path):
    options = {"rig": rig, "trajectory": Trajectory("drive", 30.0), "outputs": ("objects",)}
    render_frames(street, tmp_path / "far", 2, **options)
    near = {path: value for table in _tables(rendered) for value, path in table.items()}
    far = {path: value for table in _tables(tmp_path / "far") for value, path in table.items()}
    assert near.keys() & far.keys()
    assert all(near[path] == far[path] for path in near.keys() & far.keys())


def test_cameras_are_on_the_lane(rendered):
    cameras = json.loads((rendered / "cameras.json").read_text())
    poses = np.array([frame["camera_to_world"] for frame in cameras["frames"]])
    np.testing.assert_allclose(poses[:, 0, 3], 2.0, atol=1e-3)
    np.testing.assert_allclose(poses[:, 2, 3], 1.55, atol=1e-3)
    np.testing.assert_allclose(poses[:, :3, 2], [(0, 1, 0)] * 3, atol=1e-6)
    assert cameras["camera"]["fx"] == 138.0


def test_rgb_shows_the_sky_bright_and_shadows_dark(street, rig, tmp_path):
    """With a fixed exposure; that of a drawn camera may be off by more than a stop."""
    outputs = ("rgb", "semantic")
    render_frames(
        street, tmp_path, 3, rig=rig, trajectory="drive", response="ideal", outputs=outputs
    )
    rgb = _read(tmp_path, "rgb").astype(float)
    semantic = _read(tmp_path, "semantic")
    grey = {name: rgb[semantic == label(name).id].mean() for name in ("sky", "road", "vegetation")}
    assert grey["sky"] > grey["road"] > grey["vegetation"] + 10
    assert 40 < grey["road"] < 200


def test_the_same_stage_gives_the_same_bytes(rendered, street, rig, tmp_path):
    again = tmp_path / "again"
    render_frames(street, again, 3, rig=rig, trajectory="drive")
    assert _digests(again) == _digests(rendered)


def test_a_frame_does_not_depend_on_those_before_it(rendered, street, rig):
    before = _digests(rendered)
    for name in FOLDERS:
        next((rendered / name).glob("000001.*")).unlink()
    result = render_frames(street, rendered, 3, rig=rig, trajectory="drive")
    assert (result.rendered, result.kept) == (1, 2)
    assert _digests(rendered) == before


def test_more_frames_keep_those_that_are_there(rendered, street, rig):
    result = render_frames(street, rendered, 5, rig=rig, trajectory="drive")
    assert (result.rendered, result.kept) == (2, 3)


def test_fewer_frames_of_a_drive_leave_the_others_and_their_cameras(rendered, street, rig):
    before = _digests(rendered)
    result = render_frames(street, rendered, 1, rig=rig, trajectory="drive")
    assert (result.rendered, result.kept, result.others, result.removed) == (0, 1, 2, 0)
    assert _digests(rendered) == before


def test_frames_of_another_drive_are_removed_and_counted(rendered, street, rig):
    result = render_frames(street, rendered, 1, rig=rig, trajectory=Trajectory("drive", 4.0))
    assert (result.kept, result.removed) == (1, 0), "the first frame is the same"
    result = render_frames(street, rendered, 2, rig=rig, trajectory=Trajectory("drive", 4.0))
    assert (result.rendered, result.kept, result.others, result.removed) == (2, 0, 0, 3)
    frames = json.loads((rendered / "cameras.json").read_text())["frames"]
    assert len(frames) == len(list((rendered / "rgb").iterdir())) == 2


def test_an_edited_stage_is_drawn_anew(rendered, street, rig):
    stage = Usd.Stage.Open(str(street))
    stage.GetPrimAtPath("/World/Houses").SetActive(False)
    stage.Save()
    result = render_frames(street, rendered, 1, rig=rig, trajectory="drive")
    assert (result.rendered, result.kept, result.removed) == (1, 0, 3)
    assert not (rendered / "rgb" / "000002.png").exists()
    assert not (_read(rendered, "semantic") == label("building").id).any()


def test_other_peoples_stages_are_circled_and_void(opengl, author, rig, tmp_path):
    assert opengl
    write = author(tmp_path / "other.usda", metres=0.01, up="Y")
    write.box("/World/thing", (-100, 0, -100), (100, 300, 100))
    write.stage.Save()
    result = render_frames(tmp_path / "other.usda", tmp_path / "frames", 4, rig=rig)
    kinds = {issue.kind for issue in result.issues}
    assert {"render.lanes", "stage.unlabelled"} <= kinds
    for number in range(4):
        semantic = _read(tmp_path / "frames", "semantic", number)
        assert set(np.unique(semantic).tolist()) == {0, 23}
        assert semantic[47, 176] == 0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such stage"),
        ("#usda 1.0\n(", "cannot be read as a USD stage"),
        ("#usda 1.0\n", "no drawable prims"),
    ],
)
def test_stages_that_cannot_be_used(tmp_path, content, message):
    path = tmp_path / "stage.usda"
    if content is not None:
        path.write_text(content)
    with pytest.raises(EnvgenError, match=message):
        render_frames(path, tmp_path / "frames", 1)
    assert not (tmp_path / "frames").exists()


def test_the_stage_of_a_folder_is_named(tmp_path):
    (tmp_path / "stage.usda").write_text("#usda 1.0\n")
    with pytest.raises(EnvgenError, match=r"is a folder; name its stage, .*stage\.usda"):
        render_frames(tmp_path, tmp_path / "frames", 1)


@pytest.mark.parametrize("spacing", [0.0, float("nan"), float("inf")])
def test_a_spacing_that_makes_no_sense(street, tmp_path, spacing):
    with pytest.raises(EnvgenError, match="spacing of frames must be above 0 m"):
        render_frames(street, tmp_path / "frames", 1, trajectory=Trajectory("drive", spacing))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "camera: expected at least one camera"),
        ("[camera]\nwidth = 640\nheight = 480", "missing fx, fy, cx, cy$"),
        ("[camera]\nwidht = 640", "missing width, height, fx, fy, cx, cy; unknown widht; known: "),
        (f"{WHOLE}mount = 'high'", "mount: expected a number from -1000 to 1000, not 'high'$"),
        (f"{WHOLE}near = -1", "camera: near: expected a number from 0.001 to 100, not -1$"),
        (f"{WHOLE}near = nan", "camera: near: expected a number from 0.001 to 100, not nan$"),
        (
            WHOLE.replace("width = 64", "width = 1e9"),
            "whole number from 1 to 16384, not 1000",
        ),
        ("[camera", "cannot be read as TOML"),
    ],
)
def test_a_rig_that_does_not_fit_is_named_with_its_keys(street, tmp_path, text, said):
    rig = tmp_path / "mine.toml"
    rig.write_text(text)
    with pytest.raises(EnvgenError, match=said) as caught:
        render_frames(street, tmp_path / "frames", 1, rig=str(rig))
    assert "mine.toml" in str(caught.value)


def test_a_folder_that_cannot_be_written(street, tmp_path):
    (tmp_path / "frames").write_text("in the way")
    with pytest.raises(EnvgenError, match="cannot be written"):
        render_frames(street, tmp_path / "frames", 1)


def test_a_missing_part_is_reported(opengl, street, rig, tmp_path):
    assert opengl
    stage = Usd.Stage.Open(str(street))
    stage.GetPrimAtPath("/World/Houses/h1").GetReferences().AddReference("./gone.usda")
    stage.Save()
    result = render_frames(street, tmp_path / "frames", 1, rig=rig)
    issue = next(issue for issue in result.issues if issue.kind == "stage.composition")
    assert issue.where == "/World/Houses/h1"
    assert "gone.usda" in issue.message


def test_a_layer_on_top_need_not_repeat_axis_and_units(opengl, street, rig, tmp_path):
    """USD does not inherit them: a layer of edits would lie on its side, in centimetres."""
    assert opengl
    top = Sdf.Layer.CreateNew(str(tmp_path / "top.usda"))
    top.subLayerPaths.append(str(street))
    top.Save()
    below = render_frames(street, tmp_path / "below", 1, rig=rig)
    above = render_frames(tmp_path / "top.usda", tmp_path / "above", 1, rig=rig)
    assert [issue.kind for issue in above.issues if issue not in below.issues] == [
        "stage.frame"
    ] * 2
    for kind in ("semantic", "depth"):
        one, other = (next((tmp_path / name / kind).glob("*")) for name in ("below", "above"))
        assert one.read_bytes() == other.read_bytes()


def test_only_the_asked_outputs_are_drawn_and_written(rendered, street, rig, tmp_path):
    few = tmp_path / "few"
    options = {"rig": rig, "trajectory": "drive"}
    render_frames(street, few, 2, outputs=("semantic", "depth"), **options)
    folders = {path.name for path in few.iterdir() if path.is_dir()}
    assert folders == {"semantic", "depth"}
    for name in ("semantic", "depth"):
        np.testing.assert_array_equal(_read(few, name, 1), _read(rendered, name, 1))
    result = render_frames(street, few, 2, outputs=("rgb",), **options)
    assert (result.rendered, result.kept) == (2, 0)
    np.testing.assert_array_equal(_read(few, "rgb", 1), _read(rendered, "rgb", 1))
    assert len(read_frames(few)) == 2
    with pytest.raises(EnvgenError, match="--outputs instance"):
        read_frames(few)[0].instance  # noqa: B018
    with pytest.raises(EnvgenError, match="unknown outputs radar"):
        render_frames(street, few, 2, outputs=("rgb", "radar"), **options)


def test_rgb_and_semantic_need_no_instances(opengl, street, rig, tmp_path, monkeypatch):
    assert opengl

    def refuse(*_):
        raise AssertionError("nobody asked for instances")

    monkeypatch.setattr(LabelImages, "instance", property(refuse))
    result = render_frames(street, tmp_path / "few", 1, rig=rig, outputs=("rgb", "semantic"))
    assert result.rendered == 1
    with pytest.raises(AssertionError):
        render_frames(street, tmp_path / "more", 1, rig=rig, outputs=("instance",))


def test_a_full_disk_ends_the_run_and_the_next_run_goes_on(opengl, street, rig, tmp_path):
    """Files beyond 20 kB do not fit: the picture of a frame, but not its labels."""
    assert opengl
    out, whole = tmp_path / "frames", tmp_path / "whole"
    options = {"rig": rig, "outputs": ("rgb", "semantic")}
    render_frames(street, whole, 12, **options)
    size = max(path.stat().st_size for path in (whole / "semantic").iterdir())
    largest = max((whole / "rgb").iterdir(), key=lambda path: path.stat().st_size)
    assert size < largest.stat().st_size
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest.stat().st_size - 1, before[1]))
    try:
        with pytest.raises(EnvgenError) as caught:
            render_frames(street, out, 12, **options)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert str(caught.value).startswith(f"{out / 'rgb' / largest.name}: cannot be written: ")
    names = {path.name for path in out.rglob("*") if path.is_file()}
    digits = {f"{number:06d}.png" for number in range(12)}
    tables = {"cameras.json", "cameras.usda", "labels.json", "render.json"}
    assert names <= digits | tables
    assert not list(out.rglob(".*")), "no parts of files are left"
    kept = sum((out / "rgb" / name).is_file() for name in digits)
    result = render_frames(street, out, 12, **options)
    assert result.kept <= kept < 12
    assert _digests(out) == _digests(whole)


@pytest.mark.parametrize("shape", [(3, 5), (1, 1), (94, 352)])
def test_other_programs_read_the_depth(tmp_path, shape):
    """Pillow reads it with libtiff, rasterio with GDAL's own copy."""
    depth = np.random.default_rng(1).uniform(0, 900, shape).astype(np.float32)
    depth[0, 0] = 0.0
    write_depth(tmp_path / "depth.tif", depth)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "depth.tif")), depth)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        with rasterio.open(tmp_path / "depth.tif") as image:
            assert image.dtypes == ("float32",)
            np.testing.assert_array_equal(image.read(1), depth)


def test_other_programs_read_the_instances(tmp_path):
    values = np.random.default_rng(1).integers(0, 44 * INSTANCE_FACTOR, (31, 17)).astype(np.uint32)
    write_instances(tmp_path / "instance.tif", values)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "instance.tif")), values)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        with rasterio.open(tmp_path / "instance.tif") as image:
            assert image.dtypes == ("uint32",)
            np.testing.assert_array_equal(image.read(1), values)


@pytest.mark.parametrize("weather", ["random", "fog"])
def test_drawn_light_is_recorded_and_resumed(street, opengl, rig, tmp_path, weather):
    assert opengl
    out, options = tmp_path / "frames", {"rig": rig, "light": LightChoice(weather, seed=3)}
    render_frames(street, out, 10, **options)
    frames = json.loads((out / "cameras.json").read_text())["frames"]
    drawn = [(frame["weather"], frame["hour"]) for frame in frames]
    assert len(set(drawn)) == 3, "a moment lasts four frames"
    assert weather == "random" or {name for name, _ in drawn} == {"fog"}
    low, high = read_weather(drawn[0][0]).elevation
    assert low - 0.01 <= frames[0]["sun_elevation"] <= high + 0.01
    before = _digests(out)
    (out / "rgb" / "000006.png").unlink()
    assert render_frames(street, out, 10, **options).rendered == 1
    assert _digests(out) == before
    other = LightChoice(weather, seed=4)
    assert render_frames(street, out, 1, rig=rig, light=other).removed == 10


def test_the_hour_puts_the_sun_where_the_almanac_says(street, opengl, rig, tmp_path):
    """At the equinox at 9 h of solar time on 48 degrees: asin(cos 48 cos 45) = 28.2 degrees."""
    assert opengl
    choice = LightChoice("clear", hour=9.0)
    render_frames(street, tmp_path / "f", 1, rig=rig, light=choice, outputs=("rgb",))
    (frame,) = json.loads((tmp_path / "f" / "cameras.json").read_text())["frames"]
    assert frame["date"] == "03-20"
    assert frame["sun_elevation"] == pytest.approx(28.2, abs=0.5)


def test_an_edited_weather_is_drawn_anew(street, opengl, rig, tmp_path):
    assert opengl
    mine, out = tmp_path / "mine.toml", tmp_path / "frames"
    text = (resources.files("envgen_usd.renders") / "weathers" / "clear.toml").read_text()
    mine.write_text(text)
    options = {"rig": rig, "light": LightChoice(str(mine)), "outputs": ("rgb",)}
    render_frames(street, out, 1, **options)
    assert render_frames(street, out, 1, **options).kept == 1
    mine.write_text(text.replace("[15000.0, 60000.0]", "[150.0, 200.0]"))
    result = render_frames(street, out, 1, **options)
    assert (result.rendered, result.removed) == (1, 1)


def test_a_replaced_sky_texture_is_drawn_anew(street, opengl, rig, tmp_path):
    assert opengl
    stage, sky = Usd.Stage.Open(str(street)), tmp_path / "sky.exr"
    dome = UsdLux.DomeLight.Get(stage, "/World/Sky")
    dome.CreateTextureFileAttr(Sdf.AssetPath(str(sky)))
    stage.Save()
    options = {"rig": rig, "outputs": ("rgb",)}
    write_radiance_map(sky, np.full((16, 32, 3), 0.2))
    render_frames(street, tmp_path / "f", 1, **options)
    assert render_frames(street, tmp_path / "f", 1, **options).kept == 1
    write_radiance_map(sky, np.full((16, 32, 3), (0.2, 0.2, 0.4)))
    result = render_frames(street, tmp_path / "f", 1, **options)
    assert (result.rendered, result.removed) == (1, 1)

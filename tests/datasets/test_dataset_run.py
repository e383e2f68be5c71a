"""The whole way from a recipe to a data set: resumed, in shards, and read again."""

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from tests.kept_work import kept
from tests.short_roads import write_short_road
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.datasets import Frames, read_scans
from envgen_usd.datasets.dataset_index import read_index
from envgen_usd.datasets.formats.dataset_formats import write_formats
from envgen_usd.errors import EnvgenError
from envgen_usd.executors.executor import Cluster
from envgen_usd.label_taxonomy import label
from envgen_usd.recipe.dataset_merge import merge_shards
from envgen_usd.recipe.dataset_run import make_dataset
from envgen_usd.render.opengl.gl_context import open_context

CAMERA = "width = 96\nheight = 64\nfx = 60.0\nfy = 60.0\ncx = 47.5\ncy = 31.5\n"
PAIR = "".join(
    f'[[camera]]\nname = "{name}"\nposition = [1.5, {y}, 1.5]\n{CAMERA}'
    for name, y in (("left", 0.3), ("right", -0.3))
)
RECIPE = """
frames = 2
weathers = ["clear"]
rigs = ["one.toml", "pair.toml"]
[[road]]
file = "straight.xodr"
[[environment]]
country = "1"
area = "industrial"
"""


def digests(folder):
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A data set of a town at a road of 99 m with two rigs: folder, recipe, result."""
    try:
        with open_context():
            pass
    except EnvgenError as error:
        pytest.skip(str(error))
    folder, recipe, result = kept(tmp_path_factory, "dataset", make_set)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ENVGEN_USD_CACHE", str(folder.parent / "cache"))
        yield folder, recipe, result


def make_set(home):
    write_short_road(home / "straight.xodr")
    (home / "one.toml").write_text(f"[camera]\n{CAMERA}")
    (home / "pair.toml").write_text(PAIR)
    recipe = home / "recipe.toml"
    recipe.write_text(RECIPE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ENVGEN_USD_CACHE", str(home / "cache"))
        return home / "whole", recipe, make_dataset(recipe, home / "whole")


@pytest.fixture
def own(made, tmp_path):
    """A copy of the data set, which the command may write into."""
    return shutil.copytree(made[0], tmp_path / "own")


def test_the_index_lists_each_frame_of_each_camera(made):
    folder, _, result = made
    assert (result.rendered, result.kept) == (4, 0)
    frames = read_index(folder)
    assert frames == result.frames
    assert [(each.rig, each.camera, each.frame) for each in frames] == [
        ("one", "camera", 0), ("one", "camera", 1), ("pair", "left", 0), ("pair", "left", 1),
        ("pair", "right", 0), ("pair", "right", 1),
    ]  # fmt: skip
    assert all((folder / each.file(kind)).is_file() for each in frames for kind in ("rgb", "depth"))
    lines = (folder / "splits" / "train.txt").read_text().splitlines()
    assert lines[0] == "frames/straight_1_industrial_0/clear_one 000000"
    assert len(lines) == 6


def test_a_run_that_was_stopped_goes_on_to_the_same_bytes(made, own):
    folder, recipe = own, made[1]
    before = digests(folder)
    take = folder / "frames" / "straight_1_industrial_0"
    (take / "clear_pair" / "right" / "semantic" / "000001.png").unlink()
    (take / "clear_one" / "depth" / "000000.tif").unlink()
    for name in ("index.jsonl", "report.html"):
        (folder / name).unlink()

    def stop(step, done, _total):
        if step == "draw frames" and done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_dataset(recipe, folder, progress=stop)
    assert not (folder / "index.jsonl").exists()
    result = make_dataset(recipe, folder)
    assert result.rendered in {1, 2}
    assert digests(folder) == before


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def test_damaged_images_are_named_and_drawn_again(made, tmp_path):
    folder, recipe, _ = made
    out = tmp_path / "out"
    shutil.copytree(folder, out)
    before = digests(out)
    assert verify(out).exit_code == 0
    take = Path("frames/straight_1_industrial_0/clear_one")
    damage = {
        f"{take}/depth/000000.tif": flip,
        f"{take}/rgb/000000.png": lambda path: path.write_bytes(path.read_bytes()[:99]),
        f"{take}/semantic/000001.png": Path.unlink,
        f"{take}/cameras.json": flip,
    }
    for name, harm in damage.items():
        harm(out / name)
    found = verify(out)
    assert found.exit_code == 1
    assert all(f"{out / name}: " in found.output for name in damage)
    result = make_dataset(recipe, out)
    named = {issue.where for issue in result.issues if issue.kind == "dataset.damaged"}
    assert named == set(damage)
    assert result.rendered == 2
    assert digests(out) == before
    assert verify(out).exit_code == 0
    (out / "files.json").write_text("[]")
    assert [i.where for i in make_dataset(recipe, out).issues] == ["files.json"]
    assert digests(out) == before


TABLES = {
    "clear_one": ["render.json", "cameras.json", "cameras.usda", "labels.json"],
    "clear_pair": ["cameras.json", "cameras.usda", "left/cameras.json", "right/labels.json"],
}


@pytest.mark.parametrize("harm", [Path.unlink, lambda path: path.write_text(" ")])
def test_damaged_tables_are_made_again(made, tmp_path, harm):
    """They were removed for good, and without poses the next run ended in a traceback."""
    folder, recipe, _ = made
    out = tmp_path / "out"
    shutil.copytree(folder, out)
    before = digests(out)
    names = [
        f"frames/straight_1_industrial_0/{t}/{n}" for t, those in TABLES.items() for n in those
    ]
    for name in names:
        harm(out / name)
    result = make_dataset(recipe, out)
    assert {i.where for i in result.issues if i.kind == "dataset.damaged"} == set(names)
    # Without render.json, nothing tells what the images of a folder are of.
    assert (result.rendered, result.kept) == (2, 2)
    assert digests(out) == before
    assert verify(out).exit_code == 0


def test_frames_of_another_town_are_drawn_again_in_one_run(made, tmp_path):
    folder, recipe, _ = made
    out = tmp_path / "out"
    shutil.copytree(folder, out)
    before = digests(out)
    take = out / "frames" / "straight_1_industrial_0" / "clear_one"
    (out / "files.json").unlink()
    (take / "render.json").write_text(json.dumps({"fingerprint": "of another town"}))
    (take / "depth" / "000001.tif").unlink()
    result = make_dataset(recipe, out)
    assert result.kept == 2
    assert digests(out) == before


def test_an_image_that_cannot_be_read_is_named(made, tmp_path):
    folder, recipe, _ = made
    out = tmp_path / "out"
    shutil.copytree(folder, out)
    (out / "files.json").unlink()
    image = out / "frames" / "straight_1_industrial_0" / "clear_one" / "rgb" / "000000.png"
    image.write_bytes(b"no image")
    with pytest.raises(EnvgenError, match=rf"{image}: cannot be read as an image; delete it"):
        make_dataset(recipe, out)
    image.unlink()
    make_dataset(recipe, out)
    assert digests(out) == digests(folder)


@pytest.mark.parametrize("content", [b" ", b"[1]", b"\xff", b"{}"])
@pytest.mark.parametrize(
    ("name", "layout"),
    [
        ("cameras.json", "kitti360"),
        ("instance/000000.tif", "coco"),
        ("semantic/000000.png", "cityscapes"),
    ],
)
def test_layouts_name_damaged_files(made, tmp_path, name, layout, content):
    folder, _, _ = made
    shutil.copytree(folder / "frames", tmp_path / "frames")
    path = tmp_path / "frames" / "straight_1_industrial_0" / "clear_one" / name
    path.write_bytes(content)
    with pytest.raises(EnvgenError, match=rf"{path}: .*; delete it and run"):
        write_formats(tmp_path, read_index(folder), [layout])


def verify(out):
    return CliRunner().invoke(app, ["verify", str(out)])


def start(recipe, out, *more, largest=None):
    """Starts the command in a process group of its own, with at most so many bytes a file."""
    command = [sys.executable, "-m", "envgen_usd", "dataset", str(recipe), "--out", str(out)]
    if largest:
        command = ["sh", "-c", f'ulimit -f {largest // 512}; exec "$@"', "sh", *command]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen([*command, *more], start_new_session=True, **pipes)


def depths(out):
    """Number of images of depth, while others are written."""
    return sum(len(list((out / "frames").glob(f"*/*/{n}depth/*.tif"))) for n in ("", "*/"))


def whole_frames(made, out):
    """Number of frames of a drive, by all its cameras, of which every image is in the folder."""
    images = defaultdict(list)
    for path in sorted((made / "frames").rglob("0*.*")):
        name = path.relative_to(made)
        images[name.parts[2], path.stem].append(out / name)
    assert len(images) == 4
    return sum(all(path.is_file() for path in paths) for paths in images.values())


def with_towns(made, out):
    """A new folder of a data set with the towns of another."""
    shutil.copytree(made / "towns", out / "towns")
    return out


def test_a_killed_run_goes_on_to_the_same_bytes(made, tmp_path):
    """SIGKILL, which no program can handle, as soon as there are more images."""
    folder, recipe, _ = made
    out, seen = with_towns(folder, tmp_path / "out"), 0
    for jobs in ("1", "2"):
        running = start(recipe, out, "--jobs", jobs)
        while running.poll() is None and depths(out) <= seen:
            time.sleep(0.01)
        os.killpg(running.pid, signal.SIGKILL)
        said = running.communicate()[0]
        assert running.returncode == -signal.SIGKILL, said
        seen = depths(out)
        assert 0 < seen < 6
        assert not (out / "index.jsonl").exists()
    whole = whole_frames(folder, out)
    last = make_dataset(recipe, out, cluster=Cluster(workers=2))
    assert (last.rendered, last.kept) == (4 - whole, whole)
    assert digests(out) == digests(folder)


@pytest.fixture(scope="module")
def shards(made, tmp_path_factory):
    """Two parts of the data set by the command, the first in a process of its own."""
    return kept(tmp_path_factory, "dataset_shards", lambda home: make_shards(made, home))


def make_shards(made, home):
    folder, recipe, _ = made
    parts = [with_towns(folder, home / name) for name in ("one", "two")]
    running = start(recipe, parts[0], "--shard", "1/2", "--jobs", "1")
    said = running.communicate()[0]
    assert running.returncode == 0, said
    command = ["dataset", str(recipe), "--out", str(parts[1]), "--shard", "2/2", "--jobs", "1"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    assert all("frames: 2 rendered, 0 kept" in text for text in (said, result.output))
    return parts


def test_two_shards_of_the_command_are_merged_to_the_same_bytes(made, shards, tmp_path):
    folder, recipe, _ = made
    pictures = [set((part / "frames").rglob("rgb/*.png")) for part in shards]
    names = [
        {path.relative_to(part) for path in seen}
        for part, seen in zip(shards, pictures, strict=True)
    ]
    assert not names[0] & names[1]
    out = tmp_path / "merged"
    merged = CliRunner().invoke(
        app, ["dataset", "merge", str(recipe), *map(str, shards), "--out", str(out)]
    )
    assert merged.exit_code == 0, merged.output
    assert digests(out) == digests(folder)


def test_a_full_disk_is_a_line_and_the_next_run_goes_on(made, tmp_path):
    """The limit on a file's size stands for the disk."""
    folder, recipe, _ = made
    out = with_towns(folder, tmp_path / "out")
    least = min(path.stat().st_size for path in folder.rglob("frames/**/depth/*.tif"))
    running = start(recipe, out, "--jobs", "2", largest=least - 1)
    said = running.communicate()[0]
    assert running.returncode == 2, said
    line = said.splitlines()[-1]
    assert re.match(rf"envgen-usd: {re.escape(str(out))}/.*: cannot be written: ", line)
    assert "Traceback" not in said
    make_dataset(recipe, out)
    assert digests(out) == digests(folder)


def test_shards_are_merged_to_the_same_bytes(made, shards, tmp_path):
    folder, recipe, _ = made
    first, second = shards
    assert not any((part / "index.jsonl").exists() for part in shards)
    with pytest.raises(EnvgenError, match=r"2 of 4 frames are missing, .* frame 0"):
        merge_shards(recipe, [second], tmp_path / "merged")
    merge_shards(recipe, [first], tmp_path / "merged")
    assert digests(tmp_path / "merged") == digests(folder)


def test_a_damaged_file_of_a_shard_is_named_and_made_again(made, shards, tmp_path):
    folder, recipe, _ = made
    parts = [tmp_path / part.name for part in shards]
    for part, other in zip(shards, parts, strict=True):
        shutil.copytree(part, other)
    image = parts[0] / "frames" / "straight_1_industrial_0" / "clear_one" / "rgb" / "000000.png"
    flip(image)
    found = verify(parts[0])
    assert (found.exit_code, f"{image}: " in found.output) == (1, True)
    with pytest.raises(EnvgenError, match=rf"{image}: .*; run the shard again"):
        merge_shards(recipe, parts, tmp_path / "merged")
    make_dataset(recipe, parts[0], shard=(1, 2))
    merge_shards(recipe, parts, tmp_path / "merged")
    assert digests(tmp_path / "merged") == digests(folder)


def test_shards_in_one_folder_check_their_own_files(made, tmp_path):
    folder, recipe, _ = made
    out = with_towns(folder, tmp_path / "out")
    make_dataset(recipe, out, shard=(1, 2))
    first = json.loads((out / "files.json").read_text())
    image = "frames/straight_1_industrial_0/clear_one/depth/000000.tif"
    flip(out / image)
    assert make_dataset(recipe, out, shard=(2, 2)).rendered == 2
    both = json.loads((out / "files.json").read_text())
    assert first.items() < both.items()
    assert f"{out / image}: " in verify(out).output
    with pytest.raises(EnvgenError, match=rf"{out / image}: .*; run the shard again"):
        merge_shards(recipe, [], out)
    again = make_dataset(recipe, out, shard=(1, 2))
    damaged = [issue.where for issue in again.issues if issue.kind == "dataset.damaged"]
    assert (damaged, again.rendered) == ([image], 1)
    merge_shards(recipe, [], out)
    assert digests(out) == digests(folder)


def test_shards_with_scans_are_merged_to_the_same_formats(made, tmp_path):
    """A lidar at the place of the left camera, in a drive of two frames."""
    folder, recipe, _ = made
    lidar = '[[lidar]]\nname = "roof"\nmodel = "VLP-16"\nposition = [1.5, 0.3, 1.5]\n'
    recipe.with_name("scanning.toml").write_text(PAIR + lidar)
    outputs = 'outputs = ["rgb", "semantic", "instance", "boxes", "lidar"]\ntrajectory = "drive"'
    text = RECIPE.replace('"one.toml", "pair.toml"', '"scanning.toml"')
    path = recipe.with_name("scans.toml")
    path.write_text(outputs + text)
    formats = ["nuscenes", "kitti360"]
    whole = with_towns(folder, tmp_path / "whole")
    make_dataset(path, whole, formats=formats)
    parts = [with_towns(folder, tmp_path / name) for name in ("one", "two")]
    for number, part in enumerate(parts, 1):
        make_dataset(path, part, shard=(number, 2))
    merge_shards(path, parts, tmp_path / "merged", formats=formats)
    assert digests(tmp_path / "merged") == digests(whole)
    before = digests(whole)
    for name in ("lidar.json", "labels.json"):
        next(whole.glob(f"frames/*/*/roof/{name}")).unlink()
    make_dataset(path, whole, formats=formats)
    assert digests(whole) == before
    scans = read_scans(whole)
    assert [scan.number for scan in scans] == [0, 1]
    for name in ("nuscenes/samples/LIDAR_TOP/*.pcd.bin", "kitti360/scanning/data_3d_raw/*/*/*/*"):
        assert len(list(whole.glob(name))) == 2
    for scan in scans:
        image = whole / "frames" / scan.folder.parent.relative_to(whole / "frames") / "left"
        semantic = np.asarray(Image.open(image / "semantic" / f"{scan.number:06d}.png"))
        x, y, z = scan.points[:, :3].T.astype(float)
        u, v = np.round(47.5 - 60.0 * y / x), np.round(31.5 - 60.0 * z / x)
        ahead = (x > 1.0) & (np.abs(u - 47.5) < 46) & (np.abs(v - 31.5) < 30)
        columns, rows = u[ahead].astype(int), v[ahead].astype(int)
        steps = [(down, right) for down in (-1, 0, 1) for right in (-1, 0, 1)]
        around = np.array([semantic[rows + down, columns + right] for down, right in steps])
        plain = (around == semantic[rows, columns]).all(axis=0)
        assert np.count_nonzero(plain) > 500
        # Others lie on fences and poles thinner than a pixel; of mirrored points, half agree.
        assert (semantic[rows, columns] == scan.classes[ahead])[plain].mean() > 0.9


def test_a_folder_of_another_recipe_is_left_alone(made, own, tmp_path):
    folder, recipe = own, made[1]
    before = digests(folder)
    other = recipe.with_name("other.toml")
    other.write_text(RECIPE.replace("frames = 2", "frames = 3"))
    with pytest.raises(EnvgenError, match=r"dataset.json: holds another .*: frames is 2, not 3"):
        make_dataset(other, folder)
    with pytest.raises(EnvgenError, match=r"is of another recipe than .*dataset.json"):
        merge_shards(other, [folder], tmp_path / "merged")
    for name in ("recipe.toml", "one.toml", "pair.toml", "straight.xodr"):
        shutil.copy(recipe.with_name(name), tmp_path / name)
    rig = tmp_path / "pair.toml"
    rig.write_text(rig.read_text().replace("fx = 60.0", "fx = 61.0"))
    with pytest.raises(EnvgenError, match=r"frames: pair\.toml had another content; choose"):
        make_dataset(tmp_path / "recipe.toml", folder)
    assert digests(folder) == before
    (tmp_path / "mine" / "frames").mkdir(parents=True)
    with pytest.raises(EnvgenError, match="holds frames of no known recipe"):
        make_dataset(recipe, tmp_path / "mine")


def test_a_layout_that_is_not_asked_for_any_more_is_named(made, tmp_path):
    folder, recipe, _ = made
    out = tmp_path / "out"
    shutil.copytree(folder, out)
    first = make_dataset(recipe, out, formats=["webdataset"])
    before = digests(out / "webdataset")
    again = make_dataset(recipe, out)
    assert [i for i in first.issues if i.kind == "dataset.earlier_format"] == []
    found = [i.where for i in again.issues if i.kind == "dataset.earlier_format"]
    assert found == ["webdataset"]
    assert digests(out / "webdataset") == before


def test_frames_is_a_data_set_for_training(made):
    folder, _, _ = made
    frames = Frames(folder, "train", ids="cityscapes_train_id")
    picture, classes = frames[3]
    assert len(frames) == 6
    row = frames.frames[3]
    rgb = np.asarray(Image.open(folder / row.file("rgb")))
    semantic = np.asarray(Image.open(folder / row.file("semantic")))
    np.testing.assert_array_equal((picture * 255).round().permute(1, 2, 0), rgb)
    np.testing.assert_array_equal(classes == 10, semantic == label("sky").id)
    np.testing.assert_array_equal(classes == 9, semantic == label("terrain").id)
    with pytest.raises(EnvgenError, match="unknown split night; known: train"):
        Frames(folder, "night")


def test_the_readme_trains(made, monkeypatch):
    folder, _, _ = made
    page = (Path(__file__).parents[2] / "README.md").read_text("utf-8")
    code = re.search(r"```python\n(import torch.*?)```", page, re.DOTALL)
    monkeypatch.chdir(folder.parent)
    scope: dict[str, Any] = {}
    exec(code[1].replace('"set"', f'"{folder.name}"'), scope)
    assert 0.0 < scope["loss"].item() < 10.0


def test_the_sheets_show_pictures_beside_labels(made, tmp_path):
    folder, _, _ = made
    shutil.copytree(folder, tmp_path / "set", ignore=shutil.ignore_patterns("preview", "towns"))
    result = CliRunner().invoke(app, ["dataset", "preview", str(tmp_path / "set"), "--frames", "1"])
    assert result.exit_code == 0, result.output
    sheets = sorted((tmp_path / "set" / "preview").iterdir())
    assert [str(sheet) for sheet in sheets] == sorted(result.stdout.split())
    assert len(sheets) == 3
    pixels = np.asarray(Image.open(sheets[0])).astype(int)
    assert pixels.shape[1] == 2 * 352
    sky = np.abs(pixels[:, 352:] - label("sky").colour).max(axis=2) < 12
    semantic = np.asarray(Image.open(folder / read_index(folder)[0].file("semantic")))
    assert sky[:234].mean() == pytest.approx((semantic == label("sky").id).mean(), abs=0.04)


def test_the_report_counts_pixels_and_draws_the_map(made):
    folder, _, _ = made
    page = (folder / "report.html").read_text()
    ids = [np.asarray(Image.open(folder / row.file("semantic"))) for row in read_index(folder)]
    share = (np.array(ids) == label("road").id).mean()
    assert f"<td>road</td><td>{share:.2%}</td>" in page
    assert page.count("<circle") == 6
    recipe = json.loads((folder / "dataset.json").read_text())["recipe"]
    assert recipe["road"] == [{"file": "straight.xodr", "split": ""}]


def test_a_folder_of_a_build_keeps_its_report(made, own):
    town, recipe = own / "towns" / "straight_1_industrial_0", made[1]
    before = digests(town)
    with pytest.raises(EnvgenError, match=r"holds the environment of a build; choose another"):
        make_dataset(recipe, town)
    with pytest.raises(EnvgenError, match=r"holds the environment of a build; choose another"):
        merge_shards(recipe, [own], town)
    assert digests(town) == before

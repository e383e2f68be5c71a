"""Recipes of data sets: what they ask for, and what is wrong with them."""

import re
import shutil

import pytest
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.errors import EnvgenError
from envgen_usd.recipe import dataset_recipe
from envgen_usd.recipe.build_options import demo_road
from envgen_usd.recipe.dataset_plan import parse_shard, shard_of, takes_of
from envgen_usd.recipe.dataset_recipe import (
    TrafficChoice,
    read_recipe,
    recipe_file,
    recipe_mark,
    recipe_values,
)
from envgen_usd.traffic.traces import sumo_run

GOOD = """
frames = 7
seeds = [5, 0]
weathers = ["clear", "stage"]
rigs = ["camvid", "kitti_360_rig"]
[[road]]
file = "town"
[[road]]
file = "straight"
split = "val"
[[environment]]
country = "1"
area = "residential"
[splits]
train = 0.75
val = 0.25
"""


@pytest.fixture
def write(tmp_path):
    def written(*changes):
        text = GOOD
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        path = tmp_path / "mine.toml"
        path.write_text(text)
        return path

    return written


def test_the_takes_are_all_combinations_and_share_no_seed(write):
    takes = takes_of(read_recipe(write()))
    assert len(takes) == 2 * 1 * 2 * 2 * 2
    assert len({take.folder for take in takes}) == len({take.seed for take in takes}) == 16
    assert takes[0].folder == "frames/town_1_residential_5/clear_camvid"
    assert {take.weather for take in takes} == {"clear", ""}


def test_a_take_does_not_change_with_the_others(write):
    few = takes_of(read_recipe(write(('weathers = ["clear", "stage"]', 'weathers = ["stage"]'))))
    assert set(few) < set(takes_of(read_recipe(write())))


@pytest.mark.parametrize("count", [1, 2, 3, 5, 112, 200])
def test_shards_are_disjoint_and_whole(write, count):
    takes = takes_of(read_recipe(write()))
    shards = [shard_of(takes, (number, count)) for number in range(1, count + 1)]
    frames = [
        [(block.take.folder, number) for block in shard for number in block.numbers]
        for shard in shards
    ]
    sizes = [len(each) for each in frames]
    assert max(sizes) - min(sizes) <= 1
    everything = [frame for each in frames for frame in each]
    assert everything == [(take.folder, n) for take in takes for n in range(7)]


DEVICE = """name = "mine"
elevations = [1.0, -1.0]
columns = 10
rate = 10.0
range = 50.0
dim_range = 20.0
"""
LIDAR = """
[camera]
width = 4
height = 4
fx = 4.0
fy = 4.0
cx = 1.5
cy = 1.5
[[lidar]]
name = "roof"
model = "device.toml"
position = [1.0, 0.0, 1.9]
"""


def test_the_mark_of_a_recipe_follows_the_device_of_a_lidar(write, tmp_path):
    (tmp_path / "rig.toml").write_text(LIDAR)
    (tmp_path / "device.toml").write_text(DEVICE)
    outputs = 'outputs = ["lidar"]\nlidar_format = "las"\nlidar_motion = true\nrigs = ["rig.toml"]'
    path = write(('rigs = ["camvid", "kitti_360_rig"]', outputs))
    recipe = read_recipe(path)
    assert (recipe.lidar.format, recipe.lidar.motion) == ("las", True)
    mark = recipe_mark(recipe)
    (tmp_path / "device.toml").write_text(DEVICE.replace("50.0", "60.0"))
    assert recipe_mark(read_recipe(path)) != mark


TRAFFIC = (("[splits]", "[traffic]\nvehicles = 3\npedestrians = 0\nseconds = 2.5\n[splits]"),)


def test_traffic_needs_sumo_and_somebody_before_the_first_town(write, monkeypatch):
    monkeypatch.setattr(sumo_run.importlib.util, "find_spec", lambda _: None)
    monkeypatch.delenv("SUMO_HOME", raising=False)
    with pytest.raises(EnvgenError, match=r"mine.toml: traffic: .*envgen-usd\[traffic\]"):
        read_recipe(write(*TRAFFIC))
    monkeypatch.setattr(dataset_recipe, "sumo_home", lambda: None)
    recipe = read_recipe(write(*TRAFFIC))
    assert recipe.traffic == TrafficChoice(3, 0, 2.5)
    with pytest.raises(EnvgenError, match="traffic: give at least one vehicle or pedestrian"):
        read_recipe(write(*TRAFFIC, ("vehicles = 3", "vehicles = 0")))
    # Frames with traffic are those of another recipe; without it, the mark is as before.
    assert recipe_mark(recipe) != recipe_mark(read_recipe(write()))
    assert "traffic" not in recipe_values(read_recipe(write()))


@pytest.mark.parametrize("text", ["0/2", "3/2", "1", "a/b", "1/2/3", "-1/2", "1/0"])
def test_shards_that_make_no_sense(text):
    with pytest.raises(EnvgenError, match=re.escape(f"--shard {text}")):
        parse_shard(text)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("frames = 7", "framez = 7", "missing frames; unknown framez"),
        ("frames = 7", "frames = 0", "frames: expected a whole number"),
        ('file = "town"', 'file = "gone.xodr"', r"road\[0\]: file: no road "),
        ('file = "town"', 'fyle = "town"', r"road\[0\]: missing file; unknown fyle"),
        ('"clear"', '"hail"', r"weathers\[0\]: unknown weather hail"),
        ('"clear"', '"stage"', "weathers: stage stands twice"),
        ('"camvid"', '"eye"', r"rigs\[0\]: unknown rig eye"),
        ('"camvid"', '"blind.toml"', r"rigs\[0\]: .*camera: expected at least one camera"),
        ("[5, 0]", "[]", "seeds: expected at least one"),
        ("[5, 0]", '"x"', "seeds: expected a list of whole numbers, not 'x'"),
        ('["clear", "stage"]', "true", "weathers: expected a list of texts, not true"),
        ("frames = 7", 'frames = 7\noutputs = ["lidar"]', r"rigs\[0\]: camvid: lidar: the rig has"),
        ("frames = 7", 'frames = 7\nlidar_format = "pcd"', "lidar_format: unknown lidar format"),
        ("frames = 7", "frames = 7\nlidar_motion = 1", "lidar_motion: expected true or false"),
        ('area = "residential"', 'area = "lunar"', r"environment\[0\]: unknown area type"),
        ("train = 0.75", "train = 0.85", "splits: shares add up to 1.1, so they overlap"),
        ("train = 0.75", "train = 0.5", "splits: shares add up to 0.75, so they leave"),
        ('split = "val"', 'split = "vla"', r"road\[1\]: split: unknown vla; splits: train, val"),
        ("frames = 7", 'frames = 7\noutputs = ["rgb", "radar"]', "outputs: unknown radar"),
        ("frames = 7", 'frames = 7\nresponse = "film"', "response: unknown film"),
        ("frames = 7", 'frames = 7\nseason = "monsoon"', "season: unknown season monsoon"),
        ("frames = 7", 'frames = 7\ntrajectory = "fly"', "trajectory: unknown trajectory fly"),
        ("frames = 7", 'frames = 7\ntrajectory = "traffic"', "trajectory: traffic needs vehicles"),
    ],
)
def test_a_faulty_recipe_is_named_with_its_key(write, tmp_path, old, new, said):
    (tmp_path / "blind.toml").write_text("camera = []\n")
    with pytest.raises(EnvgenError, match=rf"mine\.toml: {said}") as caught:
        read_recipe(write((old, new)))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("key", "options", "said"),
    [
        ('formats = ["nuscenes"]', [], "formats: .*take lidar_format kitti or npy, not las"),
        ("", ["--format", "kitti360"], "--format: .*take lidar_format kitti or npy, not las"),
        ("", ["--rerun"], "lidar_format: .*take lidar_format kitti or npy, not las"),
    ],
)
def test_scans_in_the_world_are_refused_before_the_first_town(write, tmp_path, key, options, said):
    if options == ["--rerun"]:
        pytest.importorskip("rerun")
        options = ["--rerun", str(tmp_path / "set.rrd")]
    outputs = 'outputs = ["rgb", "semantic", "instance", "boxes", "lidar"]\nlidar_format = "las"'
    path = write(('"camvid", ', ""), ("frames = 7", f"frames = 7\n{outputs}\n{key}"))
    command = ["dataset", "make", str(path), "--out", str(tmp_path / "set"), *options]
    result = CliRunner().invoke(app, command)
    assert isinstance(result.exception, EnvgenError)
    assert re.search(said, str(result.exception))
    assert not (tmp_path / "set").exists()


def test_one_road_under_two_names_would_be_in_two_splits(write, tmp_path):
    shutil.copy(demo_road("town"), tmp_path / "other.xodr")
    with pytest.raises(EnvgenError, match=r"road\[1\]: file: other.xodr is the road of road\[0\]"):
        read_recipe(write(('file = "straight"', 'file = "other.xodr"')))


def test_the_mark_follows_from_contents_and_not_from_the_place(write, tmp_path):
    shutil.copy(demo_road("town"), tmp_path / "mine.xodr")
    here = read_recipe(write(('file = "town"', 'file = "mine.xodr"')))
    moved = tmp_path / "moved"
    moved.mkdir()
    for name in ("mine.toml", "mine.xodr"):
        shutil.copy(tmp_path / name, moved / name)
    assert recipe_mark(read_recipe(moved / "mine.toml")) == recipe_mark(here)
    with (moved / "mine.xodr").open("a") as road:
        road.write("<!-- another -->")
    assert recipe_mark(read_recipe(moved / "mine.toml")) != recipe_mark(here)


def test_the_recipe_of_the_article_has_its_number_of_images():
    takes = takes_of(read_recipe(recipe_file("article")))
    assert sum(take.frames for take in takes) == 2388
    assert len({(take.town.country, take.town.area) for take in takes}) == 4


def test_an_unknown_recipe_is_told_the_shipped_ones():
    with pytest.raises(EnvgenError, match=r"nothing.toml: no such recipe; .*article"):
        recipe_file("nothing.toml")

"""Squares of places: channels, fields, files, and halves that do not overlap."""

import numpy as np
import pytest
import shapely
from scipy import ndimage
from typer.testing import CliRunner

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.commands.landuse_commands import app
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.network.data.landuse_scenes import make_scene
from envgen_usd.landuse.network.data.place_channels import (
    CHOSEN,
    CORE,
    GIVEN,
    HOUSE,
    of_place_channels,
    to_place_channels,
)
from envgen_usd.landuse.network.data.place_sample import (
    AROUND,
    PLACE_RAW,
    REACH,
    place_condition,
    place_fields,
    read_place_samples,
    write_place_samples,
)
from envgen_usd.landuse.network.training.training_batches import turn
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.recipe.place_windows import MappedPlace, place_samples, rule_sample

METRE = 1 / 111_320.0
SIDE = 128


def town(path):
    """A street from west to east with a row of houses on each side, 40 m apart."""
    nodes, ways = [], []

    def way(points, tags):
        first = len(nodes) + 1
        nodes.extend(
            f'<node id="{first + n}" version="1" lat="{y * METRE}" lon="{x * METRE}"/>'
            for n, (x, y) in enumerate(points)
        )
        refs = [*range(first, first + len(points))] + ([first] if "building" in tags else [])
        inside = "".join(f'<nd ref="{ref}"/>' for ref in refs)
        inside += "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
        ways.append(f'<way id="{len(ways) + 1}" version="1">{inside}</way>')

    way([(-300, 0), (300, 0)], {"highway": "residential"})
    for x in range(-280, 281, 20):
        for y in (-90, -14, 14, 90):
            corners = [(x - 5, y - 4), (x + 5, y - 4), (x + 5, y + 4), (x - 5, y + 4)]
            way(corners, {"building": "house", "building:levels": "2"})
    text = f'<?xml version="1.0"?><osm version="0.6">{"".join(nodes + ways)}</osm>'
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    return MappedPlace.read(town(tmp_path_factory.mktemp("osm") / "town.osm"))


def test_channels_and_classes_go_back_and_forth():
    rng = np.random.default_rng(0)
    classes = rng.choice((*GIVEN, *CHOSEN), (40, 40)).astype(np.uint8)
    built = np.isin(classes, (LanduseClass.LAWN, LanduseClass.RUBBLE)) & (
        rng.random((40, 40)) < 0.5
    )
    channels = to_place_channels(classes, built)
    back, walls = of_place_channels(channels)
    hall = (channels == CORE) & (classes == LanduseClass.RUBBLE)
    assert np.array_equal(back[~hall], classes[~hall])
    assert np.array_equal(walls, built)
    assert np.array_equal(channels < len(GIVEN), np.isin(classes, GIVEN))


def test_a_sample_holds_the_street_and_its_houses(mapped):
    sample = mapped.sample((-64, -64), SIDE)
    assert sample.side == SIDE
    assert np.count_nonzero(sample.channels >= HOUSE) * CELL_SIZE**2 == pytest.approx(
        10 * 80, rel=0.25
    )
    core = ndimage.label(sample.channels == CORE)[1]
    assert core == ndimage.label(sample.channels >= HOUSE)[1] > 0
    distance, x, y, barrier = sample.raw.astype(float)
    rows = (np.arange(SIDE // 2) * 2 + 0.5 - 64) * CELL_SIZE
    expected = np.maximum(np.abs(rows) - 5.0, 0.0)
    assert np.abs(distance - expected[:, None]).max() < 2 * CELL_SIZE
    assert np.all(y[rows > 8] > 0.99)
    assert np.all(y[rows < -8] < -0.99)
    assert np.abs(x).max() < 0.01
    assert np.all(barrier == REACH)


def test_fields_do_not_depend_on_where_a_square_is_cut():
    rng = np.random.default_rng(1)
    classes = np.full((2 * AROUND + 96, 2 * AROUND + 96), LanduseClass.GRASS, np.uint8)
    for row, column in rng.integers(0, len(classes), (6, 2)):
        classes[row : row + 3, column:] = LanduseClass.ROAD
    whole = place_fields(classes)
    part = place_fields(classes[32:, 16:][: 2 * AROUND + 48, : 2 * AROUND + 48])
    assert np.array_equal(part, whole[:, 16:40, 8:32])


def test_a_turned_sample_points_the_other_way(mapped):
    sample = mapped.sample((-64, -64), SIDE)
    turned = turn(sample, 1)
    assert np.array_equal(turned.channels, np.rot90(sample.channels))
    row, column = np.argwhere(sample.raw[PLACE_RAW.index("normal_y")] > 0.99)[0]
    there = np.argwhere(np.rot90(np.arange(64**2).reshape(64, 64)) == row * 64 + column)[0]
    x, y = turned.raw[[1, 2], there[0], there[1]]
    assert (abs(x), abs(y)) == pytest.approx((1, 0), abs=0.02)


def test_halves_share_no_cell_and_a_file_comes_back(mapped, tmp_path):
    halves = {
        name: [one for _, one in place_samples(mapped, mapped.half(name), SIDE, SIDE)]
        for name in ("west", "east")
    }
    assert all(halves.values())
    west, east = mapped.half("west"), mapped.half("east")
    assert shapely.box(*west).intersection(shapely.box(*east)).area == 0
    write_place_samples(halves["west"], tmp_path / "west.npz")
    back = read_place_samples(tmp_path / "west.npz")
    assert len(back) == len(halves["west"])
    for one, other in zip(back, halves["west"], strict=True):
        assert np.array_equal(one.channels, other.channels)
        assert np.array_equal(one.raw, other.raw)
        assert np.array_equal(one.plots, other.plots)
        assert np.array_equal(one.condition, other.condition)


def test_conditions_are_finite_without_heights_and_houses():
    condition = place_condition(np.array([0.0, 0.0, np.nan, 0.0]))
    known = place_condition(np.array([0.2, 200.0, 8.0, 1.0]))
    assert np.all(np.isfinite(condition))
    assert known.tolist() == [0, 0, 0, 1, 1, 1]
    by_rules = place_condition(np.array([0.2, 200.0, 8.0, 1.0]), is_real=False)
    assert by_rules.tolist() == [0, 0, 0, 1, 1, -1]


def test_the_command_writes_squares(tmp_path):
    extract = town(tmp_path / "town.osm")
    out = tmp_path / "all.npz"
    arguments = ["places", str(extract), "--out", str(out), "--side", "128", "--step", "128"]
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    assert len(read_place_samples(out)) == int(result.output.split("squares: ")[1].split()[0])


def test_what_is_no_file_of_squares_is_refused(tmp_path):
    none = r"is no file of squares, or damaged; envgen-usd landuse places makes one"
    (tmp_path / "a.npz").write_bytes(b"nothing")
    np.savez(tmp_path / "b.npz", classes=np.zeros(3))
    (tmp_path / "c.npz").write_bytes((tmp_path / "b.npz").read_bytes()[:150])
    np.save(tmp_path / "d.npy", np.zeros(3))
    (tmp_path / "d.npy").rename(tmp_path / "d.npz")
    said = {**dict.fromkeys(("a.npz", "b.npz", "c.npz", "d.npz"), none), "e.npz": "no such file"}
    for name, match in {**said, "": "is a folder, not a file"}.items():
        with pytest.raises(EnvgenError, match=rf"--places {tmp_path / name}: {match}"):
            read_place_samples(tmp_path / name)


def test_a_town_by_rules_is_a_place():
    """Its roads are those of the layout, and its houses stand on plots."""
    scene = make_scene("untold", 1, 0)
    one = rule_sample(1, 0, 256)
    assert one.side == 256
    steps = (np.arange(256) + 127.5) * CELL_SIZE
    road = Outline.of(scene.surface).encloses_grid(steps, steps)
    assert np.array_equal(one.classes == LanduseClass.ROAD, road)
    assert one.built.any()
    assert np.all(one.plots[one.built] > 0)
    assert one.condition[4] == (1 if LanduseClass.RUBBLE in one.classes else -1)

import numpy as np
import pytest
import rasterio
import torch
from PIL import Image
from rasterio.transform import Affine
from typer.testing import CliRunner

from envgen_usd.chunks import LANDUSE_CELLS
from envgen_usd.commands.landuse_commands import app
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.data.environment_conditions import CONDITIONS
from envgen_usd.landuse.network.data.known_fields import FIELDS
from envgen_usd.landuse.network.model.generator import make_generator
from envgen_usd.landuse.network.model.network_config import NetworkConfig
from envgen_usd.landuse.network.training.weights_file import read_target, write_weights

TINY = NetworkConfig(
    FIELDS, CONDITIONS, head=(8, 8, 8), dim=8, heads=2, style=8, mapping=1, refine=(8, 8, 8, 8)
)
OSM = """<osm version="0.6">
<node id="1" version="1" lat="0.0001" lon="0.0001"/>
<node id="2" version="1" lat="0.0015" lon="0.0016"/>
<way id="3" version="1"><nd ref="1"/><nd ref="2"/><tag k="highway" v="residential"/></way></osm>"""


def run(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    if isinstance(result.exception, EnvgenError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("weights") / "tiny.safetensors"
    write_weights(make_generator(TINY), path)
    return path


def test_a_sheet_shows_all_environments(tmp_path):
    run("rules", "--preview", tmp_path / "sheet.png", "--samples", 1)
    with Image.open(tmp_path / "sheet.png") as sheet:
        assert sheet.width >= 2 * LANDUSE_CELLS
        assert sheet.height >= 4 * 2 * LANDUSE_CELLS


def test_a_sheet_of_a_network(tmp_path, weights):
    options = ("--samples", 1, "--country", 1, "--area", "industrial")
    run("sample", weights, "--preview", tmp_path / "sheet.png", *options)
    assert (tmp_path / "sheet.png").stat().st_size > 0


def test_a_network_is_measured_on_both_splits(weights):
    printed = run("eval", weights, "--windows", 1, "--draws", 1)
    for name in ("determined split", "random split", "| rules, drawn again |", "| network |"):
        assert name in printed


def test_rasters_of_an_extract_are_learnt_from(tmp_path):
    (tmp_path / "map.osm").write_text(OSM, encoding="utf-8")
    run("from-osm", tmp_path / "map.osm", "--out", tmp_path / "rasters")
    options = ("--data", tmp_path / "rasters", "--images", 8, "--size", 64)
    run("train", *options, "--network", "unet", "--out", tmp_path / "run")
    made = {path.name for path in (tmp_path / "run").iterdir()}
    assert made >= {"weights.safetensors", "state.pt", "curves.csv", "curves.png", "samples.png"}


def test_a_network_learns_from_rules(tmp_path):
    options = ("--samples", 1, "--images", 4, "--size", 64, "--adversarial", 0.1)
    run("train", *options, "--out", tmp_path / "run")
    assert (tmp_path / "run" / "weights.safetensors").is_file()


def test_values_of_rasters_take_the_classes_of_the_map(tmp_path):
    values = np.full((70, 90), 9, dtype=np.uint8)
    values[30:36] = 200
    (tmp_path / "maps").mkdir()
    Image.fromarray(values).save(tmp_path / "maps" / "a.png")
    data = ("--data", tmp_path / "maps", "--out", tmp_path)
    with pytest.raises(EnvgenError, match="give --classes"):
        run("train", *data)
    (tmp_path / "map.toml").write_text('[classes]\n200 = "road"\n9 = "forest"\n')
    with pytest.raises(EnvgenError, match=r"expected one of .*, not 'forest'"):
        run(
            "train",
            "--data",
            tmp_path / "maps",
            "--classes",
            tmp_path / "map.toml",
            "--out",
            tmp_path,
        )


def test_a_network_learns_heights_from_drawn_land(tmp_path):
    options = ("--target", "height", "--samples", 1, "--images", 4, "--size", 64)
    run("train", *options, "--out", tmp_path / "run")
    made = {path.name for path in (tmp_path / "run").iterdir()}
    assert made >= {"weights.safetensors", "state.pt", "curves.csv", "curves.png", "samples.png"}
    weights = tmp_path / "run" / "weights.safetensors"
    printed = run("eval", weights, "--windows", 1)
    for name in ("RMSE, m", "| mean of the road |", "| membrane |", "| network |"):
        assert name in printed
    run("sample", weights, "--preview", tmp_path / "sheet.png", "--samples", 1)
    with Image.open(tmp_path / "sheet.png") as sheet:
        assert sheet.width >= 3 * 2 * LANDUSE_CELLS
    with pytest.raises(EnvgenError, match="no --country"):
        run("sample", weights, "--preview", tmp_path / "sheet.png", "--country", 1)
    with pytest.raises(EnvgenError, match="--by-layout: has no effect with a network of heights"):
        run("eval", weights, "--by-layout")


def test_a_network_learns_heights_from_a_dem(tmp_path):
    rows = np.indices((70, 70))[0]
    profile = {"driver": "GTiff", "width": 70, "height": 70, "count": 1, "dtype": "float32"}
    (tmp_path / "dems").mkdir()
    transform = Affine(12.0, 0.0, 0.0, 0.0, -12.0, 0.0)
    with rasterio.open(tmp_path / "dems" / "a.tif", "w", **profile, transform=transform) as file:
        file.write(0.1 * rows.astype(np.float32), 1)
    options = ("--data", tmp_path / "dems", "--samples", 1, "--images", 4, "--size", 64)
    run("train", "--target", "height", "--network", "unet", *options, "--out", tmp_path / "run")
    assert read_target(tmp_path / "run" / "weights.safetensors") == "height"


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (("sample", "none.safetensors", "--preview", "x.png"), "no such file"),
        (("rules", "--preview", "x.png", "--country", "9"), "no environment"),
        (("train", "--out", "x", "--data", "none"), "--data none: no such folder"),
        (("train", "--out", "x", "--data", "file"), "--data file: is a file, not a folder"),
        (("train", "--out", "file"), "file: is a file; choose a folder"),
        (("train", "--out", "x", "--places", "none.npz"), "--places none.npz: no such file"),
        (("rules", "--preview", "x.txt"), "x.txt: choose a name that ends in .png or .jpg"),
        (("rules", "--preview", "x"), "x: choose a name that ends in .png or .jpg"),
        (("rules", "--preview", "folder.png"), "folder.png: is a folder; choose the name of a"),
        (("rules", "--preview", "file/x.png"), "file: cannot be written"),
        (("sample", "--preview", "x.txt"), "x.txt: choose a name that ends in .png or .jpg"),
        (("places", "--towns", 1, "--out", "x.tif"), "x.tif: choose a name that ends in .npz"),
        (("places", "--towns", 1, "--out", "x"), "x: choose a name that ends in .npz"),
        (("from-osm", ".", "--out", "x"), ": is a folder, not a file; name an OpenStreetMap"),
        (("from-osm", "none.osm", "--out", "file"), "file: is a file; choose a folder"),
        (
            ("train", "--out", "x", "--network", "large"),
            "choose from small, article, unet, diffusion",
        ),
        (
            ("train", "--out", "x", "--network", "diffusion", "--target", "height"),
            "generates classes",
        ),
        (("train", "--out", "x", "--classes", "map.toml"), "needs --data"),
        (("train", "--out", "x", "--target", "colour"), "choose from landuse, height"),
        (("from-osm", "none.osm", "--out", "x"), "none.osm: no such file"),
        (("train", "--out", "x", "--data", "d", "--samples", 9), "--samples: has no effect with"),
        (("train", "--out", "x", "--places", "p.npz", "--cache", "c"), "--cache: has no effect"),
        (("places", "--out", "x.npz", "--half", "west"), "--half: has no effect without extracts"),
    ],
)
def test_bad_input_is_named(words, match, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(EnvgenError, match=match):
        run(*words)
    assert not (tmp_path / "x").exists()

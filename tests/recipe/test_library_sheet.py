"""What `library show` and `library preview` say agrees with what is there."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.asset_import import ImportOptions, import_asset
from envgen_usd.assets.asset_summary import summarise
from envgen_usd.assets.library_drafts import new_library
from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.asset_uses import asset_uses
from envgen_usd.recipe.library_sheet import write_sheet

CELL = 208
"""Side of a picture on a sheet, pixels."""


def middle_of(sheet, number):
    """Mean colour of the middle of a cell; a row has nine."""
    column, row = number % 9, number // 9
    x, y = column * CELL, row * (CELL + 30)
    return sheet[y + 85 : y + 125, x + 90 : x + 118].reshape(-1, 3).mean(axis=0)


def test_a_sheet_has_a_picture_of_each_variant_in_its_colour(tmp_path):
    out = tmp_path / "sheet.png"
    asset = read_catalogue().assets["mailbox"]
    assert asset.variants == {"colour": ("blue", "red", "yellow"), "design": ("case", "pillar")}
    assert write_sheet(None, ["mailbox"], out) == 5
    sheet = np.asarray(Image.open(out)).astype(float)
    assert sheet.shape == (CELL + 30, 5 * CELL, 3)
    blue, red, yellow = (middle_of(sheet, number) for number in range(3))
    assert blue.argmax() == 2
    assert red.argmax() == 0
    assert red[1] < 0.5 * red[0]
    assert yellow.argmin() == 2
    assert yellow[1] > 0.6 * yellow[0]


def test_a_kind_stands_for_all_its_assets(tmp_path):
    library = tmp_path / "library"
    new_library(library)
    shutil.rmtree(library / "assets" / "gate")  # Those of the library have 75 variants.
    for name, kind in (("oak", "gate"), ("iron", "gate"), ("plank", "bench")):
        trimesh.creation.box((0.5, 0.5, 0.5)).export(tmp_path / f"{name}.glb")
        import_asset(tmp_path / f"{name}.glb", library, ImportOptions(kind))
    assert write_sheet(library, ["oak"], tmp_path / "one.png") == 1
    assert write_sheet(library, ["gate"], tmp_path / "all.png") == 2
    assert write_sheet(library, ["gate", "plank"], tmp_path / "more.png") == 3


def test_a_sheet_of_materials_shows_their_colours(tmp_path):
    out = tmp_path / "sheet.png"
    assert write_sheet(None, ["paint_red", "grass_lush", "paint_white"], out, materials=True) == 3
    sheet = np.asarray(Image.open(out)).astype(float)
    red, green, white = (middle_of(sheet, number) for number in range(3))
    assert red.argmax() == 0
    assert green.argmax() == 1
    assert white.min() > max(red.min(), green.min()) + 50


@pytest.mark.parametrize(
    ("names", "materials", "out", "said"),
    [
        (["tub"], False, "a.png", "unknown asset 'tub'"),
        (["gold"], True, "a.png", "unknown material 'gold'"),
        ([], False, "a.jpg", "ends in .png"),
    ],
)
def test_what_cannot_be_drawn_is_named(names, materials, out, said, tmp_path):
    with pytest.raises(EnvgenError, match=said):
        write_sheet(None, names, tmp_path / out, materials=materials)
    assert not (tmp_path / out).exists()


def test_the_figures_of_an_asset_are_those_of_its_meshes(tmp_path):
    library = tmp_path / "library"
    new_library(library)
    scene = trimesh.Scene()
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.4)
    scene.add_geometry(ball, node_name="lid", geom_name="lid")
    scene.add_geometry(trimesh.creation.box((0.5, 0.5, 0.5)), node_name="Body", geom_name="Body")
    (tmp_path / "tub.glb").write_bytes(scene.export(file_type="glb"))
    made = import_asset(tmp_path / "tub.glb", library, ImportOptions("bin"))
    catalogue = read_catalogue(library)
    (summary,) = summarise(library, catalogue.assets["tub"])
    assert summary.near == len(ball.faces) + 12
    assert summary.far == made.triangles[1] < 200
    assert summary.size == pytest.approx((0.8, 0.8, 0.8), abs=0.01)
    assert summary.parts == ("body", "lid")
    assert summary.materials == made.materials


def test_uses_are_those_of_the_environment_files():
    catalogue = read_catalogue()
    folder = Path(catalogue.folder) / "environments"
    found = {use.environment: use for use in asset_uses(catalogue, catalogue.assets["bench"])}
    for path in folder.glob("*/*.toml"):
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        name = f"{path.parent.name.removeprefix('country_')}/{path.stem}"
        assert found[name].spacing == data["furniture"]["bench"]
        assert found[name].share == 1.0
        stated = data.get("props", {}).get("bench", {}).get("variants", {})
        assert {key: dict(of) for key, of in found[name].variants.items()} == stated
    conifer = [
        use
        for use in asset_uses(catalogue, catalogue.assets["tree_conifer"])
        if (use.environment, use.table) == ("1/residential", "trees")
    ]
    assert conifer[0].share == pytest.approx(0.25)

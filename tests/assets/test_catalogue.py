import shutil
from dataclasses import replace

import pytest
from pxr import Sdf

from envgen_usd.assets.asset_catalogue import read_catalogue, scan_library
from envgen_usd.assets.asset_design import AssetDesign, Model, Part
from envgen_usd.assets.asset_layers import write_asset
from envgen_usd.assets.material_layers import MaterialLook, material_layer
from envgen_usd.assets.shapes.simple_solids import box
from envgen_usd.errors import EnvgenError
from envgen_usd.layers.embedded_library import asset_files


@pytest.fixture
def library(tmp_path):
    """A library with one material and one asset."""
    (tmp_path / "materials").mkdir()
    look = MaterialLook("copper", (0.6, 0.3, 0.2), size=2.5)
    material_layer(look, "../textures").Export(str(tmp_path / "materials" / "copper.usda"))
    write_asset(design("kiosk"), tmp_path)
    return tmp_path


def design(name, height=2.0):
    def model(h):
        return Model((Part("Body", box((0, 0, 0), (1, 1, h)), "copper", "body"),))

    models = {"low": model(height), "high": model(2 * height)}
    return AssetDesign(name, "kiosk", "building", models, "storeys")


def test_finds_what_lies_in_the_folders(library):
    found = read_catalogue(library)
    assert list(found.assets) == ["kiosk"]
    assert found.materials["copper"].size == 2.5
    asset = found.assets["kiosk"]
    assert (asset.kind, asset.label) == ("kiosk", "building")
    assert dict(asset.variants) == {"storeys": ("high", "low")}
    assert asset.defaults["storeys"] == "low"
    assert asset.size({})[2] == 2.0
    assert asset.size({"storeys": "high"})[2] == 4.0


def test_an_asset_is_added_by_adding_files(library):
    write_asset(design("stall", 3.0), library)
    assert {asset.name for asset in read_catalogue(library).of_kind("kiosk")} == {"kiosk", "stall"}


def test_a_variant_is_added_by_editing_the_interface(library):
    path = library / "assets/kiosk/kiosk/usd/kiosk.usda"
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    variants = layer.GetPrimAtPath("/kiosk").variantSets["storeys"]
    Sdf.VariantSpec(variants, "ruin")
    layer.Export(str(path))
    assert "ruin" in read_catalogue(library).assets["kiosk"].variants["storeys"]


def test_each_change_of_a_library_is_seen_by_the_same_process(library):
    before = read_catalogue(library)
    assert read_catalogue(library) == before
    before.materials.clear()
    assert set(read_catalogue(library).materials) == {"copper"}
    look = MaterialLook("copper", (0.6, 0.3, 0.2), size=3.25)
    material_layer(look, "../textures").Export(str(library / "materials" / "copper.usda"))
    assert read_catalogue(library).materials["copper"].size == 3.25
    (library / "materials" / "copper.usda").unlink()
    assert not read_catalogue(library).materials
    shutil.rmtree(library / "assets")
    with pytest.raises(EnvgenError, match="no asset library"):
        read_catalogue(library)


def test_a_file_that_an_asset_needs_from_now_on_is_copied_too(library):
    """The payload of the kiosk gets another layer below it."""
    catalogue = read_catalogue(library)
    interface = catalogue.assets["kiosk"].path
    files = asset_files(catalogue, [interface])
    payload = next(name for name in sorted(files) if "/payload/" in name)
    text = '#usda 1.0\ndef Xform "kiosk" {}\n'
    (library / payload).with_name("more.usda").write_text(text)
    layer = Sdf.Layer.FindOrOpen(str(library / payload))
    layer.subLayerPaths.append("./more.usda")
    layer.Save()
    added = asset_files(catalogue, [interface]) - files
    assert {name.rpartition("/")[2] for name in added} == {"more.usda"}


def test_says_which_materials_are_known(library):
    with pytest.raises(EnvgenError, match=r"roads: unknown material 'mud'; known: copper"):
        read_catalogue(library).material("mud", "roads")


def test_refers_to_copies_or_to_the_library_itself(library):
    assert read_catalogue(library).reference("materials/copper.usda").startswith("../../")
    direct = read_catalogue(library, embed=False).reference("materials/copper.usda")
    assert direct == (library / "materials/copper.usda").as_posix()


def test_rejects_a_folder_that_is_no_library(tmp_path):
    with pytest.raises(EnvgenError, match="no asset library"):
        read_catalogue(tmp_path)


def test_rejects_two_assets_of_one_name(library):
    shutil.copytree(library / "assets/kiosk", library / "assets/shop")
    with pytest.raises(EnvgenError, match="'kiosk' exists twice"):
        read_catalogue(library)


def test_rejects_a_broken_file(library):
    (library / "materials" / "rust.usda").write_text("no usd")
    with pytest.raises(EnvgenError, match=r"rust\.usda: cannot be read"):
        read_catalogue(library)


def test_rejects_an_asset_without_a_label(library):
    path = library / "assets/kiosk/kiosk/usd/kiosk.usda"
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    prim = layer.GetPrimAtPath("/kiosk")
    del prim.properties["semantics:labels:class"]
    layer.Export(str(path))
    with pytest.raises(EnvgenError, match="needs a label"):
        read_catalogue(library)


def test_a_range_of_widths_is_read(library):
    write_asset(replace(design("hatch"), widths=(0.5, 1.5)), library)
    hatch = read_catalogue(library).assets["hatch"]
    assert hatch.fits(1.0)
    assert not hatch.fits(2.0)
    assert read_catalogue(library).assets["kiosk"].fits(100.0)


def test_all_faults_of_all_files_are_listed(library):
    """A user mends them in one go; what is whole is read all the same."""
    write_asset(design("stall"), library)
    write_asset(design("hatch"), library)
    (library / "materials" / "rust.usda").write_text("no usd")
    stall, hatch = (library / f"assets/kiosk/{name}/usd/{name}.usda" for name in ("stall", "hatch"))
    layer = Sdf.Layer.OpenAsAnonymous(str(stall))
    del layer.GetPrimAtPath("/stall").properties["semantics:labels:class"]
    layer.Export(str(stall))
    layer = Sdf.Layer.OpenAsAnonymous(str(hatch))
    layer.GetPrimAtPath("/hatch").customData["fits_width"] = "wide"
    layer.Export(str(hatch))
    catalogue, faults = scan_library(library)
    assert set(catalogue.assets) == {"kiosk"}
    assert len(faults) == 3
    for path, said in (
        (stall, "needs a label of the taxonomy 'class'"),
        (hatch, "fits_width must be a range"),
        (library / "materials" / "rust.usda", "cannot be read"),
    ):
        assert any(fault.startswith(f"{path}: ") and said in fault for fault in faults)
    with pytest.raises(EnvgenError, match=r"and 2 more: envgen-usd library check"):
        read_catalogue(library)


def test_one_asset_can_have_several_faults(library):
    folder = library / "assets" / "kiosk" / "bare" / "usd"
    folder.mkdir(parents=True)
    (folder / "bare.usda").write_text('#usda 1.0\n(defaultPrim = "bare")\ndef Xform "bare" {}\n')
    faults = scan_library(library)[1]
    assert len(faults) == 3
    assert all(fault.startswith(f"{folder / 'bare.usda'}: ") for fault in faults)

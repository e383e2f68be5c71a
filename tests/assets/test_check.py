"""Faults that an author may make are found and named."""

import pytest
from pxr import Gf, Sdf

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.asset_design import AssetDesign, Model, Part
from envgen_usd.assets.asset_layers import write_asset
from envgen_usd.assets.library_check import check_library
from envgen_usd.assets.material_layers import MaterialLook, material_layer
from envgen_usd.assets.polygon_mesh import merge
from envgen_usd.assets.shapes.simple_solids import box

INTERFACE = "assets/kiosk/kiosk/usd/kiosk.usda"


@pytest.fixture
def library(tmp_path):
    (tmp_path / "materials").mkdir()
    layer = material_layer(MaterialLook("copper", (0.6, 0.3, 0.2)), "../textures")
    layer.Export(str(tmp_path / "materials" / "copper.usda"))
    model = Model((Part("Body", box((0, 0, 0), (1, 1, 2)), "copper", "body"),))
    looks = {"metal": {"old": {"Body": "copper"}, "new": {"Body": "copper"}}}
    write_asset(AssetDesign("kiosk", "kiosk", "building", {"": model}, "", looks), tmp_path)
    return tmp_path


def edit(path, change):
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    change(layer)
    layer.Export(str(path))


def kinds(library):
    return {issue.kind for issue in check_library(read_catalogue(library))}


def test_the_shipped_library_is_clean():
    assert check_library(read_catalogue()) == ()


def test_a_clean_library_has_no_issues(library):
    assert kinds(library) == set()


def test_label_out_of_the_vocabulary(library):
    def change(layer):
        layer.GetAttributeAtPath("/kiosk.semantics:labels:class").default = ["kiosk"]

    edit(library / INTERFACE, change)
    assert kinds(library) == {"library.label"}


def test_extent_that_is_too_small(library):
    def change(layer):
        layer.GetAttributeAtPath("/kiosk.extentsHint").default = [Gf.Vec3f(0), Gf.Vec3f(1)]

    edit(library / INTERFACE, change)
    assert kinds(library) == {"library.extent"}


def test_texture_that_is_missing(library):
    layer = material_layer(MaterialLook("copper", texture="copper"), "../textures")
    layer.Export(str(library / "materials" / "copper.usda"))
    assert "library.texture" in kinds(library)


def test_texture_whose_type_is_unknown(library):
    path = library / "materials" / "copper.usda"
    material_layer(MaterialLook("copper", texture="copper"), "../textures").Export(str(path))
    text = path.read_text()
    assert "asset inputs:file" in text
    path.write_text(text.replace("asset inputs:file", "asseT inputs:file"))
    said = [each.message for each in check_library(read_catalogue(library))]
    assert any("inputs:file is no asset path" in each for each in said)


def test_variant_without_a_material(library):
    def change(layer):
        variants = layer.GetPrimAtPath("/kiosk").variantSets["metal"]
        Sdf.VariantSpec(variants, "bare")

    edit(library / INTERFACE, change)
    issues = check_library(read_catalogue(library))
    assert {issue.kind for issue in issues} == {"library.material"}
    assert all("metal=bare" in issue.where for issue in issues)


def test_asset_that_floats(library):
    model = Model((Part("Body", box((0, 0, 1), (1, 1, 2)), "copper", "body"),))
    write_asset(AssetDesign("kiosk", "kiosk", "building", {"": model}), library)
    assert kinds(library) == {"library.ground"}


def test_points_that_repeat_others(library):
    touching = merge([box((0, 0, 0), (1, 1, 1)), box((0, 0, 1), (1, 1, 2))])
    model = Model((Part("Body", touching, "copper", "body"),))
    write_asset(AssetDesign("kiosk", "kiosk", "building", {"": model}), library)
    (issue,) = check_library(read_catalogue(library))
    assert (issue.kind, issue.message[:8]) == ("library.points", "4 points")


def test_too_many_combinations(library):
    def change(layer):
        root = layer.GetPrimAtPath("/kiosk")
        variants = root.variantSets["metal"]
        body = variants.variants["old"].primSpec.nameChildren["Geometry"]
        for number in range(200):
            variant = Sdf.VariantSpec(variants, f"v{number}")
            Sdf.CopySpec(layer, body.path, layer, variant.primSpec.path.AppendChild("Geometry"))

    edit(library / INTERFACE, change)
    assert "library.prototypes" in kinds(library)

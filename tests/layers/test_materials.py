"""One Materials scope for the whole stage: one opinion recolours a material everywhere."""

from pathlib import Path

import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade
from tests.kept_work import kept

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.chunks import Chunk
from envgen_usd.layers.flat_stage import flatten_stage
from envgen_usd.render.stage.stage_reader import read_scene

CHUNKS = (Chunk(0, 0), Chunk(1, 0))
ROOT = Sdf.Path("/World/Materials")


@pytest.fixture(scope="module")
def stage_file(scene, tmp_path_factory):
    two = type(scene)(scene.profile, scene.catalogue, CHUNKS)
    return kept(tmp_path_factory, "layers_materials", two.write)


@pytest.fixture
def stage(stage_file):
    return Usd.Stage.Open(str(stage_file))


def bindings(stage):
    """Path of the material of each drawn mesh or subset, instance proxies included."""
    found = {}
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdGeom.Mesh):
            subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
            for part in [subset.GetPrim() for subset in subsets] or [prim]:
                material = UsdShade.MaterialBindingAPI(part).ComputeBoundMaterial()[0]
                found[part.GetPath()] = material.GetPath()
    return found


def test_everything_is_bound_to_one_scope(stage):
    found = bindings(stage)
    assert len(found) > 300
    assert {path.GetParentPath() for path in found.values()} == {ROOT}
    scopes = {prim.GetParent().GetPath() for prim in stage.Traverse() if prim.IsA("Material")}
    assert scopes == {ROOT}
    chunks = {str(path).split("/")[2] for path, to in found.items() if to.name == "brick_red"}
    assert chunks == {chunk.prim_name for chunk in CHUNKS}


def test_assets_and_buildings_share_their_glass(stage):
    glass = {path for path, to in bindings(stage).items() if to == ROOT.AppendChild("glass")}
    assert any("Shell" in str(path) for path in glass)
    assert any("/Props/" in str(path) for path in glass)


def test_one_opinion_recolours_all_brick(stage):
    tint = Gf.Vec4f(0.5, 0.6, 0.7, 1.0)
    stage.OverridePrim(ROOT.AppendPath("brick_red/Colour")).CreateAttribute(
        "inputs:scale", Sdf.ValueTypeNames.Float4
    ).Set(tint)
    bricks = [
        look for look in read_scene(stage).materials
        if "diffuse" in look.textures and "brick_red" in look.textures["diffuse"].path
    ]  # fmt: skip
    assert [look.textures["diffuse"].scale for look in bricks] == [pytest.approx(tuple(tint))]


def test_one_opinion_gives_brick_another_material(stage):
    bricks = [path for path, to in bindings(stage).items() if to.name == "brick_red"]
    brick = stage.OverridePrim("/__surface__/brick_red")
    UsdShade.MaterialBindingAPI(brick).Bind(UsdShade.Material.Get(stage, ROOT.AppendPath("glass")))
    found = bindings(stage)
    assert {found[path].name for path in bricks} == {"glass"}


def test_a_stage_that_another_refers_to_keeps_its_materials(stage_file):
    """In two copies of a town, instances share prototypes, and so the materials of one copy."""
    stage = Usd.Stage.CreateInMemory()
    for name in ("a", "b"):
        stage.DefinePrim(f"/Region/{name}").GetReferences().AddReference(str(stage_file))
    found = bindings(stage)
    assert {str(path)[:9] for path in found} == {"/Region/a", "/Region/b"}
    for path, to in found.items():
        towns = {"/Region/a", "/Region/b"}
        if not stage.GetPrimAtPath(path).IsInstanceProxy():
            towns = {str(path)[:9]}
        assert str(to.GetParentPath().GetParentPath()) in towns


def test_a_flat_stage_has_the_same_scope(stage, stage_file, tmp_path):
    flatten_stage(stage_file, tmp_path / "flat.usdc", deinstance=True)
    flat = Usd.Stage.Open(str(tmp_path / "flat.usdc"))
    assert bindings(flat) == bindings(stage)


def test_without_the_materials_layer_assets_keep_their_own(stage_file):
    stage = Usd.Stage.Open(str(stage_file))
    stage.MuteLayer(str(stage_file.parent / "layers" / "materials.usda"))
    found = bindings(stage)
    trees = {str(path) for path in found if "/tree_3" in str(path)}
    assert trees
    for path in trees:
        assert "/tree_3_chunk" in str(found[Sdf.Path(path)])


def test_without_embedding_the_scope_refers_to_the_library(tmp_path, scene):
    library = read_catalogue(embed=False)
    made = type(scene)(scene.profile, library, CHUNKS[:1]).write(tmp_path, embed=False)
    stage = Usd.Stage.Open(str(made))
    assert not stage.GetCompositionErrors()
    brick = stage.GetPrimAtPath(ROOT.AppendPath("brick_red/Colour"))
    file = Path(brick.GetAttribute("inputs:file").Get().resolvedPath)
    assert file.is_relative_to(library.folder)
    assert {path.GetParentPath() for path in bindings(stage).values()} == {ROOT}


def test_the_example_of_the_page_recolours_and_rebinds(stage, stage_file):
    page = Path(__file__).parents[2] / "docs" / "stage.md"
    text = page.read_text().split("```usda\n")[2].split("```")[0]
    layer = Sdf.Layer.CreateAnonymous(".usda")
    assert layer.ImportFromString(text.replace("my_town/stage.usda", str(stage_file)))
    edited = Usd.Stage.Open(layer)
    tint = edited.GetAttributeAtPath(ROOT.AppendPath("brick_red/Colour.inputs:scale")).Get()
    assert tuple(tint) == pytest.approx((0.9, 0.7, 0.6, 1))
    paint = edited.GetAttributeAtPath(ROOT.AppendPath("paint_white/Surface.inputs:diffuseColor"))
    assert tuple(paint.Get()) == pytest.approx((0.9, 0.85, 0.7))
    lawns = {path for path, to in bindings(stage).items() if to.name == "lawn"}
    assert lawns
    assert {bindings(edited)[path].name for path in lawns} == {"grass"}

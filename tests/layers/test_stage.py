"""The composed stage: validators, layer stack, prims, determinism."""

import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
from pxr import Kind, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdValidation
from tests.kept_work import kept

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.usd_files import open_without_files
from envgen_usd.chunks import Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import labels
from envgen_usd.layers.props_layer import write_props

CHUNKS = (Chunk(0, 0), Chunk(-1, 2))


@pytest.fixture(scope="module")
def scene(scene):
    return type(scene)(scene.profile, scene.catalogue, CHUNKS)


@pytest.fixture(scope="module")
def stage_file(scene, tmp_path_factory):
    return kept(tmp_path_factory, "layers_of_two_chunks", scene.write)


@pytest.fixture(scope="module")
def stage(stage_file):
    return Usd.Stage.Open(str(stage_file))


def every_prim(stage):
    return stage.Traverse(Usd.TraverseInstanceProxies())


@pytest.fixture(scope="module")
def bare_file(scene, tmp_path_factory):
    """A stage whose props have no geometry."""
    bare = type(scene)(scene.profile, scene.catalogue, CHUNKS[:1])
    return kept(tmp_path_factory, "layers_bare", lambda out: write_bare(bare, out))


def write_bare(bare, out):
    bare.write(out)
    city, path = bare.city(CHUNKS[0]), out / "chunks" / CHUNKS[0].name / "props.usdc"
    write_props(city, CHUNKS[0], bare.profile, bare.catalogue, 0, path, metadata_only=True)
    return bare.compose(out)


@pytest.mark.parametrize("name", ["stage_file", "bare_file"])
def test_validators_of_openusd_find_nothing(name, request):
    stage = Usd.Stage.Open(str(request.getfixturevalue(name)))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [error.GetErrorAsString() for error in errors] == []


def nvidia_findings(path, *, variants):
    """Findings of all rules; with variants, those of each variant at each prim."""
    validation = pytest.importorskip("usd_validation_nvidia")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        issues = validation.ValidationEngine(variants=variants).validate(str(path)).issues()
    return [(str(issue.severity), issue.message) for issue in issues]


@pytest.mark.parametrize("name", ["stage_file", "bare_file"])
def test_validators_of_nvidia_find_nothing(name, request):
    """With the variants that the stage selects; `library_check` checks those of the assets."""
    assert nvidia_findings(request.getfixturevalue(name), variants=False) == []


def test_validators_of_nvidia_find_nothing_in_any_weather(stage_file, tmp_path):
    """Alone: each variant of a stage would be composed for all of its props."""
    shutil.copytree(stage_file.parent / "skies", tmp_path / "skies")
    (tmp_path / "layers").mkdir()
    shutil.copy(stage_file.parent / "layers" / "atmosphere.usda", tmp_path / "layers")
    weather = tmp_path / "weather.usda"
    weather.write_text(
        '#usda 1.0\n(\n defaultPrim = "World"\n metersPerUnit = 1\n'
        ' subLayers = [@./layers/atmosphere.usda@]\n upAxis = "Z"\n)\n'
        'def Xform "World" (kind = "assembly")\n{\n}\n'
    )
    stage = Usd.Stage.Open(str(weather))
    sets = stage.GetPrimAtPath("/World/Environment").GetVariantSets()
    assert len(sets.GetVariantSet("weather").GetVariantNames()) > 5
    assert nvidia_findings(weather, variants=True) == []


def test_layer_stack_ends_with_terrain_materials_and_chunks(stage):
    names = [Path(path).name for path in stage.GetRootLayer().subLayerPaths]
    layers = ("atmosphere", "props", "buildings", "roads", "landuse", "terrain", "materials")
    assert names == [*(f"{name}.usda" for name in layers), "chunks.usdc"]


def test_stage_is_in_metres_with_z_up_and_says_where_it_is(stage):
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
    data = stage.GetRootLayer().customLayerData
    assert data["geo_reference"] == "+proj=utm +zone=32 +datum=WGS84"
    assert tuple(data["offset"]) == (500000.0, 5400000.0, 100.0)
    assert (data["country"], data["area_type"]) == ("1", "residential")


def test_hierarchy_and_kinds(stage):
    kinds = {
        "/World": "assembly",
        "/World/chunk_m1_2": "group",
        "/World/chunk_0_0/Terrain": "component",
        "/World/chunk_0_0/Roads": "group",
        "/World/chunk_0_0/Buildings": "group",
        "/World/chunk_0_0/Buildings/house_1_chunk_0_0": "component",
        "/World/chunk_0_0/Props": "group",
        "/World/chunk_0_0/Props/tree_3_chunk_0_0": "component",
    }
    assert {path: Usd.ModelAPI(stage.GetPrimAtPath(path)).GetKind() for path in kinds} == kinds
    for prim in every_prim(stage):
        if Usd.ModelAPI(prim).GetKind() == Kind.Tokens.component:
            assert prim.GetParent().IsGroup(), prim.GetPath()


def test_chunks_stand_at_their_corners(stage):
    cache = UsdGeom.XformCache()
    place = cache.GetLocalToWorldTransform(stage.GetPrimAtPath("/World/chunk_m1_2"))
    assert tuple(place.ExtractTranslation()) == (-200.0, 400.0, 0.0)


def test_labels_are_of_the_closed_vocabulary(stage):
    table = {label.name: label.cityscapes for label in labels()}
    found = set()
    for prim in every_prim(stage):
        name = prim.GetAttribute("semantics:labels:class").Get()
        if name is not None:
            assert list(prim.GetAttribute("semantics:labels:cityscapes").Get()) == [table[name[0]]]
            found.add(name[0])
    assert found == {"road", "sidewalk", "building", "pole", "vegetation", "terrain"}


def test_everything_that_is_drawn_has_a_class_and_a_material(stage):
    for prim in every_prim(stage):
        if prim.IsA(UsdGeom.Mesh):
            owner = prim
            while owner and not owner.HasAttribute("semantics:labels:class"):
                owner = owner.GetParent()
            assert owner, prim.GetPath()
            subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
            for part in [subset.GetPrim() for subset in subsets] or [prim]:
                assert UsdShade.MaterialBindingAPI(part).ComputeBoundMaterial()[0], part.GetPath()


def test_unloaded_bounds_are_those_of_the_loaded_stage(stage_file, stage):
    def bounds(of, hint):
        cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default", "render"], hint)
        box = cache.ComputeWorldBound(of.GetDefaultPrim()).ComputeAlignedRange()
        return np.array([box.GetMin(), box.GetMax()])

    unloaded = Usd.Stage.Open(str(stage_file), Usd.Stage.LoadNone)
    np.testing.assert_allclose(bounds(unloaded, True), bounds(stage, False), atol=0.2)


def test_unloaded_stage_is_small(stage_file):
    unloaded = Usd.Stage.Open(str(stage_file), Usd.Stage.LoadNone)
    materials = Usd.PrimRange.AllPrims(unloaded.GetPrimAtPath("/World/Materials"))
    classes = Usd.PrimRange.AllPrims(unloaded.GetPrimAtPath("/__surface__"))
    count = len(list(unloaded.TraverseAll())) - len(list(materials)) - len(list(classes))
    files = [Path(layer.realPath) for layer in unloaded.GetUsedLayers()]
    assert {path.name for path in files if path.suffix == ".usdc"} == {"chunks.usdc"}
    # The classes of the season and of the chunks' contents are two of six prims of the whole stage.
    assert count == 6 + len(CHUNKS)


def children(stage, chunk):
    """Names of a chunk's children, also of those with unloaded payloads."""
    return {
        each.GetName() for each in stage.GetPrimAtPath(f"/World/{chunk.prim_name}").GetAllChildren()
    }


def test_a_chunk_is_loaded_alone_and_whole(stage_file, stage):
    unloaded = Usd.Stage.Open(str(stage_file), Usd.Stage.LoadNone)
    first, second = CHUNKS[:2]
    unloaded.Load(f"/World/{first.prim_name}")
    assert children(unloaded, first) == children(stage, first)
    assert not children(unloaded, second)
    terrain = unloaded.GetPrimAtPath(f"/World/{first.prim_name}/Terrain/Ground")
    assert UsdGeom.Mesh(terrain).GetPointsAttr().Get()


def test_a_part_of_a_chunk_is_loaded_alone(stage_file):
    unloaded = Usd.Stage.Open(str(stage_file), Usd.Stage.LoadNone)
    chunk = f"/World/{CHUNKS[0].prim_name}"
    unloaded.Load(f"{chunk}/Terrain")
    assert children(unloaded, CHUNKS[0]) > {"Roads", "Terrain"}
    assert unloaded.GetPrimAtPath(f"{chunk}/Terrain").GetChildren()
    assert not unloaded.GetPrimAtPath(f"{chunk}/Roads").GetAllChildren()


def test_a_stage_opened_without_files_has_the_children_of_its_chunks(stage_file, stage):
    bare = open_without_files(stage_file)
    files = {layer.realPath for layer in bare.GetUsedLayers()}
    assert not [path for path in files if "/chunks/" in path]
    for chunk in CHUNKS:
        assert children(bare, chunk) == children(stage, chunk)
        path = f"/World/{chunk.prim_name}/Terrain"
        hint, cache = (
            bare.GetPrimAtPath(path).GetAttribute("extentsHint").Get(),
            UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]),
        )
        box = cache.ComputeUntransformedBound(stage.GetPrimAtPath(path)).ComputeAlignedRange()
        np.testing.assert_allclose(hint, [box.GetMin(), box.GetMax()], atol=0.2)


def test_a_town_composes_at_another_path(stage_file, stage):
    other = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(other, UsdGeom.Tokens.z)
    other.DefinePrim("/Left").GetReferences().AddReference(str(stage_file))
    meshes = [prim for prim in every_prim(stage) if prim.IsA(UsdGeom.Mesh)]
    assert len(meshes) > 10
    for prim in meshes:
        there = other.GetPrimAtPath(str(prim.GetPath()).replace("/World", "/Left", 1))
        assert there.IsA(UsdGeom.Mesh), prim.GetPath()
        looks = [
            UsdShade.MaterialBindingAPI(p).ComputeBoundMaterial()[0].GetPath().name
            for p in (prim, there)
        ]
        assert looks[0] == looks[1]


def test_muting_a_layer_hides_it_everywhere(stage_file):
    stage = Usd.Stage.Open(str(stage_file))
    stage.MuteLayer(str(stage_file.parent / "layers" / "terrain.usda"))
    paths = [str(prim.GetPath()) for prim in stage.Traverse()]
    assert not any("Terrain" in path for path in paths)
    assert any("Buildings" in path for path in paths)
    stage.MuteLayer(str(stage_file.parent / "layers" / "landuse.usda"))
    stage.UnmuteLayer(str(stage_file.parent / "layers" / "terrain.usda"))
    ground = stage.GetPrimAtPath("/World/chunk_0_0/Terrain/Ground")
    assert ground.IsA(UsdGeom.Mesh)
    assert not ground.GetChildren()


def test_sun_shines_down_from_the_south_west(stage):
    suns = [prim for prim in stage.Traverse() if prim.IsA(UsdLux.DistantLight)]
    matrix = UsdGeom.XformCache().GetLocalToWorldTransform(suns[0])
    x, y, z = matrix.TransformDir((0, 0, -1))
    assert z < -0.5
    assert x > 0
    assert y > 0
    assert any(prim.IsA(UsdLux.DomeLight) for prim in stage.Traverse())


def test_two_builds_are_the_same_text(scene, stage_file, tmp_path):
    again = scene.write(tmp_path).parent
    first = stage_file.parent
    files = list(first.rglob("*.usd[ac]"))
    assert len(files) > 20
    for path in files:
        name = path.relative_to(first)
        texts = [Sdf.Layer.OpenAsAnonymous(str(f / name)).ExportToString() for f in (first, again)]
        assert texts[0].split("\n", 1)[1] == texts[1].split("\n", 1)[1], name


def test_a_chunk_is_the_same_alone(scene, stage_file, tmp_path):
    scene.write_chunk(CHUNKS[1], tmp_path)
    for path in tmp_path.glob("*.usdc"):
        other = stage_file.parent / "chunks" / CHUNKS[1].name / path.name
        assert path.read_bytes() == other.read_bytes()


def test_stage_can_be_moved_with_what_it_uses(stage_file, tmp_path):
    moved = tmp_path / "elsewhere"
    stage_file.parent.rename(moved)
    try:
        stage = Usd.Stage.Open(str(moved / "stage.usda"))
        used = [layer.realPath for layer in stage.GetUsedLayers() if layer.realPath]
        assert all(Path(path).is_relative_to(moved) for path in used)
        for prim in every_prim(stage):
            file = prim.GetAttribute("inputs:file").Get()
            if file is not None:
                assert Path(file.resolvedPath).is_relative_to(moved)
    finally:
        moved.rename(stage_file.parent)


def test_a_library_behind_a_link_is_copied_like_any_other(tmp_path, scene):
    link = tmp_path / "link"
    link.symlink_to(read_catalogue().folder, target_is_directory=True)
    copies = {}
    for name, catalogue in (("plain", read_catalogue()), ("linked", read_catalogue(link))):
        out = tmp_path / name
        type(scene)(scene.profile, catalogue, (Chunk(0, 0),)).write(out)
        parts = ("assets", "materials", "textures")
        copies[name] = {
            str(path.relative_to(out)): path.read_bytes()
            for part in parts
            for path in (out / part).rglob("*")
            if path.is_file()
        }
    assert len(copies["plain"]) > 10
    assert copies["plain"] == copies["linked"]


def test_without_embedding_the_library_itself_is_used(tmp_path, scene):
    library = read_catalogue(embed=False)
    made = type(scene)(scene.profile, library, (Chunk(0, 0),)).write(tmp_path, embed=False)
    assert not (tmp_path / "assets").exists()
    stage = Usd.Stage.Open(str(made))
    tree = stage.GetPrimAtPath("/World/chunk_0_0/Props/tree_3_chunk_0_0")
    assert tree.IsInstance()
    used = [layer.realPath for layer in stage.GetUsedLayers()]
    assert any(Path(path).is_relative_to(library.folder) for path in used)


def test_nothing_temporary_is_left(stage_file):
    assert not [path for path in stage_file.parent.rglob("*") if "tmp" in path.name]


def test_a_missing_chunk_is_named(scene, tmp_path):
    made = type(scene)(scene.profile, scene.catalogue, (Chunk(0, 0),))
    made.write(tmp_path)
    (tmp_path / "chunks/0_0/roads.usdc").unlink()
    with pytest.raises(EnvgenError, match=r"0_0/roads\.usdc: no such USD layer"):
        made.compose(tmp_path)


@pytest.mark.parametrize(("country", "area"), [("1", "industrial"), ("2", "residential")])
def test_every_environment_composes(scene, tmp_path, country, area):
    profile = read_profile(country, area)
    made = type(scene)(profile, scene.catalogue, (Chunk(0, 0),)).write(tmp_path)
    stage = Usd.Stage.Open(str(made))
    names = {
        prim.GetVariantSet("design").GetVariantSelection()
        for prim in stage.Traverse()
        if "light" in prim.GetName() and prim.IsInstance()
    }
    assert names == {"virginia" if country == "1" else "new_york"}

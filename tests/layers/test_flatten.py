import zipfile

import pytest
from pxr import Sdf, Usd, UsdGeom, UsdShade
from tests.kept_work import kept

from envgen_usd.errors import EnvgenError
from envgen_usd.layers.flat_stage import flatten_stage


def points(stage):
    """Number of points of all meshes that are drawn, instances included."""
    prims = stage.Traverse(Usd.TraverseInstanceProxies())
    return sum(len(UsdGeom.Mesh(p).GetPointsAttr().Get()) for p in prims if p.IsA(UsdGeom.Mesh))


@pytest.mark.parametrize("name", ["flat.usdc", "flat.usdz"])
def test_one_file_shows_the_same(stage_file, tmp_path, name):
    flatten_stage(stage_file, tmp_path / name)
    flat, stage = (Usd.Stage.Open(str(path)) for path in (tmp_path / name, stage_file))
    assert points(flat) == points(stage)
    assert [path.name for path in tmp_path.iterdir()] == [name]
    layers = [layer for layer in flat.GetUsedLayers() if not layer.anonymous]
    assert len(layers) == 1


def test_no_layer_of_the_stage_is_written_over(stage_file, tmp_path):
    """The root layer became the flat stage: its sublayers and payloads were lost."""
    edit = tmp_path / "edit.usda"
    layer = Sdf.Layer.CreateNew(str(edit))
    layer.subLayerPaths.append(str(stage_file))
    layer.Save()
    (tmp_path / "link.usda").symlink_to(edit)
    chunk = next(stage_file.parent.rglob("chunks/*/terrain.usdc"))
    before = {path: path.read_bytes() for path in (edit, stage_file, chunk)}
    for target in (*before, tmp_path / "link.usda"):
        with pytest.raises(EnvgenError, match="is what the command reads"):
            flatten_stage(edit, target)
    assert {path: path.read_bytes() for path in before} == before
    flatten_stage(edit, tmp_path / "flat.usdc")
    flatten_stage(edit, tmp_path / "flat.usdc")  # what is no layer of it may be replaced


def test_the_place_of_a_mistake_in_a_layer_is_named(tmp_path):
    (tmp_path / "edit.usda").write_text('#usda 1.0\n\nover "A" { float x = 1 }\n')
    with pytest.raises(EnvgenError, match=r"edit\.usda: .* line 3, column \d+: Expected") as error:
        flatten_stage(tmp_path / "edit.usda", tmp_path / "flat.usda")
    assert "\n" not in str(error.value)


def test_bytes_that_are_no_utf8_are_named_in_a_line(tmp_path):
    """OpenUSD quotes them in its message, which then cannot be decoded (fuzzing, seed 0)."""
    path = tmp_path / "edit.usda"
    path.write_bytes(b'#usda 1.0\ndef Xform "A"\n{\n    float inp\xff\xffs:radius = 0.2\n}\n')
    match = r"edit\.usda: cannot be read as a USD stage: line 4, column \d+: "
    with pytest.raises(EnvgenError, match=match) as error:
        flatten_stage(path, tmp_path / "flat.usdc")
    assert "\n" not in str(error.value)


@pytest.fixture(scope="module")
def without_instances(stage_file, tmp_path_factory):
    """The flat stage; the bytes of the stage itself before, and if it was left changed."""

    def make(folder):
        before = stage_file.read_bytes()
        flatten_stage(stage_file, folder / "flat.usdc", deinstance=True)
        return folder / "flat.usdc", before, Sdf.Layer.FindOrOpen(str(stage_file)).dirty

    return kept(tmp_path_factory, "flat_without_instances", make)


def test_without_instances(stage_file, without_instances):
    flat, stage = (Usd.Stage.Open(str(path)) for path in (without_instances[0], stage_file))
    assert not any(prim.IsInstance() for prim in flat.Traverse())
    assert not flat.GetPrototypes()
    assert points(flat) == points(stage)
    tree = flat.GetPrimAtPath("/World/chunk_0_0/Props/tree_3_chunk_0_0/Geometry/Leaves")
    assert UsdShade.MaterialBindingAPI(tree).ComputeBoundMaterial()[0]
    assert list(tree.GetParent().GetParent().GetAttribute("semantics:labels:class").Get()) == [
        "vegetation"
    ]


def test_textures_are_found_by_relative_paths(stage_file, tmp_path):
    target = tmp_path / "deep" / "flat.usda"
    flatten_stage(stage_file, target)
    stage = Usd.Stage.Open(str(target))
    files = [p.GetAttribute("inputs:file").Get() for p in stage.TraverseAll()]
    files = [file for file in files if file is not None]
    assert files
    assert all(file.resolvedPath and not file.path.startswith("/") for file in files)


def test_a_package_holds_its_textures_and_is_written_without_a_word(stage_file, tmp_path, capfd):
    target = tmp_path / "flat.usdz"
    flatten_stage(stage_file, target)
    assert capfd.readouterr() == ("", "")
    with zipfile.ZipFile(target) as package:
        names = package.namelist()
    assert names[0] == "flat.usdc"
    stage = Usd.Stage.Open(str(target))
    names_of_files = ("inputs:file", "inputs:texture:file")
    files = [p.GetAttribute(name).Get() for p in stage.TraverseAll() for name in names_of_files]
    found = {file.resolvedPath for file in files if file is not None}
    assert found == {f"{target}[{name}]" for name in names[1:]}


def test_textures_of_one_name_and_of_many_tiles_are_packed(tmp_path):
    layer = Sdf.Layer.CreateAnonymous(".usda")
    for folder, name in (("a", "t.png"), ("b", "t.png"), ("c", "u.1001.png"), ("c", "u.1002.png")):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / name).write_text(f"{folder} {name}")
    texts = ("a/t.png", "b/t.png", "c/u.<UDIM>.png")
    for number, text in enumerate(texts):
        prim = Sdf.CreatePrimInLayer(layer, f"/p{number}")
        prim.specifier = Sdf.SpecifierDef
        attribute = Sdf.AttributeSpec(prim, "inputs:file", Sdf.ValueTypeNames.Asset)
        attribute.default = Sdf.AssetPath(str(tmp_path / text))
    layer.Export(str(tmp_path / "stage.usda"))
    flatten_stage(tmp_path / "stage.usda", tmp_path / "flat.usdz")
    with zipfile.ZipFile(tmp_path / "flat.usdz") as package:
        contents = {package.read(name).decode() for name in package.namelist()[1:]}
    assert contents == {"a t.png", "b t.png", "c u.1001.png", "c u.1002.png"}


def test_a_texture_that_is_gone_is_named(tmp_path):
    text = '#usda 1.0\ndef Scope "p" {\n  asset inputs:file = @./gone.png@\n}'
    (tmp_path / "stage.usda").write_text(text)
    with pytest.raises(EnvgenError, match=r"gone\.png cannot be read"):
        flatten_stage(tmp_path / "stage.usda", tmp_path / "flat.usdz")
    assert [path.name for path in tmp_path.iterdir()] == ["stage.usda"]


def test_the_stage_itself_stays_as_it_is(stage_file, without_instances):
    _, before, is_dirty = without_instances
    assert stage_file.read_bytes() == before
    assert not is_dirty


@pytest.mark.parametrize(
    ("stage", "target", "message"),
    [
        ("none.usda", "flat.usdc", "no such stage"),
        ("broken.usda", "flat.usdc", "cannot be read"),
        ("broken.usda", "flat.obj", "ends in .usda, .usdc or .usdz"),
    ],
)
def test_says_what_is_wrong(tmp_path, stage, target, message):
    (tmp_path / "broken.usda").write_text("nonsense")
    with pytest.raises(EnvgenError, match=message):
        flatten_stage(tmp_path / stage, tmp_path / target)

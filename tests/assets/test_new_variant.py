"""A variant from an existing one: it differs in what was asked for, and in nothing else."""

import shutil
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Sdf, Usd, UsdGeom, UsdShade

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.asset_variant import VariantOptions, new_variant
from envgen_usd.assets.library_check import check_library
from envgen_usd.errors import EnvgenError

SHIPPED = Path(str(resources.files("envgen_usd.asset_library")))
BIN = "assets/bin/bin/usd/bin.usda"


@pytest.fixture
def library(tmp_path):
    """The shipped bin and barrel with their materials."""
    folder = tmp_path / "library"
    for kind in ("bin", "barrel"):
        shutil.copytree(SHIPPED / "assets" / kind, folder / "assets" / kind)
    (folder / "materials").mkdir()
    (folder / "textures").mkdir()
    for pattern in ("paint_*", "metal_*", "glass", "wood"):
        for path in SHIPPED.glob(f"materials/{pattern}.usda"):
            shutil.copy(path, folder / "materials")
    for path in SHIPPED.glob("textures/wood*"):
        shutil.copy(path, folder / "textures")
    return folder


def opened(library, path, **chosen):
    stage = Usd.Stage.Open(str(library / path))
    stage.SetEditTarget(stage.GetSessionLayer())
    for name, variant in chosen.items():
        stage.GetDefaultPrim().GetVariantSet(name).SetVariantSelection(variant)
    return stage


def looks(stage):
    """Material and upper corner of each part."""
    cache = UsdGeom.XformCache()
    found = {}
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
            matrix = np.array(cache.GetLocalToWorldTransform(prim))
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get()) @ matrix[:3, :3]
            found[prim.GetName()] = material.GetPrim().GetName(), points.max(axis=0)
    return found


def test_a_new_variant_has_its_material_and_the_old_ones_theirs(library):
    before = {name: looks(opened(library, BIN, design=name)) for name in ("round", "post")}
    options = VariantOptions(materials={"Body": "paint_yellow"})
    made = new_variant(library, "bin", "sunny", "round", options)
    assert made.variant_set == "design"
    after = looks(opened(library, BIN, design="sunny", colour="green"))
    assert after["Body"][0] == "paint_yellow"
    body = {"Body", "BodyProxy"}
    assert {n: look[0] for n, look in after.items() if n not in body} == {
        n: look[0] for n, look in before["round"].items() if n not in body
    }
    for name, look in before.items():
        again = looks(opened(library, BIN, design=name))
        assert {n: v[0] for n, v in again.items()} == {n: v[0] for n, v in look.items()}
    assert check_library(read_catalogue(library)) == ()


def test_the_new_geometry_is_a_file_of_its_own(library):
    made = new_variant(library, "bin", "mine", "round", VariantOptions())
    old = library / "assets/bin/bin/payload/round.usdc"
    content = old.read_bytes()
    layer = Sdf.Layer.OpenAsAnonymous(str(library / made.payload))
    body = layer.GetPrimAtPath("/bin/Geometry/Body").attributes["points"]
    body.default = [(x * 0.9, y, z) for x, y, z in body.default]
    layer.Export(str(library / made.payload))
    assert old.read_bytes() == content
    shapes = [looks(opened(library, BIN, design=name))["Body"][1] for name in ("round", "mine")]
    assert shapes[1][0] == pytest.approx(0.9 * shapes[0][0])


def pose_of(stage):
    """Points and material of each mesh and subset."""
    found = {}
    for prim in stage.GetDefaultPrim().GetChild("Geometry").GetAllChildren():
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        points = prim.GetAttribute("points").Get()
        found[prim.GetName()] = str(points), material.GetPath() if material else ""
    return found


def test_a_variant_of_a_pose_gets_that_pose_alone(library):
    """The poses of a person share a file; a copy of all would be eleven times as large."""
    name = "pedestrian_child"
    for part in ("assets/pedestrian/pedestrian_child", "materials"):
        shutil.copytree(SHIPPED / part, library / part, dirs_exist_ok=True)
    shutil.copytree(SHIPPED / "textures", library / "textures", dirs_exist_ok=True)
    made = new_variant(library, name, "waving", "walk_3", VariantOptions())
    interface = f"assets/pedestrian/{name}/usd/{name}.usda"
    own, old = (opened(library, interface, pose=pose) for pose in ("waving", "walk_3"))
    assert pose_of(own) == pose_of(old) != {}
    shared = library / f"assets/pedestrian/{name}/payload/{name}.usdc"
    assert (library / made.payload).stat().st_size < shared.stat().st_size / 5
    assert check_library(read_catalogue(library)) == ()


def test_a_size_scales_the_geometry(library):
    round_ = looks(opened(library, BIN, design="round"))["Body"][1]
    before = read_catalogue(library).assets["bin"].size({"design": "round"})
    new_variant(library, "bin", "tall", "round", VariantOptions(size=(0.47, 0.458, 1.98)))
    asset = read_catalogue(library).assets["bin"]
    assert tuple(asset.size({"design": "tall"})) == (0.47, 0.458, 1.98)
    body = looks(opened(library, BIN, design="tall"))["Body"][1]
    np.testing.assert_allclose(body / round_, [0.47, 0.458, 1.98] / before, rtol=1e-3)
    # A variant of the scaled one is scaled from there.
    new_variant(library, "bin", "low", "tall", VariantOptions(size=(0.47, 0.458, 0.99)))
    low = looks(opened(library, BIN, design="low"))["Body"][1]
    np.testing.assert_allclose(low[2], round_[2] * 0.99 / before[2], rtol=1e-3)
    assert check_library(read_catalogue(library)) == ()


def test_a_colour_gets_another_paint(library):
    options = VariantOptions(materials={"Body": "paint_brown"})
    assert new_variant(library, "bin", "brown", "red", options).payload == ""
    for design in ("round", "pillar"):
        found = looks(opened(library, BIN, design=design, colour="brown"))
        assert found["Body"][0] == "paint_brown"


def test_the_stage_binds_the_new_surface(library):
    """A stage binds classes of surfaces; the class of the old paint must not stay."""
    new_variant(library, "bin", "brown", "red", VariantOptions(materials={"Body": "paint_brown"}))
    stage = Usd.Stage.CreateInMemory()
    for name in ("paint_red", "paint_brown"):
        UsdShade.Material.Define(stage, f"/World/{name}")
        surface = stage.CreateClassPrim(f"/__surface__/{name}")
        binding = UsdShade.MaterialBindingAPI.Apply(surface)
        binding.Bind(UsdShade.Material.Get(stage, f"/World/{name}"))
    prim = stage.DefinePrim("/World/bin")
    prim.GetReferences().AddReference(str(library / BIN))
    prim.GetVariantSet("colour").SetVariantSelection("brown")
    mesh = stage.GetPrimAtPath("/World/bin/Geometry/Body")
    bound, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
    assert str(bound.GetPath()) == "/World/paint_brown"


def test_an_asset_without_sets_gets_its_first(library):
    old = looks(opened(library, "assets/barrel/barrel/usd/barrel.usda"))
    part = next(iter(old))
    options = VariantOptions(variant_set="age", materials={part: "wood"})
    new_variant(library, "barrel", "old", "new", options)
    asset = read_catalogue(library).assets["barrel"]
    assert asset.variants == {"age": ("new", "old")}
    assert asset.defaults == {"age": "new"}
    path = "assets/barrel/barrel/usd/barrel.usda"
    assert {n: v[0] for n, v in looks(opened(library, path)).items()} == {
        n: v[0] for n, v in old.items()
    }
    assert looks(opened(library, path, age="old"))[part][0] == "wood"
    assert check_library(read_catalogue(library)) == ()


def test_the_distance_has_the_new_material_too(library, tmp_path):
    scene = trimesh.Scene()
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.4)
    scene.add_geometry(ball, node_name="Body", geom_name="Body")
    (tmp_path / "ball.glb").write_bytes(scene.export(file_type="glb"))
    options = VariantOptions(geometry=tmp_path / "ball.glb", materials={"Body": "wood"})
    new_variant(library, "bin", "ball", "round", options)
    found = looks(opened(library, BIN, design="ball", colour="red"))
    assert {name: look[0] for name, look in found.items()} == {"Body": "wood", "Body_far": "wood"}


def test_a_file_replaces_the_geometry(library, tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box((0.5, 0.9, 0.4)), node_name="Body", geom_name="Body")
    (tmp_path / "box.glb").write_bytes(scene.export(file_type="glb"))
    options = VariantOptions(geometry=tmp_path / "box.glb")
    new_variant(library, "bin", "box", "round", options)
    asset = read_catalogue(library).assets["bin"]
    np.testing.assert_allclose(asset.size({"design": "box"}), [0.4, 0.5, 0.9], atol=1e-3)
    assert set(looks(opened(library, BIN, design="box"))) == {"Body"}
    assert check_library(read_catalogue(library)) == ()


@pytest.mark.parametrize(
    ("asset", "names", "options", "said"),
    [
        ("tub", ("a", "b"), VariantOptions(), "unknown asset 'tub'"),
        ("bin", ("post", "round"), VariantOptions(), "'post' exists"),
        ("bin", ("a", "square"), VariantOptions(), "no variant 'square'"),
        ("bin", ("a b", "round"), VariantOptions(), "variant 'a b'"),
        ("bin", ("a", "round"), VariantOptions(materials={"Body": "gold"}), "material 'gold'"),
        ("bin", ("a", "round"), VariantOptions(materials={"Top": "wood"}), "no part 'Top'"),
        ("bin", ("a", "red"), VariantOptions(size=(1.0, 1.0, 1.0)), "use --set design"),
        ("bin", ("a", "round"), VariantOptions(size=(1.0, 0.0, 1.0)), "three numbers above 0"),
        ("barrel", ("a", "b"), VariantOptions(), "--set design"),
    ],
)
def test_what_cannot_be_made_is_named_and_changes_nothing(asset, names, options, said, library):
    before = {path: path.read_bytes() for path in library.rglob("*") if path.is_file()}
    with pytest.raises(EnvgenError, match=said):
        new_variant(library, asset, *names, options)
    assert {path: path.read_bytes() for path in library.rglob("*") if path.is_file()} == before

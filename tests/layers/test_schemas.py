"""The codeless schemas: what the stage authors is what they declare, with and without them."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyproj
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdPhysics
from tests.kept_work import kept

import envgen_usd
from envgen_usd.chunks import Chunk

ROOT = Path(__file__).resolve().parents[2]
SCHEMAS = ROOT / "schemas"
USER = "userProperties:"
SCHEMA_OF = {
    "EnvgenAnchorAPI": "/World",
    "EnvgenChunkAPI": "/World/chunk_m1_2",
    "EnvgenBuildingAPI": "/World/chunk_m1_2/Buildings/house_1_chunk_m1_2",
    "EnvgenPropAPI": "/World/chunk_m1_2/Props/tree_3_chunk_m1_2",
}


@pytest.fixture(scope="module")
def stage_file(scene, tmp_path_factory):
    shown = type(scene)(scene.profile, scene.catalogue, (Chunk(-1, 2),))
    return kept(tmp_path_factory, "layers_of_schemas", shown.write)


@pytest.fixture(scope="module")
def stage(stage_file):
    return Usd.Stage.Open(str(stage_file))


def declared(schema):
    """Names, types and documentation of a schema's attributes."""
    found = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(schema)
    assert found, f"{schema} is not registered by the import of {envgen_usd.__name__}"
    return {
        name: (
            found.GetAttributeDefinition(name).GetTypeName(),
            found.GetPropertyDocumentation(name),
        )
        for name in found.GetPropertyNames()
    }


def test_every_schema_is_documented_and_keeps_to_the_namespace():
    source = Sdf.Layer.FindOrOpen(str(SCHEMAS / "schema.usda"))
    names = [prim.name for prim in source.rootPrims if prim.specifier == Sdf.SpecifierClass]
    assert set(SCHEMA_OF) < set(names)
    for name in names:
        for attribute, (_, text) in declared(name).items():
            assert attribute.startswith(USER)
            assert len(text) > 10, attribute
    assert "metres" in declared("EnvgenBuildingAPI")[f"{USER}height"][1]


def test_the_generated_files_are_those_of_the_source(tmp_path):
    pytest.importorskip("jinja2")
    tool = ROOT / "tools" / "make_schemas.py"
    subprocess.run([sys.executable, tool, tmp_path], check=True)
    for name in ("generatedSchema.usda", "plugInfo.json"):
        assert (tmp_path / name).read_text() == (SCHEMAS / name).read_text()


def test_what_a_prim_authors_is_what_its_schemas_declare(stage):
    seen = set()
    for prim in stage.Traverse():
        schemas = [name for name in prim.GetAppliedSchemas() if name.startswith("Envgen")]
        types = {key: kind for name in schemas for key, (kind, _) in declared(name).items()}
        authored = {a.GetName(): a.GetTypeName() for a in prim.GetAuthoredAttributes()}
        mine = {name: kind for name, kind in authored.items() if name.startswith(USER)}
        assert all(types.get(name) == kind for name, kind in mine.items()), prim.GetPath()
        seen |= set(schemas)
    assert seen >= {*SCHEMA_OF, "EnvgenRoadAPI", "EnvgenLaneAPI"}


def test_figures_are_those_of_the_geometry(stage):
    chunk = stage.GetPrimAtPath("/World/chunk_m1_2")
    assert tuple(chunk.GetAttribute(f"{USER}index").Get()) == (-1, 2)
    assert chunk.GetAttribute(f"{USER}side").Get() == 200.0
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default", "render"])
    house = stage.GetPrimAtPath(SCHEMA_OF["EnvgenBuildingAPI"])
    box = cache.ComputeWorldBound(house.GetChild("Shell")).ComputeAlignedRange()
    assert house.GetAttribute(f"{USER}height").Get() == pytest.approx(box.GetSize()[2], abs=2e-3)
    # The frame of the fixture: UTM 32, moved by (500000, 5400000): on the central meridian 9 E.
    latitude, longitude = (
        stage.GetPrimAtPath("/World").GetAttribute(f"{USER}latitude_longitude").Get()
    )
    assert longitude == pytest.approx(9.0, abs=1e-9)
    _, north = pyproj.Proj(proj="utm", zone=32)(9.0, latitude)
    assert north == pytest.approx(5_400_000.0, abs=0.01)


def test_the_stage_says_the_same_without_the_schemas(stage_file):
    """A program that knows no schema of ours."""
    code = (
        "import sys; from pxr import Usd\n"
        "stage = Usd.Stage.Open(sys.argv[1])\n"
        "known = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition('EnvgenPropAPI')\n"
        "prim = stage.GetPrimAtPath(sys.argv[2])\n"
        "print(known, prim.GetAttribute('userProperties:asset').Get())"
    )
    command = [sys.executable, "-W", "error", "-c", code, stage_file, SCHEMA_OF["EnvgenPropAPI"]]
    done = subprocess.run(command, env={}, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert done.stdout.startswith("None tree_")


def test_ground_roads_and_buildings_are_colliders(stage):
    colliding = {
        prim.GetName()
        for prim in stage.Traverse()
        if prim.HasAPI(UsdPhysics.CollisionAPI) and prim.IsA(UsdGeom.Mesh)
    }
    assert {"Ground", "Shell"} <= colliding
    for prim in stage.GetPrimAtPath("/World/chunk_m1_2/Roads").GetChildren():
        if prim.IsA(UsdGeom.Mesh):
            assert UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get() == "none"
            assert prim.GetName() in colliding
    assert np.all([name != "Lanes" for name in colliding])

"""glTF files against OpenUSD's own answers, trimesh, and Khronos' validator."""

import json
import os
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom
from tests.exchange.gltf_files import Gltf, areas, sums_of_gltf, sums_of_stage

from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.environment_export import export_gltf

ROOT = Path(__file__).resolve().parents[2]
VALIDATOR = Path(os.environ.get("ENVGEN_GLTF_VALIDATOR", ROOT / ".gltf-validator"))
"""Folder in which npm has installed `gltf-validator` (make gltf)."""


def chunk_files(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.glb"))


def rows_of(extras: dict) -> list[dict]:
    """Facts of each object of a node."""
    if "each" not in extras:
        return [extras] if "path" in extras else []
    columns = extras["each"].items()
    return [
        extras["common"] | {name: values[i] for name, values in columns}
        for i in range(extras["count"])
    ]


def test_each_class_has_the_triangles_and_the_area_of_the_stage(environment, exported):
    ours = sums_of_gltf(chunk_files(exported))
    stage = sums_of_stage(environment / "stage.usda")
    assert {"road", "building", "vegetation", "terrain"} <= stage.area.keys()
    assert dict(ours.triangles) == dict(stage.triangles)
    assert ours.area == pytest.approx(stage.area, rel=1e-4)
    assert ours.low == pytest.approx(stage.low, abs=1e-3)
    assert ours.high == pytest.approx(stage.high, abs=1e-3)


def with_one_chunk(environment, path, place=(0.0, 0.0, 0.0)):
    """A stage of the environment with the chunk at the origin alone, moved to a place."""
    stage = Usd.Stage.CreateNew(str(path))
    stage.GetRootLayer().subLayerPaths.append(str(environment / "stage.usda"))
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    world = stage.GetPrimAtPath("/World")
    stage.SetDefaultPrim(world)
    UsdGeom.XformCommonAPI(world).SetTranslate(place)
    for prim in world.GetChildren():
        if prim.GetName().startswith("chunk_") and prim.GetName() != "chunk_0_0":
            prim.SetActive(False)
    stage.GetRootLayer().Save()
    return path


def test_another_reader_sees_the_same_without_the_extension(environment, tmp_path, exported):
    export_gltf(with_one_chunk(environment, tmp_path / "one.usda"), tmp_path, instancing=False)
    name = "chunk_0_0.glb"
    scene = trimesh.load_scene(tmp_path / name)
    area = 0.0
    for node in scene.graph.nodes_geometry:
        matrix, key = scene.graph[node]
        area += areas(trimesh.transform_points(scene.geometry[key].triangles.reshape(-1, 3), matrix)
                      .reshape(-1, 3, 3)).sum()  # fmt: skip
    ours = sums_of_gltf([exported / name])
    assert area == pytest.approx(sum(ours.area.values()), rel=1e-4)
    origin = Gltf.of(exported / name).content["asset"]["extras"]["origin"]
    low, high = ours.low - origin, ours.high - origin
    assert scene.bounds[0] == pytest.approx([low[0], low[2], -high[1]], abs=1e-3)
    assert scene.bounds[1] == pytest.approx([high[0], high[2], -low[1]], abs=1e-3)
    extensions = Gltf.of(tmp_path / name).content["extensionsUsed"]
    assert "EXT_mesh_gpu_instancing" not in extensions


def test_instances_stand_where_their_prims_do(environment, exported):
    stage = Usd.Stage.Open(str(environment / "stage.usda"))
    xforms = UsdGeom.XformCache()
    file = Gltf.of(exported / "chunk_0_0.glb")
    checked = 0
    for node, places in file.nodes():
        if "EXT_mesh_gpu_instancing" not in node.get("extensions", {}):
            continue
        paths = [row["path"] for row in rows_of(node["extras"])]
        for path, place in zip(paths, places, strict=True):
            matrix = np.array(xforms.GetLocalToWorldTransform(stage.GetPrimAtPath(path)))
            x, y, z = matrix[3, :3]  # The chunk's origin is that of the world.
            assert place[:3, 3] == pytest.approx((x, z, -y), abs=1e-4)
            assert place[:3, :3] @ (0, 1, 0) == pytest.approx(
                matrix[2, [0, 2, 1]] * (1, 1, -1), abs=1e-5
            )
            checked += 1
    assert checked > 50


def test_metadata_says_what_the_stage_says(environment, exported):
    stage = Usd.Stage.Open(str(environment / "stage.usda"))
    names = Counter()
    for path in chunk_files(exported):
        for node, _ in Gltf.of(path).nodes():
            extras = node.get("extras", {})
            for row in rows_of(extras):
                prim = stage.GetPrimAtPath(row["path"])
                given = prim.GetAttribute("userProperties:gml_id").Get()
                assert row["id"] == (given if isinstance(given, str) else prim.GetName())
                assert row["class"] == prim.GetAttribute("semantics:labels:class").Get()[0]
                assert row["kind"]
                names[row["kind"]] += 1
    expected = Counter(
        prim.GetAttribute("userProperties:category").Get()
        for prim in stage.Traverse()
        if prim.IsInstance() or (prim.GetName().startswith("building_") and not prim.IsA("Mesh"))
    )
    for kind in ("tree", "window", "door", "street_light", "building"):
        assert names[kind] == expected[kind] > 0


def test_metadata_alone_names_every_object_with_its_pose(environment, exported, tmp_path):
    export_gltf(environment, tmp_path, metadata_kind="only")
    assert not list(tmp_path.glob("*.glb"))
    content = json.loads((tmp_path / "chunk_0_0.json").read_text())
    trees = {each["id"]: each for each in content["objects"] if each["kind"] == "tree"}
    file = Gltf.of(exported / "chunk_0_0.glb")
    seen = 0
    for node, places in file.nodes():
        extras = node.get("extras", {})
        if "each" in extras:
            for row, place in zip(rows_of(extras), places, strict=True):
                name = row["id"]
                if row["kind"] != "tree":
                    continue
                assert trees[name]["translation"] == pytest.approx(place[:3, 3].tolist(), abs=1e-4)
                assert trees[name]["variants"]["shape"]
                seen += 1
    assert seen == len(trees) > 0


def test_far_from_the_origin_nothing_is_lost(environment, exported, tmp_path):
    """UTM coordinates: float32 would leave half a metre."""
    place = (691607.25, 5335893.5, 520.0)
    root = with_one_chunk(environment, tmp_path / "far.usda", place)
    export_gltf(root, tmp_path / "gltf")
    near, far = (Gltf.of(f / "chunk_0_0.glb") for f in (exported, tmp_path / "gltf"))
    assert far.content["asset"]["extras"]["origin"] == list(place)
    assert len(near.buffer) == len(far.buffer)
    difference = [
        np.abs(near.array(i).astype(float) - far.array(i)).max()
        for i, accessor in enumerate(near.content["accessors"])
        if accessor["type"] == "VEC3"
    ]
    assert max(difference) < 1e-3


def test_textures_lie_beside_the_files_and_materials_keep_their_names(environment, exported):
    stage = Usd.Stage.Open(str(environment / "stage.usda"))
    known = {prim.GetName() for prim in stage.GetPrimAtPath("/World/Materials").GetChildren()}
    for path in chunk_files(exported):
        content = Gltf.of(path).content
        names = [each["name"] for each in content["materials"]]
        assert {name.removesuffix("_double_sided") for name in names} <= known
        assert len(set(names)) == len(names)
        for image in content["images"]:
            original = environment / "textures" / image["name"]
            assert (exported / image["uri"]).read_bytes() == original.read_bytes()
        roughs = [each for each in content["materials"] if each["name"] == "asphalt"]
        for each in roughs:
            texture = each["pbrMetallicRoughness"]["metallicRoughnessTexture"]["index"]
            image = content["images"][content["textures"][texture]["source"]]
            assert image["name"] == "asphalt_roughness.jpg"


def test_an_unchanged_chunk_keeps_its_file_and_a_changed_one_does_not(
    environment, exported, tmp_path
):
    town = tmp_path / "town"
    shutil.copytree(environment, town)
    shutil.copytree(exported, town / "gltf")
    files = chunk_files(town / "gltf")
    stamps = {path: path.stat().st_mtime_ns for path in files}
    bytes_before = files[0].read_bytes()
    files[0].write_bytes(bytes_before[:1000])  # As if killed while writing in place.
    second = export_gltf(town, town / "gltf")
    assert second.kept == len(files) - 1
    assert files[0].read_bytes() == bytes_before
    assert {p: p.stat().st_mtime_ns for p in files[1:]} == dict(list(stamps.items())[1:])
    (town / "edits.usda").write_text(
        '#usda 1.0\n(\n defaultPrim = "World"\n metersPerUnit = 1\n'
        ' subLayers = [@stage.usda@]\n upAxis = "Z"\n)\n'
        'over "World"\n{\n over "chunk_0_0"\n {\n'
        '  over "Buildings" (active = false)\n  {\n  }\n'
        '  over "Props" (active = false)\n  {\n  }\n }\n}\n'
    )
    edited = export_gltf(town / "edits.usda", town / "gltf")
    assert edited.kept == 0
    assert sums_of_gltf([town / "gltf" / "chunk_0_0.glb"]).triangles["building"] == 0


def test_a_folder_without_a_stage_is_an_error(tmp_path):
    with pytest.raises(EnvgenError, match="holds no stage"):
        export_gltf(tmp_path, tmp_path / "gltf")


def test_the_khronos_validator_has_no_error(exported):
    if shutil.which("node") is None:
        pytest.skip("node is not installed")
    if not (VALIDATOR / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("gltf-validator is not installed (make gltf, or $ENVGEN_GLTF_VALIDATOR)")
    command = ["node", str(ROOT / "tools" / "validate_gltf.js"), str(VALIDATOR)]
    result = subprocess.run(
        [*command, *map(str, chunk_files(exported))], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    lines = result.stdout.splitlines()
    assert len(lines) == len(chunk_files(exported))
    assert all(" 0 errors" in line for line in lines)

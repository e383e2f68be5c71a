"""What the exports do with actors that move, against OpenUSD's own answers."""

import shutil
import subprocess

import pytest
import trimesh
from pxr import Usd, UsdGeom
from tests.exchange.conftest import ACTORS
from tests.exchange.gltf_files import Gltf, sums_of_gltf, sums_of_stage
from tests.exchange.test_gltf import ROOT, VALIDATOR, rows_of

from envgen_usd.exchange.carla.carla_export import export_carla
from envgen_usd.exchange.stage_package import package_environment


def test_a_static_file_shows_the_start(busy, files):
    """Same triangles and areas of each class as the stage at its default time."""
    paths = sorted(files.glob("*.glb"))
    assert {path.stem for path in paths if "chunk" not in path.stem} == {"Traffic"}
    ours, stage = sums_of_gltf(paths), sums_of_stage(busy / "stage.usda")
    assert {"car", "person", "rider", "bicycle"} <= stage.area.keys()
    assert dict(ours.triangles) == dict(stage.triangles)
    assert ours.area == pytest.approx(stage.area, rel=1e-4)


def test_a_static_file_names_the_actors_that_are_there(files):
    file = Gltf.of(files / "Traffic.glb")
    rows = [row for node, _ in file.nodes() for row in rows_of(node.get("extras", {}))]
    known = {row["id"]: (row["kind"], row["class"]) for row in rows}
    assert known == {
        "ahead": ("car", "car"),
        "walker": ("pedestrian", "person"),
        "rider": ("bicycle", "bicycle"),
    }
    layers = {node["extras"]["layer"] for node, _ in file.nodes() if "layer" in node["extras"]}
    assert layers == {"Traffic"}


def test_a_map_for_carla_has_the_parked_actors_alone(busy, environment, tmp_path):
    road = environment.parent / "street.xodr"
    names, areas = [], []
    for number, stage in enumerate((environment, busy)):
        result = export_carla(stage, tmp_path / str(number), road=road, detail="simple")
        found = [issue for issue in result.issues if issue.kind == "export.moving"]
        assert [issue.message for issue in found] == (
            ["4 prims move, and what moves is no part of a map"] if stage == busy else []
        )
        scene = trimesh.load_scene(tmp_path / str(number) / "street.glb")
        names.append({node.partition("_")[0] for node in scene.graph.nodes_geometry})
        areas.append(scene.area)
    assert names[0] == names[1] >= {"Pedestrian", "Car"}
    assert areas[0] == pytest.approx(areas[1], rel=1e-6)


def test_a_package_moves(busy, tmp_path):
    packed = package_environment(busy, tmp_path / "town", road=None)
    stage = Usd.Stage.Open(str(packed.stage))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, 20.0)
    assert stage.GetTimeCodesPerSecond() == 10.0
    before = Usd.Stage.Open(str(busy / "stage.usda"))
    for name in ACTORS:
        both = [each.GetPrimAtPath(f"/World/Traffic/{name}") for each in (stage, before)]
        for code in (0.0, 7.5, 20.0):
            ours, theirs = (
                UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(code) for prim in both
            )
            assert ours == theirs
            seen = [UsdGeom.Imageable(prim).ComputeVisibility(code) for prim in both]
            assert seen[0] == seen[1]


def test_the_khronos_validator_has_no_error(files):
    if shutil.which("node") is None or not (VALIDATOR / "node_modules").is_dir():
        pytest.skip("node or gltf-validator is not installed (make gltf)")
    command = ["node", str(ROOT / "tools" / "validate_gltf.js"), str(VALIDATOR)]
    command += [str(path) for path in sorted(files.glob("*.glb"))]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout

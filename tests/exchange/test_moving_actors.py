"""What the exports do with actors that move, against OpenUSD's own answers."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom
from tests.exchange.gltf_files import Gltf, sums_of_gltf, sums_of_stage
from tests.exchange.test_gltf import ROOT, VALIDATOR, rows_of

from envgen_usd.exchange.carla.carla_export import export_carla
from envgen_usd.exchange.environment_export import export_gltf
from envgen_usd.exchange.stage_package import package_environment
from envgen_usd.recipe.traffic_build import add_traffic
from envgen_usd.traffic.traces.esmini_csv import read_csv_trace

ACTORS = {
    "ahead": ("car", "4.4,1.8,1.5", 0.0, (10.0, -1.8, 8.0)),
    "late": ("car", "4.4,1.8,1.5", 1.0, (30.0, 1.8, -5.0)),
    "walker": ("pedestrian", "0.5,0.5,1.75", 0.0, (20.0, 4.5, 1.4)),
    "rider": ("bicycle", "1.8,0.6,1.7", 0.0, (40.0, -1.8, 3.0)),
}
"""Kind, size, first second, and x, y and speed along x of each actor of two seconds."""


@pytest.fixture(scope="module")
def busy(environment, tmp_path_factory) -> Path:
    """The street with actors that move, one of which comes later."""
    folder = tmp_path_factory.mktemp("busy") / "town"
    shutil.copytree(environment, folder)
    rows = [
        f"{t:.1f},{name},{kind},{size},{x + speed * t:.3f},{y},{0.0 if speed > 0 else np.pi}"
        for name, (kind, size, begin, (x, y, speed)) in ACTORS.items()
        for t in np.arange(begin, 2.01, 0.1).tolist()
    ]
    trace = folder.parent / "trace.csv"
    trace.write_text("\n".join(["time,id,kind,length,width,height,x,y,h", *rows]) + "\n")
    add_traffic(folder, lambda: read_csv_trace(trace))
    return folder


@pytest.fixture(scope="module")
def files(busy, tmp_path_factory) -> Path:
    target = tmp_path_factory.mktemp("busy_gltf") / "gltf"
    export_gltf(busy, target)
    return target


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
        result = export_carla(stage, tmp_path / str(number), road=road)
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

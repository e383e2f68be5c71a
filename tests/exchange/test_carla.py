"""The package for CARLA against OpenUSD's own answers, trimesh, and Khronos' validator."""

import json
import shutil
import subprocess
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom
from tests.exchange.gltf_files import Gltf, areas, label_of, sums_of_stage
from tests.exchange.test_gltf import ROOT, VALIDATOR
from tests.kept_work import kept

from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.carla.carla_export import export_carla
from envgen_usd.exchange.carla.carla_names import map_name, mesh_name
from envgen_usd.exchange.carla.carla_tiles import tiles_of
from envgen_usd.exchange.environment_export import ExportResult
from envgen_usd.exchange.stage_chunks import ChunkPlace

ROAD_NAMES = {
    ("road", "driving"): "Road_Road",
    ("road", "lane_marking"): "Road_Marking",
    ("road", "kerb"): "Road_Curb",
    ("sidewalk", "kerb"): "Road_Curb",
    ("sidewalk", "sidewalk"): "Road_Sidewalk",
}
"""Class and part of the stage's roads to the begin of a name in CARLA's `SSTags.h`."""


@pytest.fixture(scope="module")
def package(environment: Path, tmp_path_factory: pytest.TempPathFactory) -> ExportResult:
    """The street as a map of a single tile."""
    road = environment.parent / "street.xodr"

    def make(folder: Path) -> ExportResult:
        return export_carla(environment, folder / "carla_town", road=road)

    return kept(tmp_path_factory, "carla_package", make)


@pytest.fixture(scope="module")
def tiles(environment: Path, tmp_path_factory: pytest.TempPathFactory) -> ExportResult:
    """The street in tiles of a chunk, with simple meshes."""
    return kept(tmp_path_factory, "carla_tiles", lambda folder: in_tiles(environment, folder))


def in_tiles(environment: Path, folder: Path) -> ExportResult:
    road, target = environment.parent / "street.xodr", folder / "carla_town"
    return export_carla(environment, target, road=road, tile_size=200.0, detail="simple")


def area_by_start(path: Path) -> dict[str, float]:
    """Area of the meshes of a file by the begin of their names, square metres."""
    scene = trimesh.load_scene(path)
    sums: dict[str, float] = defaultdict(float)
    for node in scene.graph.nodes_geometry:
        matrix, key = scene.graph[node]
        assert np.allclose(matrix, np.eye(4)), "CARLA places each mesh at the origin"
        corners = np.asarray(scene.geometry[key].triangles)
        words = node.split("_")
        start = "_".join(words[:2]) if words[0] == "Road" else words[0]
        start = "gully" if "gully" in words else start
        sums[start] += areas(corners).sum()
    return sums


def area_of_roads(stage: Usd.Stage) -> dict[tuple[str, str], float]:
    """Area of the road meshes by class and part."""
    sums: dict[tuple[str, str], float] = defaultdict(float)
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh) and "/Roads/" in str(prim.GetPath()):
            part = prim.GetAttribute("semantics:labels:part").Get()[0]
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), float)
            faces = np.array(UsdGeom.Mesh(prim).GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
            sums[label_of(prim), part] += areas(points[faces]).sum()
    return sums


def area_of_ends(stage: Usd.Stage, kind: str) -> float:
    """Area of the ground behind the ends of roads; its faces are plane, and some are concave."""
    area = 0.0
    for prim in stage.Traverse():
        if prim.GetName() != kind:
            continue
        mesh = UsdGeom.Mesh(prim.GetParent())
        points = np.array(mesh.GetPointsAttr().Get(), float)
        corners = np.array(mesh.GetFaceVertexIndicesAttr().Get())
        faces = np.split(corners, np.cumsum(mesh.GetFaceVertexCountsAttr().Get())[:-1])
        for face in UsdGeom.Subset(prim).GetIndicesAttr().Get():
            edges = points[faces[face]] - points[faces[face][0]]
            area += np.linalg.norm(np.cross(edges[:-1], edges[1:]).sum(axis=0)) / 2.0
    return area


def test_roads_have_carlas_names_and_the_stage_s_areas(environment, package):
    stage = Usd.Stage.Open(str(environment / "stage.usda"))
    roads, whole = area_of_roads(stage), sums_of_stage(environment / "stage.usda").area
    expected: dict[str, float] = defaultdict(float)
    for kind, area in roads.items():
        expected[ROAD_NAMES[kind]] += area
    assert {"Road_Road", "Road_Marking", "Road_Sidewalk"} <= expected.keys()
    # Ground behind both ends of the street is road, too: a carriageway of 7 m up to the far side of
    # a street across, 40 to 47 m away, which is as long as the road and two plots are wide.
    across = 11.0 + 2.0 * np.array([28.4, 42.7])
    least, most = 2.0 * 7.0 * (47.0 + across - 7.0)
    ends = area_of_ends(stage, "road_end")
    assert 0.97 * least < ends < 1.03 * most
    expected["Road_Road"] += ends
    expected["Road_Sidewalk"] += area_of_ends(stage, "square")
    ours = area_by_start(package.folder / "street.glb")
    assert {name: ours[name] for name in expected} == pytest.approx(expected, rel=1e-4)
    assert ours["Terrain"] == pytest.approx(whole["terrain"] + whole["parking"], rel=1e-4)


def test_nothing_is_lost_and_everything_stands_in_the_frame_of_the_road(environment, package):
    stage = sums_of_stage(environment / "stage.usda")
    scene = trimesh.load_scene(package.folder / "street.glb")
    assert sum(len(g.faces) for g in scene.geometry.values()) == sum(stage.triangles.values())
    (low, high), (x, y, z) = scene.bounds, range(3)
    assert (low[x], -high[z], low[y]) == pytest.approx(stage.low, abs=1e-3)
    assert (high[x], -low[z], high[y]) == pytest.approx(stage.high, abs=1e-3)


def test_names_survive_blender_and_only_signals_are_left_out_by_carla(package):
    content = Gltf.of(package.folder / "street.glb").content
    names = [node["name"] for node in content["nodes"]]
    assert len(set(names)) == len(names)
    assert max(map(len, names)) <= 63
    for node in content["nodes"]:
        left_out = any(word in node["name"].lower() for word in ("light", "sign"))
        assert left_out == node["name"].startswith(("TrafficSign", "TrafficLight"))
    assert not [m for m in content["materials"] if "sign" in m["name"] or "light" in m["name"]]
    assert any(name.startswith("Pole_street_lamp") for name in names)
    assert mesh_name("Building", "x" * 90) != mesh_name("Building", "x" * 89 + "y")


def test_the_package_file_names_files_that_are_there(environment, package):
    folder = package.folder
    assert [path.name for path in folder.rglob("*.json")] == ["carla_town.json"]
    content = json.loads((folder / "carla_town.json").read_text())
    (entry,) = content["maps"]
    assert (entry["name"], entry["source"]) == ("street", "./street.fbx")
    assert content["props"] == []
    assert (folder / entry["source"]).with_suffix(".glb").is_file()
    road = (environment.parent / "street.xodr").read_bytes()
    assert (folder / entry["xodr"]).read_bytes() == road
    assert "to_fbx.py" in (folder / "README.md").read_text()


def test_tiles_are_a_full_grid_that_counts_to_the_north(package, tiles):
    (entry,) = json.loads((tiles.folder / "carla_town.json").read_text())["maps"]
    assert entry["tile_size"] == 200
    names = [Path(name).stem for name in entry["tiles"]]
    places = [tuple(map(int, name.removeprefix("street_Tile_").split("_"))) for name in names]
    columns, rows = np.max(places, axis=0) + 1
    assert sorted(places) == [(x, y) for x in range(columns) for y in range(rows)]
    boxes = {p: trimesh.load_scene(tiles.folder / f"{n}.glb").bounds
             for p, n in zip(places, names, strict=True)}  # fmt: skip
    for (x, y), box in boxes.items():
        if (x, y + 1) in boxes:  # North is -z in glTF.
            assert boxes[x, y + 1][:, 2].mean() < box[:, 2].mean() - 100.0
        if (x + 1, y) in boxes:
            assert boxes[x + 1, y][:, 0].mean() > box[:, 0].mean() + 100.0
    total: dict[str, float] = defaultdict(float)
    for name in names:
        for start, area in area_by_start(tiles.folder / f"{name}.glb").items():
            total[start] += area
    whole = area_by_start(package.folder / "street.glb")
    for start in ("Road_Road", "Road_Marking", "Road_Sidewalk", "Road_Curb"):
        assert total[start] == pytest.approx(whole[start], rel=1e-4)
    assert total["Vegetation"] < whole["Vegetation"], "simple meshes"


def test_a_gap_of_the_map_becomes_a_tile_without_chunks():
    origins = np.array([(0.0, 0.0, 0.0), (200.0, 0.0, 0.0), (200.0, 400.0, 0.0)])
    places = [ChunkPlace(f"chunk_{k}", None, (), frozenset()) for k in range(3)]
    found = {tile.name: [place.name for place in tile.places]
             for tile in tiles_of("m", places, origins, 200.0)}  # fmt: skip
    assert found == {
        "m_Tile_0_0": ["chunk_0"], "m_Tile_1_0": ["chunk_1"], "m_Tile_0_1": [],
        "m_Tile_1_1": [], "m_Tile_0_2": [], "m_Tile_1_2": ["chunk_2"],
    }  # fmt: skip
    assert [tile.name for tile in tiles_of("m", places, origins, 600.0)] == ["m"]


def test_an_unchanged_tile_keeps_its_file(environment, tiles, tmp_path):
    shutil.copytree(tiles.folder, tmp_path / "carla_town")
    again = in_tiles(environment, tmp_path)
    filled = [issue for issue in again.issues if issue.kind == "carla.gap"]
    assert again.kept + len(filled) == len(again.files)


def test_bad_input_is_an_error_with_a_remedy(environment, tmp_path):
    road = environment.parent / "street.xodr"
    with pytest.raises(EnvgenError, match="copy the road"):
        map_name("sign_street")
    assert map_name("my town-1") == "my_town_1"
    with pytest.raises(EnvgenError, match="multiple of 200"):
        export_carla(environment, tmp_path, road=road, tile_size=300.0)
    with pytest.raises(EnvgenError, match="--detail"):
        export_carla(environment, tmp_path, road=road, detail="none")
    other = tmp_path / "other.xodr"
    other.write_bytes(road.read_bytes() + b"\n")
    with pytest.raises(EnvgenError, match="is not the road"):
        export_carla(environment, tmp_path, road=other)


def test_the_khronos_validator_has_no_error(tiles):
    if shutil.which("node") is None or not (VALIDATOR / "node_modules").is_dir():
        pytest.skip("node or gltf-validator is not installed (make gltf)")
    command = ["node", str(ROOT / "tools" / "validate_gltf.js"), str(VALIDATOR)]
    files = tiles.files
    result = subprocess.run(
        [*command, *map(str, files)], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.count(" 0 errors") == len(files)

"""Exports of stages that artists changed, or that other programs wrote, also faulty ones."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom
from tests.exchange.gltf_files import Gltf, areas, sums_of_gltf, sums_of_stage
from tests.exchange.test_gltf import rows_of, with_one_chunk
from tests.render.artist_stages import AT, CASES, STEP, edited

from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.carla.carla_export import export_carla
from envgen_usd.exchange.environment_export import export_gltf
from envgen_usd.exchange.stage_package import package_environment
from envgen_usd.layers.flat_stage import flatten_stage
from envgen_usd.recipe.build_options import demo_road

SEED = Path(__file__).resolve().parents[2] / "tools" / "fuzz_seeds" / "stage.usda"
WALL = 'def Mesh "Wall" (\n'
OBJECT = f'{WALL}        kind = "component"\n'
ORDER = 'uniform token[] xformOpOrder = ["xformOp:translate"]'
HEIGHT = 'string userProperties:gml_id = "wall"\n        double userProperties:height = '
ASSET = 'string userProperties:asset = "wall"\n        '
LAYER = "    customLayerData = "
EXPECTED = {"stage.unlabelled", "stage.unsupported"}
"""Issues of the seed: parts without a label, and curves that are no lane."""


def stage_with(path: Path, *changes: tuple[str, str]) -> Path:
    """The small stage of the fuzzer, whose wall is an object, with changes."""
    text = SEED.read_text()
    for good, bad in ((WALL, OBJECT), *changes):
        assert good in text
        text = text.replace(good, bad, 1)
    path.write_text(text)
    return path


def test_an_artists_object_outside_of_the_chunks_is_exported(environment, tmp_path):
    path = with_one_chunk(environment, tmp_path / "mine.usda")
    stage = Usd.Stage.Open(str(path))
    tent = UsdGeom.Mesh.Define(stage, "/World/Mine/Tent")
    tent.CreatePointsAttr([(2, 9, 0), (5, 9, 0), (3.5, 9, 4)])
    tent.CreateFaceVertexCountsAttr([3])
    tent.CreateFaceVertexIndicesAttr([0, 1, 2])
    Usd.ModelAPI(tent).SetKind("component")
    stage.GetRootLayer().Save()
    export_gltf(path, tmp_path / "gltf")
    ours = sums_of_gltf(sorted((tmp_path / "gltf").glob("*.glb")))
    theirs = sums_of_stage(path)
    assert ours.area[""] == pytest.approx(6.0)
    assert dict(ours.triangles) == dict(theirs.triangles)
    assert ours.area == pytest.approx(theirs.area, rel=1e-4)
    export_gltf(path, tmp_path / "only", metadata_kind="only")
    (record,) = json.loads((tmp_path / "only" / "outside.json").read_text())["objects"]
    assert (record["id"], record["layer"]) == ("Tent", "Mine")


def test_a_stage_without_payloads_is_exported(environment, tmp_path):
    flat = tmp_path / "flat.usdc"
    flatten_stage(with_one_chunk(environment, tmp_path / "one.usda"), flat)
    export_gltf(flat, tmp_path / "gltf")
    ours, theirs = sums_of_gltf([tmp_path / "gltf" / "outside.glb"]), sums_of_stage(flat)
    assert dict(ours.triangles) == dict(theirs.triangles)
    assert ours.area == pytest.approx(theirs.area, rel=1e-4)
    extras = [node["extras"] for node, _ in Gltf.of(tmp_path / "gltf" / "outside.glb").nodes()
              if "mesh" in node and "extras" in node]  # fmt: skip
    layers = {row["path"].split("/")[3] for each in extras for row in rows_of(each)}
    named = {node["name"] for node, _ in Gltf.of(tmp_path / "gltf" / "outside.glb").nodes()
             if "layer" in node.get("extras", {})}  # fmt: skip
    assert named == layers >= {"Roads", "Buildings", "Props", "Terrain"}


@pytest.mark.parametrize(
    ("good", "bad", "kinds"),
    [
        ("token[] semantics:labels:class", "tokem[] semantics:labels:class", set()),
        (ORDER, f"{HEIGHT}nan\n        {ORDER}", {"export.value"}),
        (ORDER, f"{HEIGHT}3\n        foo extentsHint = 3\n        {ORDER}", set()),
        (ORDER, f"{ASSET}foo extentsHint = 3\n        {ORDER}", {"export.value"}),
        (ORDER, f'{ASSET}string extentsHint = "x"\n        {ORDER}', {"export.value"}),
        ("(0, 1, 0)", "(0, nan, 0)", {"stage.transform"}),
        ("    metersPerUnit", f"{LAYER}{{ double a = nan }}\n    metersPerUnit", {"export.value"}),
        ("    metersPerUnit", f"{LAYER}{{ asset a = @b@ }}\n    metersPerUnit", set()),
    ],
)  # fmt: skip
def test_values_that_no_file_can_hold_are_left_out(good, bad, kinds, tmp_path):
    path = stage_with(tmp_path / "stage.usda", (good, bad))
    for kind in ("embedded", "only"):
        result = export_gltf(path, tmp_path / kind, metadata_kind=kind)
        assert {issue.kind for issue in result.issues} - EXPECTED == kinds
        for file in (tmp_path / kind).glob("*.json"):
            json.loads(file.read_text(), parse_constant=pytest.fail)


@pytest.mark.parametrize(
    ("good", "bad", "reason"),
    [
        ("double3 xformOp:translate = (0, 1, 0)", 'string xformOp:translate = "x"',
         "transformation of /World/Wall: Invalid combination"),
        (ORDER, ORDER.replace("xformOp:translate", ""), "transformation of /World/Wall"),
        ("(0, 1, 0)", "(0, 1e300, 0)", "beyond the numbers of glTF"),
    ],
)  # fmt: skip
def test_what_cannot_be_placed_is_refused(good, bad, reason, tmp_path):
    path = stage_with(tmp_path / "stage.usda", (good, bad))
    road = demo_road("straight")
    for export in (
        lambda: export_gltf(path, tmp_path / "gltf"),
        lambda: export_carla(path, tmp_path / "carla", road=road),
    ):
        with pytest.raises(EnvgenError, match=reason) as caught:
            export()
        assert "\n" not in str(caught.value)
    if "numbers" not in reason:
        with pytest.raises(EnvgenError, match=reason):
            package_environment(path, tmp_path / "package")


def test_a_stage_on_which_nothing_is_drawn_is_refused(tmp_path):
    path = tmp_path / "bare.usda"
    path.write_text('#usda 1.0\n(\n defaultPrim = "World"\n)\ndef Xform "World"\n{\n}\n')
    road = demo_road("straight")
    for export in (
        lambda: export_gltf(path, tmp_path / "gltf"),
        lambda: export_carla(path, tmp_path / "carla", road=road),
        lambda: package_environment(path, tmp_path / "package"),
    ):
        with pytest.raises(EnvgenError, match="no drawable prims"):
            export()


@pytest.mark.parametrize("scale", [(2, 1, 3), (-1, 1, 1), (0.5, -4, -1)])
def test_normals_stay_upright_on_scaled_and_mirrored_faces(scale, tmp_path):
    """Rotated by 30 degrees below the scale, the wall is sheared."""
    turn = "float xformOp:rotateZ = 30\n        float3 xformOp:scale = "
    order = ORDER.replace(
        '"xformOp:translate"', '"xformOp:translate", "xformOp:scale", "xformOp:rotateZ"'
    )
    path = stage_with(tmp_path / "stage.usda", (ORDER, f"{turn}{scale}\n        {order}"))
    export_gltf(path, tmp_path / "gltf")
    file = Gltf.of(tmp_path / "gltf" / "outside.glb")
    (mesh,) = [each for each in file.content["meshes"] if each["name"] == "Wall"]
    (primitive,) = mesh["primitives"]
    points = file.array(primitive["attributes"]["POSITION"]).astype(float)
    corners = points[file.array(primitive["indices"]).reshape(-1, 3)]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    across /= np.linalg.norm(across, axis=1)[:, None]
    normals = file.array(primitive["attributes"]["NORMAL"])
    assert normals == pytest.approx(np.tile(across[:1], (len(normals), 1)), abs=1e-5)


def test_what_a_scale_of_zero_hides_ends_no_export(tmp_path):
    sizes = "float3[] scales = [(1, 1, 1), (1, 1, 2), (0.5, 0.5, 0.5)]"
    flat = "float3[] scales = [(0, 0, 0), (1, 1, 0), (0.5, 0.5, 0.5)]"
    path = stage_with(tmp_path / "stage.usda", (sizes, flat))
    result = export_carla(path, tmp_path / "carla", road=demo_road("straight"))
    scene = trimesh.load_scene(result.folder / "straight.glb")
    areas_of = {
        name: areas(np.asarray(mesh.triangles)).sum() for name, mesh in scene.geometry.items()
    }
    tree = 0.5 * 2.0 * 0.5**2
    assert sum(areas_of.values()) == pytest.approx(24.0 + 12.0 + tree, rel=0.5)


def test_a_gap_of_the_map_for_carla_is_filled_below_everything(environment, tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "gap.usda"))
    stage.GetRootLayer().subLayerPaths.append(str(environment / "stage.usda"))
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    world = stage.GetPrimAtPath("/World")
    chunks = [prim for prim in world.GetChildren() if prim.GetName().startswith("chunk_")]
    chunks[-1].SetActive(False)
    stage.GetRootLayer().Save()
    road = environment.parent / "street.xodr"
    result = export_carla(tmp_path / "gap.usda", tmp_path / "map", road=road, tile_size=200.0)
    (gap,) = [issue for issue in result.issues if issue.kind == "carla.gap"]
    boxes = {path.stem: trimesh.load_scene(path).bounds for path in result.files}
    plate = boxes.pop(gap.where)
    assert np.ptp(plate, axis=0) == pytest.approx((200.0, 0.0, 200.0))
    assert plate[0, 1] == pytest.approx(min(box[0, 1] for box in boxes.values()), abs=1e-3)


@pytest.mark.parametrize("case", CASES)
def test_an_asset_of_an_artist_is_exported_where_it_is(case, tmp_path):
    """Each thing of the town is a box of 2 x 20 x 6 m, and the asset one of 1 x 1 x 2 m."""
    path, copies = edited(tmp_path, case)
    result = export_gltf(path, tmp_path / "gltf")
    assert all(file.parent == tmp_path / "gltf" for file in result.files)
    assert sorted(file.name for file in result.files) == sorted(
        file.name for file in (tmp_path / "gltf").glob("*.glb")
    )
    found = sums_of_gltf(list(result.files))
    assert dict(found.triangles) == {
        "building": 24, "vegetation": 24, "static": 12 * len(copies)
    }  # fmt: skip
    assert found.area["static"] == pytest.approx(10.0 * len(copies), rel=1e-5)
    assert found.high[2] == pytest.approx(AT[2] + 2.0, abs=1e-4)
    assert found.high[0] == pytest.approx(max(8.0, 0.5 + STEP * (len(copies) - 1)), abs=1e-4)
    again = export_gltf(path, tmp_path / "gltf")
    assert again.kept == len(result.files)


@pytest.mark.parametrize("case", ["in_a_layer_of_a_chunk", "in_the_world", "in_groups_of_one_name"])
def test_metadata_name_each_asset_of_an_artist_once(case, tmp_path):
    path, copies = edited(tmp_path, case)
    result = export_gltf(path, tmp_path / "only", metadata_kind="only")
    records = [
        record for file in result.files for record in json.loads(file.read_text())["objects"]
    ]
    paths = [record["path"] for record in records]
    assert sorted(paths) == sorted(set(paths))
    assert set(copies) <= set(paths)
    assert len(paths) == 4 + len(copies)


def test_a_group_far_from_the_origin_is_as_exact_as_the_chunks(environment, tmp_path):
    """The map lies in UTM coordinates, and so do the group's assets, but not the group."""
    east, north = 691_000.0, 5_335_000.0
    edited(tmp_path, "in_the_world")
    path = with_one_chunk(environment, tmp_path / "far.usda", (east, north, 0.0))
    stage = Usd.Stage.Open(str(path))
    prim = UsdGeom.Xform.Define(stage, "/Mine/Group/asset")
    prim.AddTranslateOp().Set((east + 7.125, north + 3.25, 0.5))
    prim.GetPrim().GetReferences().AddReference("./asset.usda", "/World")
    stage.GetRootLayer().Save()
    export_gltf(path, tmp_path / "gltf")
    found = sums_of_gltf([tmp_path / "gltf" / "Group.glb"])
    assert found.low == pytest.approx((east + 6.625, north + 2.75, 0.5), abs=1e-4)
    assert found.high == pytest.approx((east + 7.625, north + 3.75, 2.5), abs=1e-4)
    road = environment.parent / "street.xodr"
    result = export_carla(path, tmp_path / "map", road=road)
    assert len(result.files) == 1


def test_what_resets_its_transformation_stands_where_it_says(tmp_path):
    path, _ = edited(tmp_path, "in_a_layer_of_a_chunk")
    stage = Usd.Stage.Open(str(path))
    prim = UsdGeom.Xformable(stage.GetPrimAtPath("/World/chunk_0/props/mine"))
    prim.SetResetXformStack(True)
    chunk = UsdGeom.Xform.Define(stage, "/World/chunk_0")
    chunk.AddTranslateOp().Set((1000.0, 0.0, 0.0))
    stage.GetRootLayer().Save()
    export_gltf(path, tmp_path / "gltf")
    found = sums_of_gltf([tmp_path / "gltf" / "chunk_0.glb"])
    assert (found.low[0], found.high[0]) == pytest.approx((-0.5, 1008.0), abs=1e-3)


SCATTERED = [case for case in CASES if "prototype" in case]


@pytest.mark.parametrize("case", [*SCATTERED, "inside_of_instances"])
def test_metadata_have_each_copy_where_it_stands(case, tmp_path):
    """Paths are those of instances in images; glTF's x is east, y is up, z is south."""
    path, copies = edited(tmp_path, case)
    result = export_gltf(path, tmp_path / "only", metadata_kind="only")
    found = {}
    for file in result.files:
        content = json.loads(file.read_text())
        for record in content["objects"]:
            found[record["path"]] = np.add(record["translation"], content["offset"]), record
    assert set(copies) == {name for name in found if "chunk" not in name}
    for number, copy in enumerate(copies):
        place, record = found[copy]
        wanted = (AT[0] + STEP * number, AT[2], -AT[1])
        assert place == pytest.approx(wanted, abs=1e-5)
        assert record["class"] == "static"


@pytest.mark.parametrize("case", SCATTERED)
def test_batches_of_copies_name_each_of_them(case, tmp_path):
    path, copies = edited(tmp_path, case)
    result = export_gltf(path, tmp_path / "gltf")
    rows = [
        row
        for file in result.files
        for node, _ in Gltf.of(file).nodes()
        if "EXT_mesh_gpu_instancing" in node.get("extensions", {})
        for row in rows_of(node["extras"])
    ]
    assert sorted(row["path"] for row in rows) == sorted(copies)

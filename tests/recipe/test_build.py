"""A whole build of a small road, looked at from outside."""

import hashlib
import html
import json
import re
import shutil
from collections import Counter
from dataclasses import replace
from os import getpid
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdUtils
from tests.kept_work import kept

from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.folder_lock import locked
from envgen_usd.light.weather import read_weathers
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.build_summary import MOST_CHUNKS, bounded, total_counts
from envgen_usd.recipe.environment_build import BuildResult, build
from envgen_usd.recipe.map_land import lay_out_land
from envgen_usd.recipe.unchanged_chunks import ChunkRecord
from envgen_usd.render.cameras.sensor_rig import shipped_rigs
from envgen_usd.step_clock import Clock

ROAD = """<?xml version="1.0"?>
<OpenDRIVE><header revMajor="1" revMinor="7" name="small"/>
<road name="a" length="70" id="7" junction="-1"><type s="0" type="town"/>
<planView><geometry s="0" x="165" y="195" hdg="0.15" length="70"><arc curvature="0.002"/></geometry>
</planView>
<elevationProfile><elevation s="0" a="1" b="0.02" c="0" d="0"/></elevationProfile>
<lanes><laneSection s="0">
<left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/>
<roadMark sOffset="0" type="solid" color="standard" width="0.12"/></lane></left>
<center><lane id="0" type="none"><roadMark sOffset="0" type="broken" color="standard" width="0.12"/>
</lane></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="-2" type="sidewalk"><width sOffset="0" a="2" b="0" c="0" d="0"/>
<height sOffset="0" inner="0.12" outer="0.12"/></lane></right>
</laneSection></lanes></road></OpenDRIVE>
"""


def write_road(folder: Path, text: str = ROAD) -> Path:
    path = folder / "small.xodr"
    path.write_text(text, encoding="utf-8")
    return path


def options(road: Path, out: Path, **others: object) -> BuildOptions:
    return BuildOptions(road, "1", "residential", out, **others)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def road(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return kept(tmp_path_factory, "small_road", write_road)


@pytest.fixture(scope="module")
def first(road: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, BuildResult]:
    """Folder of an environment and its result, built in one process."""

    def make(folder: Path) -> tuple[Path, BuildResult]:
        return folder / "out", build(options(road, folder / "out", workers=1))

    return kept(tmp_path_factory, "small_build", make)


@pytest.fixture(scope="module")
def built(first: tuple[Path, BuildResult]) -> Path:
    """Folder of an environment, built in one process."""
    return first[0]


@pytest.fixture(scope="module")
def reseeded(
    road: Path, built: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, BuildResult]:
    """An environment and its result, built with another seed over one of the first seed."""

    def make(folder: Path) -> tuple[Path, BuildResult]:
        out = Path(shutil.copytree(built, folder / "out"))
        return out, build(options(road, out, seed=1, workers=1))

    return kept(tmp_path_factory, "small_build_reseeded", make)


def texts(out: Path) -> dict[str, str]:
    """Every layer of an environment as usda text; of copies of the library, the hash."""
    found = {}
    for path in sorted(p for p in out.rglob("*.usd?") if p.suffix in {".usda", ".usdc"}):
        name = path.relative_to(out)
        if name.parts[0] in {"assets", "materials"}:
            found[str(name)] = hashlib.sha256(path.read_bytes()).hexdigest()
        else:
            found[str(name)] = Sdf.Layer.FindOrOpen(str(path)).ExportToString()
    return found


def test_the_output_has_the_documented_layout(built: Path) -> None:
    names = {"stage.usda", "manifest.json", "report.html", "layers", "chunks"}
    assert names <= {path.name for path in built.iterdir()}
    layers = {"terrain", "landuse", "roads", "buildings", "props", "actors"}
    other_layers = {"atmosphere", "cameras", "chunks", "materials"}
    assert {path.stem for path in (built / "layers").iterdir()} == layers | other_layers
    assert {path.stem for path in (built / "skies").iterdir()} == set(read_weathers())
    for chunk in (built / "chunks").iterdir():
        files = {path.name for path in chunk.iterdir()}
        assert {f"{name}.usdc" for name in layers} <= files
        assert {"heightmap.tif", "landuse.tif", "landuse.geojson", "city.gml"} <= files
    assert not list(built.rglob(".*"))


def test_people_stand_on_the_stage_and_are_counted(built: Path) -> None:
    stage = Usd.Stage.Open(str(built / "stage.usda"))
    groups = [each.GetChild("Actors") for each in stage.GetPrimAtPath("/World").GetChildren()]
    actors = [actor for group in groups if group for actor in group.GetChildren()]
    kinds = Counter(each.GetAttribute("userProperties:category").Get() for each in actors)
    report = (built / "report.html").read_text(encoding="utf-8")
    assert sum(kinds.values()) > 0
    for kind, number in kinds.items():
        assert f"<tr><td>{kind}</td><td>{number}</td></tr>" in report


def test_streets_are_empty_without_actors(road: Path, built: Path, tmp_path: Path) -> None:
    """All other layers of the chunks are the same."""
    out = tmp_path / "empty"
    result = build(options(road, out, workers=1, actors=False))
    empty, full = texts(out), texts(built)
    assert not [name for name in empty if Path(name).stem == "actors"]
    assert not {"car", "pedestrian", "wheelie_bin"} & result.counts.keys()
    same = [name for name in empty if name.startswith("chunks/")]
    assert same
    assert all(empty[name] == full[name] for name in same)


def test_the_report_describes_the_environment(built: Path) -> None:
    page = (built / "report.html").read_text()
    for name, words in read_profile("1", "residential").description.items():
        assert f"<tr><td>{name}</td><td>{words}</td></tr>" in page


def test_reports_do_not_tell_in_what_order_chunks_were_finished() -> None:
    """Processes finish them in any order, and a resumed build has kept some."""
    ways = [Issue("a", Severity.INFO, "chunk", text) for text in ("one", "two")]
    records = [
        ChunkRecord({"car": 1, "van": 2}),
        ChunkRecord({"bench": 3}),
        ChunkRecord({"car": 4}),
    ]
    expected = [("bench", 3), ("car", 5), ("van", 2)]
    assert (
        list(total_counts(records).items()) == list(total_counts(records[::-1]).items()) == expected
    )
    assert list(bounded(ways)) == list(bounded(ways[::-1]))


@pytest.mark.parametrize(
    ("country", "dashes", "length", "width"), [("1", 8, 3.0, 0.12), ("2", 6, 3.05, 0.1)]
)
def test_marks_are_painted_as_the_environment_says(
    tmp_path: Path, country: str, dashes: int, length: float, width: float
) -> None:
    bare = ROAD.replace('type="broken" color="standard" width="0.12"', 'type="broken"')
    chosen = replace(options(write_road(tmp_path, bare), tmp_path / "out"), country=country)
    profile = read_profile(country, "residential")
    surface = lay_out_land(chosen, profile, Clock(lambda *_: None)).surface
    broken = np.array([patch.mark_type == "broken" for patch in surface.patches])
    corners = surface.vertices[surface.triangles[broken[surface.triangle_patch]]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert normals[:, 2].sum() / 2 == pytest.approx(dashes * length * width, rel=0.02)


def test_the_layers_are_stacked_strongest_first(built: Path) -> None:
    stage = Usd.Stage.Open(str(built / "stage.usda"))
    names = [Path(path).stem for path in stage.GetRootLayer().subLayerPaths]
    of_chunks = ["actors", "props", "buildings", "roads", "landuse", "terrain"]
    assert names == ["cameras", "atmosphere", *of_chunks, "materials", "chunks"]
    assert stage.GetDefaultPrim().GetPath() == "/World"
    assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0


def test_the_shipped_rigs_stand_on_a_lane_of_the_stage(built: Path) -> None:
    """Each rig is a variant; its cameras see what their intrinsics say."""
    stage = Usd.Stage.Open(str(built / "stage.usda"))
    vehicle = stage.GetPrimAtPath("/World/Rig")
    rigs = shipped_rigs()
    variants = vehicle.GetVariantSet("rig")
    assert (variants.GetVariantNames(), variants.GetVariantSelection()) == ([*rigs], "kitti_360")
    pose = np.array(UsdGeom.Xformable(vehicle).ComputeLocalToWorldTransform(0))
    beside = []
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.BasisCurves) and prim.GetParent().GetName() == "Lanes":
            matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0))
            points = np.array(UsdGeom.BasisCurves(prim).GetPointsAttr().Get()) @ matrix[:3, :3]
            points = points + matrix[3, :3]
            ends = points[:-1], points[1:]
            along = np.linalg.norm(ends[1] - ends[0], axis=1)
            detour = [np.linalg.norm(pose[3, :3] - end, axis=1) for end in ends]
            index = int((sum(detour) - along).argmin())
            ahead = (ends[1] - ends[0])[index] / along[index]
            beside.append((float((sum(detour) - along)[index]), float(ahead @ pose[0, :3])))
    distance, cosine = min(beside)
    assert distance < 1e-3
    assert cosine == pytest.approx(1.0, abs=1e-5), "it looks in the direction of travel"
    for name, rig in rigs.items():
        variants.SetVariantSelection(name)
        sensors = {each.name for each in (*rig.camera, *rig.lidar)}
        assert {prim.GetName() for prim in vehicle.GetChildren()} == sensors
        for camera in rig.camera:
            prim = UsdGeom.Camera(stage.GetPrimAtPath(f"/World/Rig/{camera.name}"))
            frustum = prim.GetCamera(0).frustum
            to_clip = frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()
            # A metre to the right of the axis and half above it, 20 m ahead (OpenCV's axes).
            place = pose.T @ camera.vehicle_from_camera @ (1.0, -0.5, 20.0, 1.0)
            x, y, _ = to_clip.Transform(Gf.Vec3d(*place[:3]))
            fx, fy = camera.central_focal
            u, v = camera.cx + fx / 20.0, camera.cy - fy / 40.0
            assert (x + 1.0) * camera.width / 2.0 - 0.5 == pytest.approx(u, abs=0.02)
            assert (1.0 - y) * camera.height / 2.0 - 0.5 == pytest.approx(v, abs=0.02)


def test_everything_the_stage_needs_lies_in_its_folder(built: Path) -> None:
    layers, assets, unresolved = UsdUtils.ComputeAllDependencies(str(built / "stage.usda"))
    assert not unresolved
    root = built.resolve()
    for path in [layer.realPath for layer in layers] + list(assets):
        assert root in Path(path).resolve().parents


def faces_of(stage: Usd.Stage, name: str) -> list[list[tuple[int, ...]]]:
    """Faces of all meshes below prims of that name, as corners on the millimetre grid."""
    cache = UsdGeom.XformCache()
    found = []
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Mesh) or f"/{name}/" not in str(prim.GetPath()):
            continue
        mesh = UsdGeom.Mesh(prim)
        matrix = np.array(cache.GetLocalToWorldTransform(prim))
        points = np.asarray(mesh.GetPointsAttr().Get(), dtype=np.float64) @ matrix[:3, :3]
        whole = np.round((points + matrix[3, :3]) * 1000).astype(int)
        corners = np.split(
            whole[np.asarray(mesh.GetFaceVertexIndicesAttr().Get())],
            np.cumsum(mesh.GetFaceVertexCountsAttr().Get())[:-1],
        )
        found += [[tuple(corner) for corner in face.tolist()] for face in corners]
    return found


def test_ground_and_road_are_one_watertight_surface(built: Path) -> None:
    stage = Usd.Stage.Open(str(built / "stage.usda"))
    ground, road = faces_of(stage, "Terrain"), faces_of(stage, "Roads")
    assert len(ground) > 1000
    assert len(road) > 20
    edges: Counter[tuple[tuple[int, ...], tuple[int, ...]]] = Counter()
    for face in ground + road:
        edges.update(zip(face, face[1:] + face[:1], strict=True))
    assert max(edges.values()) == 1, "two faces run along an edge in the same direction"
    corners = np.array([corner for face in ground for corner in face])
    low, high = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
    open_edges = [edge for edge in edges if edge[::-1] not in edges]
    inside = [
        (a, b)
        for a, b in open_edges
        if not any((a[i] == b[i] and a[i] in {low[i], high[i]}) for i in (0, 1))
    ]
    assert not inside


def test_no_faces_of_ground_and_road_overlap(built: Path) -> None:
    stage = Usd.Stage.Open(str(built / "stage.usda"))
    total = 0.0
    for face in faces_of(stage, "Terrain") + faces_of(stage, "Roads"):
        x, y = np.array(face, dtype=float)[:, :2].T / 1000
        signed = (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
        assert signed > -1e-6, "a face looks down"
        total += signed
    chunks = len(list((built / "chunks").iterdir()))
    assert total == pytest.approx(chunks * 200.0 * 200.0, abs=0.1)


def test_the_same_input_gives_the_same_layers_however_it_is_spread(
    road: Path, built: Path, tmp_path: Path
) -> None:
    spread = build(options(road, tmp_path / "two", workers=2))
    assert texts(tmp_path / "two") == texts(built)
    again = build(options(road, shutil.copytree(built, tmp_path / "again"), workers=1))
    assert again.built == 0
    assert spread.issues == again.issues


def test_what_has_no_room_is_told_of_chunks_that_are_kept_too(
    road: Path, built: Path, tmp_path: Path
) -> None:
    """Row houses here lose roof windows or bays; the issue names the first of them."""
    built = Path(shutil.copytree(built, tmp_path / "out"))
    again = build(options(road, built, workers=1))
    lost = [issue for issue in again.issues if issue.kind.startswith("building.")]
    assert again.built == 0
    assert lost
    report = (built / "report.html").read_text(encoding="utf-8")
    for issue in lost:
        assert issue.severity is Severity.INFO
        chunk, name = re.fullmatch(r"chunk\[(.+)\]/Building\[(.+)\]", issue.where).groups()  # type: ignore[union-attr]
        city = (built / "chunks" / chunk / "city.gml").read_text(encoding="utf-8")
        assert f'gml:id="{name}"' in city
        count, of = map(int, re.findall(r"\d+", issue.message))
        assert 0 < count <= of == city.count("<bldg:Building ")
        assert html.escape(issue.message) in report


def test_issues_of_many_chunks_are_counted() -> None:
    def issue(kind: str, number: int) -> Issue:
        return Issue(kind, Severity.INFO, f"chunk[{number:04}_0]", "1 of 2", "left out")

    many = [issue("building.b", n) for n in range(5000)] + [issue("building.a", 7)]
    found = list(bounded(reversed(many)))
    assert found[0] == issue("building.a", 7)
    assert found[1:-1] == many[:MOST_CHUNKS]
    assert found[-1].kind == "building.b"
    assert found[-1].message.startswith(f"{5000 - MOST_CHUNKS} more")


def test_another_seed_gives_other_layers(built: Path, reseeded: tuple[Path, BuildResult]) -> None:
    out, result = reseeded
    assert (result.kept, result.built) == (0, len(list((built / "chunks").iterdir())))
    one, other = texts(built), texts(out)
    changed = {name for name in one.keys() & other.keys() if one[name] != other[name]}
    assert {Path(name).stem for name in changed} >= {"props", "buildings"}
    # Streets draw their asphalt and pavement; their shape stays.
    assert "stage" not in {Path(name).stem for name in changed}
    for name in (name for name in changed if Path(name).stem == "roads"):
        assert sorted(vertices(one[name])) == sorted(vertices(other[name]))


def vertices(layer: str) -> set[str]:
    """Every point of the meshes of a layer, as it is written."""
    arrays = re.findall(r"points = \[(.*?)\]", layer)
    return {point for array in arrays for point in re.findall(r"\([^)]*\)", array)}


def test_a_build_goes_on_where_it_stopped(
    road: Path, first: tuple[Path, BuildResult], tmp_path: Path
) -> None:
    out, whole = tmp_path / "out", first[1]
    shutil.copytree(first[0], out)
    assert (whole.kept, whole.built) == (0, len(list((out / "chunks").iterdir())))
    before = texts(out)
    lost = sorted((out / "chunks").iterdir())[0]
    (lost / "made.json").unlink()
    again = build(options(road, out, workers=1))
    assert (again.kept, again.built) == (whole.built - 1, 1)
    assert again.counts == whole.counts
    assert again.issues == whole.issues
    assert texts(out) == before


def test_a_folder_that_another_build_holds_is_refused_at_once(road: Path, tmp_path: Path) -> None:
    out, steps = tmp_path / "out", []
    with (
        locked(out),
        pytest.raises(EnvgenError, match=f"out: is being built by process {getpid()}"),
    ):
        build(options(road, out), progress=lambda *step: steps.append(step))
    assert steps == []
    assert not out.exists()


def test_the_manifest_lists_products_with_their_hashes(built: Path) -> None:
    manifest = json.loads((built / "manifest.json").read_text())
    assert manifest["inputs"]["road"] == "small.xodr"
    assert manifest["inputs"]["seed"] == 0
    products = manifest["products"]
    assert {name for name in products if name.endswith("city.gml")} == {
        "city.gml",
        *(f"chunks/{chunk.name}/city.gml" for chunk in (built / "chunks").iterdir()),
    }
    folders = {"assets", "chunks", "layers", "materials", "skies", "textures"}
    assert {name.split("/")[0] for name in products if "/" in name} <= folders
    for name, digest in products.items():
        assert hashlib.sha256((built / name).read_bytes()).hexdigest() == digest
    assert set(manifest["seconds"]) == {
        "file",
        "road",
        "terrain",
        "landuse",
        "index",
        "chunks",
        "stage",
    }


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("hello", "small.xodr"),
        ("<OpenDRIVE><header/></OpenDRIVE>", "no road"),
        ("<svg/>", "OpenDRIVE"),
        ("", "small.xodr"),
    ],
)
def test_bad_roads_are_named_and_leave_nothing(text: str, said: str, tmp_path: Path) -> None:
    road = write_road(tmp_path, text)
    with pytest.raises(EnvgenError, match=said):
        build(options(road, tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_a_missing_road_is_named(tmp_path: Path) -> None:
    with pytest.raises(EnvgenError, match=r"nowhere\.xodr"):
        build(options(tmp_path / "nowhere.xodr", tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_other_files_are_never_overwritten(road: Path, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(EnvgenError, match="holds other files"):
        build(options(road, tmp_path))
    with pytest.raises(EnvgenError, match="is a file"):
        build(options(road, tmp_path / "thesis.txt"))
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]

"""A stage that was read before is taken from the cache, and only if nothing has changed."""

import multiprocessing
import os
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom
from tests.render.conftest import counted_calls

import envgen_usd.render.stage.scene_cache as cache_module
import envgen_usd.render.stage.stage_scene as scene_module
from envgen_usd.render.stage.stage_scene import StageScene
from envgen_usd.render.user_cache import FOLDER

EVERYWHERE = np.zeros((1, 3)), 1e6


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """Folder of the stages in the cache."""
    folder = tmp_path / "cache"
    monkeypatch.setenv(FOLDER, str(folder))
    return folder / "stages"


@pytest.fixture
def town(author, tmp_path):
    """Two chunks, each with a payload of a house, ground with a lane, and three trees."""
    folder = tmp_path / "town"
    folder.mkdir()
    tree = author(folder / "tree.usda")
    tree.box("/World/trunk", (-0.2, -0.2, 0), (0.2, 0.2, 3), label="vegetation")
    tree.stage.Save()
    top = author(folder / "town.usda")
    top.square("/World/wall", 12.0, (-3, -3), (3, 3), label="building")
    for number in range(2):
        part = author(folder / f"chunk_{number}.usda")
        points = [(-20, 0, 0), (20, 0, 0), (20, 100, 0), (-20, 100, 0)]
        part.mesh("/World/road", points, [(0, 1, 2, 3)], label="road")
        part.lane("/World/lane", f"lane_{number}", [(2, 0, 0), (2, 100, 0)])
        house = part.box("/World/house", (6, 40, 0), (12, 60, 6), label="building")
        part.kind(house.GetPrim(), "component")
        for index in range(3):
            planted = UsdGeom.Xform.Define(part.stage, f"/World/tree_{index}")
            planted.AddTranslateOp().Set(Gf.Vec3d(-6.0, 20.0 + 10 * index, 0.0))
            planted.GetPrim().GetReferences().AddReference("./tree.usda", "/World")
            planted.GetPrim().SetInstanceable(True)
        part.stage.Save()
        prim = top.stage.DefinePrim(f"/World/chunk_{number}/content", "Xform")
        UsdGeom.Xformable(prim).AddTranslateOp().Set(Gf.Vec3d(0.0, 100.0 * number, 0.0))
        prim.GetPayloads().AddPayload(f"./chunk_{number}.usda", "/World")
    top.stage.Save()
    return folder / "town.usda"


@pytest.fixture
def surveys(monkeypatch):
    """Counts how often a stage itself is read."""
    return counted_calls(monkeypatch, scene_module, "StageSurvey")


def _content(stage):
    """All that frames follow from, as plain values."""
    scene = stage.near(*EVERYWHERE)
    geometries = [
        {name: np.asarray(value).tolist() for name, value in vars(mesh).items()}
        for mesh in scene.geometries
    ]
    uses = [
        (u.geometry, u.matrices.tolist(), u.scene_objects.tolist(), u.region, u.level)
        for u in scene.uses
    ]
    lamps = [array.tolist() for array in vars(scene.lamps).values()]
    lanes = [(lane.id, lane.points.tolist(), lane.successors) for lane in scene.lanes]
    looks = scene.materials, scene.scene_objects, scene.bounds.tolist(), scene.issues
    merged = {
        number: [array.tobytes() for array in vars(each).values()]
        for number, each in scene.merged.items()
    }
    return geometries, uses, lamps, lanes, looks, merged, stage.digests


def _edit(path, old, new):
    """Changes a layer, but neither its size nor its time."""
    state, text = path.stat(), path.read_text()
    assert old in text
    assert len(old) == len(new)
    path.write_text(text.replace(old, new))
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))


def test_what_is_in_the_cache_is_what_is_on_the_stage(town, surveys):
    first = _content(StageScene(town))
    assert len(surveys) == 1
    assert _content(StageScene(town)) == first
    assert len(surveys) == 1
    assert _content(StageScene(town, cache=False)) == first
    assert len(surveys) == 2


def test_regions_from_the_cache_share_prototypes(town, monkeypatch):
    StageScene(town)
    monkeypatch.setattr(scene_module, "_KEPT", 0)
    scene = StageScene(town).near(*EVERYWHERE)
    trees = [use for use in scene.uses if len(use.matrices) == 3]
    assert len(trees) == 2
    assert len({use.geometry for use in trees}) == 1


def test_regions_that_do_not_fit_into_memory_are_read_from_the_cache(town, monkeypatch):
    first = _content(StageScene(town, cache=False))
    monkeypatch.setattr(scene_module, "_KEPT", 0)
    stage = StageScene(town)
    monkeypatch.setattr(Usd.Stage, "LoadAndUnload", None)
    assert _content(stage) == first


def test_a_relative_path_is_the_same_stage(town, surveys, monkeypatch):
    StageScene(town)
    monkeypatch.chdir(town.parent)
    StageScene("town.usda")
    assert len(surveys) == 1


@pytest.mark.parametrize(
    "edit",
    [
        ("chunk_1.usda", "(12, 60, 6)", "(12, 60, 9)"),
        ("tree.usda", "3)", "7)"),
        ("town.usda", '"building"', '"terrains"'),
    ],
)
def test_an_edit_of_any_layer_is_seen(town, surveys, edit):
    before = _content(StageScene(town))
    _edit(town.parent / edit[0], *edit[1:])
    after = _content(StageScene(town))
    assert after != before
    assert after == _content(StageScene(town, cache=False))
    assert len(surveys) == 3


def test_an_edit_that_is_taken_back_finds_the_first_scene(town, surveys):
    StageScene(town)
    _edit(town.parent / "tree.usda", "3)", "7)")
    StageScene(town)
    _edit(town.parent / "tree.usda", "7)", "3)")
    StageScene(town)
    assert len(surveys) == 2


def test_unsaved_edits_of_the_process_are_seen(town, cache, surveys):
    before = _content(StageScene(town))
    edited = Usd.Stage.Open(str(town.parent / "chunk_1.usda"))
    edited.GetPrimAtPath("/World/house").SetActive(False)
    assert _content(StageScene(town)) != before
    assert len(surveys) == 2
    assert len(list(cache.iterdir())) == 1


@pytest.mark.parametrize("missing", ["chunk_1.usda", "tree.usda"])
def test_a_stage_with_a_missing_file_is_not_stored(town, surveys, missing):
    path = town.parent / missing
    content = path.read_text()
    path.unlink()
    assert any(issue.kind == "stage.composition" for issue in StageScene(town).scene.issues)
    path.write_text(content)
    os.utime(path, (0, 0))
    assert not StageScene(town).scene.issues
    StageScene(town)
    assert len(surveys) == 2


def test_a_file_that_changes_while_it_is_read_is_not_stored(town, surveys):
    later = (town.parent / "tree.usda").stat().st_mtime + 3600.0
    os.utime(town.parent / "tree.usda", (later, later))
    StageScene(town)
    StageScene(town)
    assert len(surveys) == 2


@pytest.mark.parametrize("damage", ["arrays", "scene.msgpack"])
def test_a_damaged_scene_is_read_anew(town, cache, surveys, damage):
    first = _content(StageScene(town))
    (folder,) = cache.iterdir()
    content = (folder / damage).read_bytes()
    (folder / damage).unlink()  # the first scene maps the file into memory
    (folder / damage).write_bytes(content[: len(content) // 2])
    assert _content(StageScene(town)) == first
    assert len(surveys) == 2
    StageScene(town)
    assert len(surveys) == 2


def test_an_empty_folder_name_is_no_cache(town, tmp_path, surveys, monkeypatch):
    monkeypatch.setenv(FOLDER, "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    for _ in range(2):
        StageScene(town)
    assert len(surveys) == 2
    assert not (tmp_path / "home").exists()
    monkeypatch.delenv(FOLDER)
    for _ in range(2):
        StageScene(town)
    assert len(surveys) == 3
    assert list((tmp_path / "home" / "envgen-usd" / "stages").iterdir())


def test_a_folder_that_cannot_be_written_is_no_error(town, tmp_path, surveys, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv(FOLDER, str(tmp_path / "file" / "cache"))
    for _ in range(2):
        assert StageScene(town).near(*EVERYWHERE).uses
    assert len(surveys) == 2


def test_the_cache_keeps_the_scenes_used_last(town, cache, monkeypatch):
    StageScene(town)
    (first,) = cache.iterdir()
    size = sum(file.stat().st_size for file in first.iterdir())
    os.utime(first, (0, 0))
    monkeypatch.setattr(cache_module, "_MOST", 1.5 * size)
    _edit(town.parent / "tree.usda", "3)", "7)")
    StageScene(town)
    (second,) = cache.iterdir()
    assert second != first


def _read(path):
    return repr(_content(StageScene(Path(path)))[:2])


def test_processes_store_the_same_stage_at_once(town, cache):
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        found = pool.map(_read, [str(town)] * 4, chunksize=1)
    assert len(set(found)) == 1
    assert [folder.name[0] != "." for folder in cache.iterdir()] == [True]

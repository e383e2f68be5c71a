"""A stage is read region by region, and a frame follows from its pose alone."""

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom

import envgen_usd.render.stage.stage_scene as module
from envgen_usd.errors import EnvgenError
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.stage.stage_reader import open_stage, read_scene
from envgen_usd.render.stage.stage_scene import StageScene, cells

APART = 500.0
"""Distance of the chunks of the long stage, metres."""
COUNT = 6


@pytest.fixture
def long_stage(author, tmp_path):
    """Chunks in a row; each has payloads of a house, of ground with a lane, and of three trees."""
    _write_tree(author, tmp_path)
    top = author(tmp_path / "long.usda")
    for number in range(COUNT):
        name = f"chunk_{number}"
        chunk = UsdGeom.Xform.Define(top.stage, f"/World/{name}")
        chunk.AddTranslateOp().Set(Gf.Vec3d(0.0, APART * number, 0.0))
        for layer, add in (("ground", _add_ground), ("houses", _add_house), ("trees", _add_trees)):
            part = author(tmp_path / f"{name}_{layer}.usda")
            add(part, number)
            part.stage.Save()
            prim = top.stage.DefinePrim(f"/World/{name}/{layer}", "Xform")
            prim.GetPayloads().AddPayload(f"./{name}_{layer}.usda", "/World")
    top.stage.Save()
    return tmp_path / "long.usda"


def _write_tree(author, folder):
    tree = author(folder / "tree.usda")
    tree.box("/World/trunk", (-0.2, -0.2, 0), (0.2, 0.2, 3), label="vegetation")
    tree.stage.Save()


def _add_ground(write, number):
    points = [(-20, 0, 0), (20, 0, 0), (20, APART, 0), (-20, APART, 0)]
    write.mesh("/World/road", points, [(0, 1, 2, 3)], label="road")
    write.lane("/World/lane", f"lane_{number}", [(2, 0, 0), (2, APART, 0)])


def _add_house(write, number):
    house = write.box("/World/house", (6, 40, 0), (12, 60, 6 + number), label="building")
    write.kind(house.GetPrim(), "component")


def _add_trees(write, number):
    for index in range(3):
        tree = UsdGeom.Xform.Define(write.stage, f"/World/tree_{index}")
        tree.AddTranslateOp().Set(Gf.Vec3d(-6.0, 20.0 + 10 * index + number, 0.0))
        tree.GetPrim().GetReferences().AddReference("./tree.usda", "/World")
        tree.GetPrim().SetInstanceable(True)
        write.kind(tree.GetPrim(), "component")


def _pose(along):
    eye = np.array([2.0, along, 1.5])
    return Pose(look_at(eye, eye + np.array([0.0, 1.0, 0.0])))


def _triangles(scene):
    return sum(len(scene.geometries[u.geometry].triangles) * len(u.matrices) for u in scene.uses)


def test_a_stage_read_in_regions_is_the_stage_read_at_once(long_stage):
    whole = read_scene(open_stage(long_stage))
    parts = StageScene(long_stage)
    assert parts.scene.scene_objects == whole.scene_objects
    assert [lane.id for lane in parts.scene.lanes] == [lane.id for lane in whole.lanes]
    assert parts.scene.bounds == pytest.approx(whole.bounds)
    assert parts.scene.issues == whole.issues
    everything = parts.near(np.array([[0.0, 0.0, 0.0]]), 1e6)
    assert _triangles(everything) == _triangles(whole)
    placed = np.concatenate([use.scene_objects for use in everything.uses])
    assert sorted(placed) == sorted(np.concatenate([use.scene_objects for use in whole.uses]))


def test_only_regions_within_range_are_read(long_stage, monkeypatch):
    monkeypatch.setattr(module, "_KEPT", 0)
    stage = StageScene(long_stage)
    near = stage.near(np.array([[2.0, 100.0, 1.5]]), 300.0)
    paths = {near.scene_objects[i].path for use in near.uses for i in use.scene_objects}
    houses = {path.split("/")[2] for path in paths if path.endswith("house")}
    assert houses == {"chunk_0", "chunk_1"}
    loaded = [path for path in stage.stage.GetLoadSet() if path != Sdf.Path("/")]
    assert loaded == []


def test_a_place_is_prepared_anew_where_it_shows_other_regions(long_stage):
    stage, reach = StageScene(long_stage), 300.0
    prepared = []

    def prepare(scene, within):
        prepared.append(within)
        return _triangles(scene)

    def at(along, within=reach):
        eyes = np.array([[2.0, along, 1.5]])
        scene, found = stage.prepared(eyes, within, prepare)
        assert found == _triangles(scene) == _triangles(stage.near(eyes, within))

    for along in (100.0, 101.0):  # the same regions
        at(along)
    assert prepared == [reach]
    at(APART * 3)
    at(100.0)  # only the last place is kept
    at(100.0, 299.0)
    assert prepared == [reach] * 3 + [299.0]
    stage.forget()
    at(100.0, 299.0)
    assert len(prepared) == 5


def test_regions_share_prototypes_whenever_they_are_read(long_stage):
    stage = StageScene(long_stage)
    scene = stage.near(np.array([[0.0, 0.0, 0.0]]), 1e6)
    trees = [use for use in scene.uses if len(use.matrices) == 3]
    assert len(trees) == COUNT
    assert len({use.geometry for use in trees}) == 1
    assert len(stage.scene.materials) == len({repr(look) for look in scene.materials})


def test_a_frame_follows_from_its_pose_alone(long_stage, opengl, small_camera, monkeypatch):
    assert opengl
    monkeypatch.setattr(module, "_KEPT", 0)
    pose, reach = _pose(30.0), 700.0
    frames = []
    for others in ([], [APART * 2], [APART * 4, 20.0]):
        stage = StageScene(long_stage)
        eyes = np.array([p.matrix[:3, 3] for p in (pose, *map(_pose, others))])
        part = stage.near(eyes, reach)
        with open_context():
            from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

            frames.append(
                FrameRenderer(part, pack(part, reach), small_camera).draw(FrameRequest(pose))
            )
    for frame in frames[1:]:
        np.testing.assert_array_equal(frame.scene_objects, frames[0].scene_objects)
        np.testing.assert_array_equal(frame.depth, frames[0].depth)
        np.testing.assert_array_equal(frame.radiance, frames[0].radiance)
    assert 100.0 < frames[0].depth.max() < reach + APART


def test_one_open_stage_serves_several_rigs_and_weathers(long_stage, opengl, tmp_path, monkeypatch):
    assert opengl
    opened = []
    monkeypatch.setattr(
        module, "open_stage", lambda path, **more: opened.append(path) or open_stage(path, **more)
    )
    stage = StageScene(long_stage)
    options = {"trajectory": "drive", "outputs": ("rgb", "semantic", "depth")}
    for rig in ("camvid", "nuscenes_front"):
        render_frames(stage, tmp_path / rig, 2, rig=rig, **options)
    assert len(opened) == 1
    render_frames(long_stage, tmp_path / "alone", 2, rig="camvid", **options)
    assert len(opened) == 2
    files = list((tmp_path / "alone").rglob("0*.*"))
    assert len(files) == 6
    for file in files:
        other = tmp_path / "camvid" / file.relative_to(tmp_path / "alone")
        assert file.read_bytes() == other.read_bytes()


def test_places_are_judged_in_their_region(long_stage, monkeypatch):
    monkeypatch.setattr(module, "_KEPT", 0)
    stage = StageScene(long_stage)
    eyes = np.array([[9.0, 50.0 + APART * 3, 2.0], [2.0, 50.0, 1.5], [9.0, 50.0, 30.0]])
    assert stage.refused(eyes).tolist() == [True, False, False]


def test_cells_hold_each_place_once():
    eyes = np.random.default_rng(0).uniform(-900.0, 900.0, (200, 3))
    groups = cells(eyes, 400.0)
    assert sorted(index for group in groups for index in group) == list(range(200))
    for group in groups:
        assert np.ptp(eyes[group][:, :2], axis=0).max() <= 400.0


def test_places_are_joined_while_their_regions_fit_into_memory(long_stage, monkeypatch):
    stage = StageScene(long_stage)
    eyes = np.array([[2.0, APART * n + 50.0, 1.5] for n in (5, 0, 2, 3, 1, 4)])
    (together,) = stage.places(eyes, 300.0)
    assert sorted(together) == list(range(6))
    one = stage._regions[0].size
    monkeypatch.setattr(module, "_TOGETHER", 3 * one)
    groups = stage.places(eyes, 300.0)
    assert sorted(number for group in groups for number in group) == list(range(6))
    assert len(groups) == 3
    monkeypatch.setattr(module, "_TOGETHER", 0)
    assert len(stage.places(eyes, 300.0)) == 6


def test_a_range_of_nothing_is_refused(long_stage):
    with pytest.raises(EnvgenError, match="range must be above 0"):
        StageScene(long_stage).near(np.zeros((1, 3)), 0.0)


@pytest.mark.parametrize("arc", ["payload", "sublayer"])
def test_a_missing_file_is_named_with_its_prim(author, tmp_path, arc):
    top = author(tmp_path / "top.usda")
    top.square("/World/wall", 12.0, (-3, -3), (3, 3), label="building")
    if arc == "payload":
        prim = top.stage.DefinePrim("/World/chunk/gone", "Xform")
        prim.GetPayloads().AddPayload("./gone.usda")
    else:
        top.stage.GetRootLayer().subLayerPaths.append("./gone.usda")
    top.stage.Save()
    Usd.Stage.Open(str(tmp_path / "top.usda"))
    (issue,) = [i for i in StageScene(tmp_path / "top.usda").scene.issues if "gone" in i.message]
    assert issue.kind == "stage.composition"
    assert "gone.usda" in issue.message
    assert issue.where == ("/World/chunk/gone" if arc == "payload" else "/")

"""What is not finite on a stage is named and left out; the rest is drawn."""

import tracemalloc

import numpy as np
import pytest
from pxr import Gf, UsdGeom, Vt

from envgen_usd.label_taxonomy import label
from envgen_usd.render.stage.stage_reader import read_scene

NAN = float("nan")


def faulty_mesh(write):
    write.mesh("/World/bad", [(0, 10, 0), (NAN, 10, 0), (1, 10, 1)], [(0, 1, 2)], label="pole")


def faulty_transform(write):
    bad = write.square("/World/bad", 8.0, (-1, -1), (1, 1), label="pole")
    UsdGeom.Xformable(bad).AddTranslateOp().Set(Gf.Vec3d(NAN, 0, 0))


def faulty_instance(write):
    instancer = UsdGeom.PointInstancer.Define(write.stage, "/World/bad")
    write.square("/World/bad/plate", 0.0, (-1, -1), (1, 1), label="pole")
    instancer.CreatePrototypesRel().SetTargets(["/World/bad/plate"])
    instancer.CreateProtoIndicesAttr([0, 0])
    places = np.array([[NAN, 8, 0], [6, 8, 0]], np.float32)
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(places))


@pytest.mark.parametrize("add", [faulty_mesh, faulty_transform, faulty_instance])
def test_the_file_of_what_is_not_finite_is_named(author, tmp_path, add):
    below = author(tmp_path / "below.usda")
    add(below)
    below.stage.Save()
    write = author(tmp_path / "top.usda")
    write.square("/World/wall", 12.0, (-3, -3), (3, 3), label="building")
    write.stage.GetRootLayer().subLayerPaths.append("./below.usda")
    (issue,) = [i for i in read_scene(write.stage).issues if "not finite" in i.message]
    assert issue.where == "/World/bad"
    assert str(tmp_path / "below.usda") in issue.message


def test_an_instancer_of_too_many_points_is_named_and_left_out(author, tmp_path):
    write = author(tmp_path / "many.usda")
    write.square("/World/wall", 12.0, (-3, -3), (3, 3), label="building")
    faulty_instance(write)
    count = 10_000_000
    instancer = UsdGeom.PointInstancer.Get(write.stage, "/World/bad")
    instancer.GetProtoIndicesAttr().Set(Vt.IntArray.FromNumpy(np.zeros(count, np.int32)))
    instancer.GetPositionsAttr().Set(Vt.Vec3fArray.FromNumpy(np.zeros((count, 3), np.float32)))
    tracemalloc.start()
    scene = read_scene(write.stage)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    (issue,) = [each for each in scene.issues if each.kind == "stage.instancer"]
    assert issue.where == "/World/bad"
    assert "10,000,000" in issue.message
    assert str(tmp_path / "many.usda") in issue.message
    assert peak < 300e6
    assert len(scene.uses) == 1


@pytest.mark.parametrize(
    "case",
    [
        (faulty_mesh, "stage.mesh", 0),
        (faulty_transform, "stage.transform", 0),
        (faulty_instance, "stage.instancer", 1),
    ],
    ids=lambda case: case[1],
)
def test_what_is_not_finite_is_left_out(author, shoot, small_camera, ahead, case):
    add, kind, others = case
    write = author()
    write.square("/World/wall", 12.0, (-3, -3), (3, 3), label="building")
    add(write)
    scene = read_scene(write.stage)
    (issue,) = [each for each in scene.issues if each.kind == kind]
    assert issue.where == "/World/bad"
    assert "not finite" in issue.message
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    seen = [scene_objects[i].label for i in np.unique(frame.scene_objects)]
    assert "building" in seen
    assert seen.count("pole") == others
    assert np.isfinite(frame.radiance).all()
    assert label("building").id in {label(name).id for name in seen}

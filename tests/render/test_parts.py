"""Parts of objects in the label images, beside their classes."""

import numpy as np
import pytest
from pxr import UsdGeom, UsdSemantics

from envgen_usd.label_taxonomy import label, parts
from envgen_usd.render.frames.label_images import LabelPainter
from envgen_usd.render.stage.stage_reader import read_scene


def name_part(prim, *tokens):
    UsdSemantics.LabelsAPI.Apply(prim, "part").CreateLabelsAttr(list(tokens))


@pytest.fixture
def house(author):
    """Left half a wall, right half a window with its pane in the right quarter."""
    write = author()
    root = UsdGeom.Xform.Define(write.stage, "/World/house").GetPrim()
    write.kind(root, "component")
    write.label(root, "building")
    name_part(write.square("/World/house/wall", 10.0, (-9, -5), (0, 5)).GetPrim(), "wall")
    window = UsdGeom.Xform.Define(write.stage, "/World/house/window").GetPrim()
    name_part(window, "window")
    write.square("/World/house/window/rest", 10.0, (0, -5), (5, 5))
    name_part(
        write.square("/World/house/window/pane", 10.0, (5, -5), (9, 5)).GetPrim(), "window_pane"
    )
    return write


def test_parts_lie_beside_one_object(house, shoot, small_camera, ahead):
    frame, scene_objects = shoot(house.stage, small_camera, ahead)
    painter = LabelPainter(scene_objects)
    images = painter.paint(frame.scene_objects)
    table = parts()
    row = images.part[50]
    assert (row[12:99] == table["wall"]).all()
    assert (row[101:148] == table["window"]).all()
    assert (row[152:188] == table["window_pane"]).all()
    assert row[0] == row[-1] == 0
    code = label("building").id * 10_000_000 + 1
    assert (images.instance[50, 12:188] == code).all()
    assert images.objects == {code: "/World/house"}
    assert len(np.unique(images.instance)) == 2


def test_a_class_of_its_own_ends_the_part_above(house):
    window = house.stage.GetPrimAtPath("/World/house/window")
    house.label(window, "pole")
    found = {
        (scene_object.label, scene_object.part)
        for scene_object in read_scene(house.stage).scene_objects
    }
    assert ("pole", "window") in found
    window.RemoveAPI(UsdSemantics.LabelsAPI, "part")
    found = {
        (scene_object.label, scene_object.part)
        for scene_object in read_scene(house.stage).scene_objects
    }
    assert {("pole", ""), ("pole", "window_pane"), ("building", "wall")} <= found


def test_an_unknown_part_is_reported(house):
    name_part(house.stage.GetPrimAtPath("/World/house/wall"), "spandrel")
    scene = read_scene(house.stage)
    (issue,) = (found for found in scene.issues if found.kind == "label.unknown")
    assert "'spandrel'" in issue.message
    assert issue.where == "/World/house/wall"


def test_subsets_bring_their_parts(author, shoot, small_camera, ahead):
    write = author()
    points = [(x, 10, z) for z in (-5, 5) for x in (-9, 0, 9)]
    mesh = write.mesh("/World/wall", points, [(0, 1, 4, 3), (1, 2, 5, 4)], label="building")
    name_part(mesh.GetPrim(), "wall")
    subset = UsdGeom.Subset.CreateGeomSubset(mesh, "door", "face", [1])
    name_part(subset.GetPrim(), "door")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    row = LabelPainter(scene_objects).paint(frame.scene_objects).part[50]
    assert (row[12:99] == parts()["wall"]).all()
    assert (row[101:188] == parts()["door"]).all()


def test_numbers_of_parts_are_told_apart():
    table = parts()
    assert len(set(table.values())) == len(table)
    assert all(0 < number < 256 for number in table.values())

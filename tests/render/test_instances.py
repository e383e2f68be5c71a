"""Which object each pixel belongs to."""

import numpy as np
import pytest
from pxr import Gf, Sdf, UsdGeom, Vt

from envgen_usd.label_taxonomy import label
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR, LabelPainter
from envgen_usd.render.render_scene import SceneObject
from envgen_usd.render.stage.stage_reader import read_scene


def _house(write, name, x, *, part_of=""):
    prim = UsdGeom.Xform.Define(write.stage, f"/World/{name}").GetPrim()
    write.kind(prim, "component")
    write.label(prim, "building")
    if part_of:
        attribute = prim.CreateAttribute("userProperties:part_of", Sdf.ValueTypeNames.String)
        attribute.Set(part_of)
    write.square(f"/World/{name}/wall", 10.0, (x - 0.8, -1), (x + 0.8, 1))


def test_each_component_is_an_object(author, shoot, small_camera, ahead):
    write = author()
    for index in range(5):
        _house(write, f"h{index}", 2.0 * index - 4.0)
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    images = LabelPainter(scene_objects).paint(frame.scene_objects)
    assert sorted(images.objects.values()) == [f"/World/h{i}" for i in range(5)]
    base = label("building").id * INSTANCE_FACTOR
    for value, path in images.objects.items():
        rows, columns = np.nonzero(images.instance == value)
        assert base < value < base + INSTANCE_FACTOR
        assert columns.mean() == pytest.approx(99.5 + 20 * int(path[-1]) - 40, abs=0.51)
        assert len(rows) == 16 * 20


def test_a_window_belongs_to_its_building(author, shoot, small_camera, ahead):
    write = author()
    _house(write, "house", 0.0)
    _house(write, "window", 2.0, part_of="../house")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    images = LabelPainter(scene_objects).paint(frame.scene_objects)
    assert list(images.objects.values()) == ["/World/house"]
    assert (images.instance == next(iter(images.objects))).sum() == 2 * 16 * 20


def test_classes_without_instances_have_number_zero(author, shoot, small_camera, ahead):
    write = author()
    for index in range(3):
        mesh = write.square(f"/World/r{index}", 9.0, (index, 0), (index + 1, 1), label="road")
        write.kind(mesh.GetPrim(), "component")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    images = LabelPainter(scene_objects).paint(frame.scene_objects)
    assert set(np.unique(images.instance).tolist()) == {70_000_000, 230_000_000}
    assert images.objects == {}


def test_scene_graph_instances_share_a_mesh_and_are_objects(author, shoot, small_camera, ahead):
    write = author()
    source = write.stage.CreateClassPrim("/Sign")
    write.square("/Sign/plate", 0.0, (-0.4, -0.4), (0.4, 0.4))
    for index in range(8):
        sign = UsdGeom.Xform.Define(write.stage, f"/World/s{index}")
        sign.AddTranslateOp().Set(Gf.Vec3d(index - 3.5, 10.0, 0.0))
        sign.GetPrim().GetInherits().AddInherit(source.GetPath())
        sign.GetPrim().SetInstanceable(True)
        write.kind(sign.GetPrim(), "component")
        write.label(sign.GetPrim(), "pole")
    scene = read_scene(write.stage)
    assert len(scene.geometries) == 1
    assert len(scene.uses[0].matrices) == 8
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    images = LabelPainter(scene_objects).paint(frame.scene_objects)
    assert sorted(images.objects.values()) == [f"/World/s{i}" for i in range(8)]
    assert all((images.instance == value).sum() == 64 for value in images.objects)


def test_point_instances_are_objects_and_can_be_hidden(author, shoot, small_camera, ahead):
    write = author()
    instancer = UsdGeom.PointInstancer.Define(write.stage, "/World/bushes")
    write.label(instancer.GetPrim(), "vegetation")
    write.square("/World/bushes/kinds/bush", 0.0, (-0.4, -0.4), (0.4, 0.4))
    instancer.CreatePrototypesRel().SetTargets([Sdf.Path("/World/bushes/kinds/bush")])
    instancer.CreateProtoIndicesAttr([0] * 6)
    points = np.array([(i - 2.5, 10.0, 0.0) for i in range(6)], np.float32)
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(points))
    instancer.CreateInvisibleIdsAttr([2])
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    images = LabelPainter(scene_objects).paint(frame.scene_objects)
    assert len(images.objects) == 5
    assert (images.semantic == label("vegetation").id).sum() == 5 * 64
    assert (images.semantic[45:55, 90:99] == label("sky").id).all()


def test_an_edit_of_a_variant_or_a_label_shows(author, shoot, small_camera, ahead):
    """The exporter reads the composed stage, so what an artist changes counts."""
    write = author()
    house = write.square("/World/house", 10.0, (-1, -1), (1, 1), label="building").GetPrim()
    variants = house.GetVariantSets().AddVariantSet("state")
    for name in ("whole", "ruin"):
        variants.AddVariant(name)
    variants.SetVariantSelection("ruin")
    with variants.GetVariantEditContext():
        points = [(-1, 10, -1), (1, 10, -1), (1, 10, 0), (-1, 10, 0)]
        over = UsdGeom.Mesh(house).GetPointsAttr()
        over.Set(Vt.Vec3fArray.FromNumpy(np.array(points, np.float32)))
    house.GetAttribute("points").Clear()
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    ids = np.array([scene_object.label for scene_object in scene_objects])[frame.scene_objects]
    assert (ids == "building").sum() == 20 * 10
    write.label(house, "terrain")
    frame, scene_objects = shoot(write.stage, small_camera, ahead)
    assert "building" not in {
        scene_objects[i].label for i in np.unique(frame.scene_objects).tolist()
    }


def _crowd(count):
    scene_objects = [SceneObject("sky"), SceneObject("void")]
    return scene_objects + [SceneObject("vegetation", f"/t{i}", i + 1) for i in range(count)]


def test_more_objects_of_a_class_than_16_bits_hold():
    count = 70_000
    painter = LabelPainter(_crowd(count))
    pixels = np.arange(2, 2 + count, dtype=np.uint32).reshape(700, 100)
    images = painter.paint(pixels)
    assert images.objects == {210_000_001 + i: f"/t{i}" for i in range(count)}
    some = painter.paint(pixels[300:310])
    np.testing.assert_array_equal(some.instance, images.instance[300:310])
    assert some.objects.items() <= images.objects.items()


def test_parts_have_the_value_of_their_object():
    parts = [SceneObject("building", "/h", 1, part) for part in ("", "wall", "roof")]
    other = [SceneObject("building", "/g", 2, "wall"), SceneObject("road", part="kerb")]
    painter = LabelPainter([SceneObject("sky"), SceneObject("void"), *parts, *other])
    images = painter.paint(np.arange(7, dtype=np.uint32)[None])
    values = [230_000_000, 0, 110_000_001, 110_000_001, 110_000_001, 110_000_002, 70_000_000]
    assert images.instance[0].tolist() == values
    assert images.objects == {110_000_001: "/h", 110_000_002: "/g"}

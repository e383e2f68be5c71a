"""The props layer: poses, choices, references, metadata."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pxr import Sdf, Usd, UsdGeom

from envgen_usd.assets.prim_authoring import add_prim, set_attribute
from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.layers.prop_poses import opening_pose, placement_pose
from envgen_usd.layers.props_layer import write_props
from envgen_usd.models.city_model import City, CityObject, Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

BOUNDS = ["default", "render"]


@pytest.fixture(scope="module")
def stage(stage_file):
    return Usd.Stage.Open(str(stage_file))


def world_box(prim):
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), BOUNDS)
    box = cache.ComputeWorldBound(prim).ComputeAlignedRange()
    return np.array([box.GetMin(), box.GetMax()])


def matrix(pose):
    stage = Usd.Stage.CreateInMemory()
    prim = UsdGeom.Xform.Define(stage, "/P")
    prim.AddTranslateOp().Set(tuple(pose.translate))
    prim.AddRotateXYZOp().Set(tuple(pose.rotate))
    prim.AddScaleOp().Set(tuple(pose.scale))
    return np.array(prim.GetLocalTransformation()).T


def apply(pose, point):
    return (matrix(pose) @ [*point, 1.0])[:3]


@given(
    st.floats(-np.pi, np.pi), st.floats(0.3, 5.0), st.floats(0.3, 5.0), st.floats(-50.0, 50.0),
    st.integers(0, 3),
)  # fmt: skip
def test_an_opening_is_filled_by_its_asset(heading, width, height, x, first):
    """The unit box's corners land on the opening's, its y axis looks out of the wall."""
    along = np.array([np.cos(heading), np.sin(heading), 0.0])
    low = np.array([x, 2.0, 1.5])
    up = np.array([0.0, 0.0, height])
    ring = np.stack([low, low + width * along, low + width * along + up, low + up])
    pose = opening_pose(Polygons.of_rings([np.roll(ring, first, axis=0)]))
    outward = np.cross(along, [0.0, 0.0, 1.0])
    right, left = ring[1], ring[0]
    np.testing.assert_allclose(apply(pose, (0, 0, 0)), right, atol=1e-5)
    np.testing.assert_allclose(apply(pose, (1, 0, 1)), left + up, atol=1e-5)
    np.testing.assert_allclose(apply(pose, (0, 1, 0)) - apply(pose, (0, 0, 0)), outward, atol=1e-5)


def test_openings_that_no_rectangle_can_fill_are_left_alone():
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    assert opening_pose(Polygons.of_rings([flat])) is None
    assert opening_pose(Polygons.of_rings([line])) is None
    assert opening_pose(Polygons.of_rings([])) is None


@given(st.floats(-3.0, 3.0), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_placement_turns_like_opendrive(heading, pitch, roll):
    place = Placement(np.array([1.0, 2.0, 3.0]), heading, np.zeros(3), "sign", pitch, roll)
    pose = placement_pose(place, np.ones(3))
    forward = apply(pose, (1, 0, 0)) - [1, 2, 3]
    expected = [np.cos(heading) * np.cos(pitch), np.sin(heading) * np.cos(pitch), np.sin(pitch)]
    np.testing.assert_allclose(forward, expected, atol=1e-5)


@pytest.mark.parametrize(
    ("wanted", "scale"),
    [
        ((6.0, 6.0, 20.0), (2.0, 2.0, 2.0)),
        ((0.0, 0.0, 5.0), (0.5, 0.5, 0.5)),
        ((6.0, 0.0, 0.0), (2.0, 2.0, 2.0)),
        ((6.0, 0.0, 10.0), (2.0, 2.0, 1.0)),
        ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    ],
)
def test_size_is_reached_and_gaps_follow_it(wanted, scale):
    place = Placement(np.zeros(3), 0.0, np.array(wanted), "tree")
    pose = placement_pose(place, np.array([3.0, 3.0, 10.0]))
    np.testing.assert_allclose(pose.scale, scale)


@given(st.floats(-180, 180), st.floats(-90, 90), st.floats(0.2, 3.0))
def test_box_of_a_pose_holds_the_turned_corners(z, y, scale):
    place = Placement(np.array([5.0, 0, 0]), np.radians(z), np.full(3, scale), "t", np.radians(y))
    pose = placement_pose(place, np.ones(3))
    extent = np.array([[-1.0, -2, 0], [1, 3, 4]])
    corners = np.stack(np.meshgrid(*extent.T, indexing="ij"), -1).reshape(-1, 3)
    turned = np.stack([apply(pose, corner) for corner in corners])
    np.testing.assert_allclose(
        pose.box(extent), [turned.min(axis=0), turned.max(axis=0)], atol=1e-4
    )


def test_a_tree_stands_where_and_as_big_as_the_city_says(stage, make):
    tree = next(o for o in make.city(Chunk(0, 0)).objects if o.id == "tree_0_chunk_0_0")
    box = world_box(stage.GetPrimAtPath("/World/chunk_0_0/Props/tree_0_chunk_0_0"))
    assert box[1, 2] == pytest.approx(tree.placement.size[2], rel=0.02)
    assert box[0, 2] == pytest.approx(tree.placement.position[2], abs=0.05)
    middle = box.mean(axis=0)[:2]
    np.testing.assert_allclose(middle, tree.placement.position[:2], atol=0.6)
    np.testing.assert_allclose(np.ptp(box, axis=0)[:2], tree.placement.size[:2], rtol=0.1)


def test_props_are_instances_with_explicit_variants_and_metadata(stage):
    light = stage.GetPrimAtPath("/World/chunk_0_0/Props/light_0_chunk_0_0")
    assert light.IsInstance()
    found = {name: light.GetVariantSet(name).GetVariantSelection() for name in ("design", "finish")}
    assert found["design"] == "virginia"
    assert found["finish"] in {"black", "green"}
    facts = {a.GetBaseName(): a.Get() for a in light.GetPropertiesInNamespace("userProperties")}
    assert facts == {
        "area_type": "residential",
        "asset": "street_light",
        "category": "street_light",
        "country": "1",
        "gml_id": "light_0_chunk_0_0",
        "segmentation_class": "pole",
    }


def test_all_windows_of_a_house_look_alike(stage):
    looks = {}
    for prim in stage.GetPrimAtPath("/World/chunk_0_0/Props").GetChildren():
        if prim.GetAttribute("userProperties:category").Get() == "window":
            house = prim.GetName().rsplit("_o", 1)[0]
            sets = prim.GetVariantSets()
            looks.setdefault(house, set()).add(
                tuple(sorted(sets.GetAllVariantSelections().items()))
            )
    assert len(looks) == 4
    assert all(len(found) == 1 for found in looks.values())


def test_windows_lie_before_their_wall(stage):
    for prim in stage.GetPrimAtPath("/World/chunk_0_0/Props").GetChildren():
        if prim.GetName().startswith("house_0"):
            box = world_box(prim)
            assert box[1, 1] == pytest.approx(112.0, abs=1e-4)
            assert 0.04 < 112.0 - box[0, 1] < 0.1


def test_prototypes_are_shared(stage):
    instances = [prim for prim in stage.Traverse() if prim.IsInstance()]
    assert len(stage.GetPrototypes()) < len(instances) / 3


def test_one_class_opinion_changes_all_trees(stage_file):
    stage = Usd.Stage.Open(str(stage_file))
    layer = Sdf.Layer.CreateAnonymous(".usda")
    template = add_prim(add_prim(layer, "__class__"), "tree_broadleaf")
    set_attribute(template, "visible_from_class", Sdf.ValueTypeNames.Bool, True)
    stage.GetSessionLayer().subLayerPaths.append(layer.identifier)
    trees = [
        prim for prim in stage.Traverse()
        if prim.GetAttribute("userProperties:asset").Get() == "tree_broadleaf"
    ]  # fmt: skip
    assert trees
    assert all(tree.GetAttribute("visible_from_class").Get() for tree in trees)


def write(scene, tmp_path, *objects, profile=None):
    path = tmp_path / "props.usdc"
    city, chunk = City(objects), Chunk(0, 0)
    write_props(city, chunk, profile or scene.profile, scene.catalogue, 0, path)
    return Sdf.Layer.OpenAsAnonymous(str(path))


def test_a_sign_has_the_shape_that_the_city_gives(scene, tmp_path, make):
    sign = make.standing(
        "s", "CityFurniture", "traffic_sign", (1, 2, 0), (0, 0, 2.8), shape="octagon"
    )
    layer = write(scene, tmp_path, sign)
    assert layer.GetPrimAtPath("/Props/s").variantSelections["shape"] == "octagon"


def test_what_the_library_does_not_have_is_left_out(scene, tmp_path, make):
    layer = write(scene, tmp_path, make.standing("u", "CityFurniture", "ufo", (1, 2, 0), (0, 0, 1)))
    assert not layer.GetPrimAtPath("/Props").nameChildren


def test_awkward_ids_become_valid_and_different_names(scene, tmp_path, make):
    ids = ["tree-1", "tree.1", "1tree", "tree_1"]
    trees = [
        make.standing(i, "SolitaryVegetationObject", "tree", (1, 2, 0), (0, 0, 8)) for i in ids
    ]
    layer = write(scene, tmp_path, *trees)
    assert len(layer.GetPrimAtPath("/Props").nameChildren) == 4


def test_choice_depends_on_nothing_but_seed_and_id(scene, tmp_path, make):
    trees = [
        make.standing(f"t{k}", "SolitaryVegetationObject", "tree", (k, 2, 0), (0, 0, 8))
        for k in range(30)
    ]
    every = write(scene, tmp_path, *trees)
    alone = write(scene, tmp_path, trees[17])
    both = [dict(f.GetPrimAtPath("/Props/t17").variantSelections) for f in (every, alone)]
    assert both[0] == both[1]


def test_unknown_asset_in_the_environment_is_named(scene, tmp_path):
    trees = replace(scene.profile.trees, assets={"oak": 1.0})
    message = (
        r"country_1/residential\.toml: trees\.assets: unknown asset 'oak'; known: .*tree_conifer"
    )
    with pytest.raises(EnvgenError, match=message):
        write(scene, tmp_path, profile=replace(scene.profile, trees=trees))


def test_props_of_a_part_with_placement_are_found(scene, tmp_path, make):
    inner = make.standing("inner", "CityFurniture", "street_light", (1, 2, 0), (0, 0, 5))
    group = CityObject("group", "CityObjectGroup", children=(inner,))
    assert write(scene, tmp_path, group).GetPrimAtPath("/Props/inner")


def test_windows_belong_to_their_building(stage):
    for prim in stage.GetPrimAtPath("/World/chunk_0_0/Props").GetChildren():
        path = prim.GetAttribute("userProperties:part_of").Get()
        if prim.GetName().startswith("house_2"):
            building = stage.GetPrimAtPath(Sdf.Path(path).MakeAbsolutePath(prim.GetPath()))
            assert building.GetName() == "house_2_chunk_0_0"
            assert Usd.ModelAPI(building).GetKind() == "component"
        elif not prim.GetName().startswith("house"):
            assert path is None


def test_a_garage_gets_a_gate_and_the_front_door_a_door(scene, tmp_path):
    def door(name, x, width):
        ring = np.array([[x, 0, 0], [x + width, 0, 0], [x + width, 0, 2.2], [x, 0, 2.2]])
        return ThematicSurface(name, "DoorSurface", Polygons.of_rings([ring]), 3)

    doors = (door("front", 1.0, 1.0), door("garage", 4.0, 2.6))
    wall = ThematicSurface("w", "WallSurface", Polygons.of_rings([]), 3, openings=doors)
    layer = write(scene, tmp_path, CityObject("b", "Building", surfaces=(wall,)))
    used = {
        name: layer.GetPrimAtPath(f"/Props/{name}").referenceList.prependedItems[0].assetPath
        for name in ("front", "garage")
    }
    assert used["front"].endswith("door_house.usda")
    assert used["garage"].endswith("door_garage.usda")


def test_metadata_alone_keeps_poses_and_choices_and_draws_nothing(scene, tmp_path, make):
    tree = make.standing("t", "SolitaryVegetationObject", "tree", (10, 20, 1), (0, 0, 9))
    found = []
    for only in (False, True):
        path = tmp_path / f"{only}.usdc"
        write_props(
            City((tree,)), Chunk(0, 0), scene.profile, scene.catalogue, 0, path, metadata_only=only
        )
        found.append(Usd.Stage.Open(str(path)))
    full, bare = (stage.GetPrimAtPath("/Props/t") for stage in found)
    assert full.HasAuthoredReferences()
    assert not bare.HasAuthoredReferences()
    assert not [prim for prim in found[1].Traverse() if prim.IsA(UsdGeom.Gprim)]
    assert (
        UsdGeom.Xformable(bare).GetLocalTransformation()
        == UsdGeom.Xformable(full).GetLocalTransformation()
    )
    names = ("asset", "category", "country", "segmentation_class")
    for name in names:
        key = f"userProperties:{name}"
        assert bare.GetAttribute(key).Get() == full.GetAttribute(key).Get()
    layers = [stage.GetRootLayer().GetPrimAtPath("/Props/t") for stage in found]
    assert dict(layers[0].variantSelections) == dict(layers[1].variantSelections)

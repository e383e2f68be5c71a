"""The props layer: poses, choices, references, metadata."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.prim_authoring import add_prim, set_attribute
from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.layers.prop_poses import opening_poses, placement_pose
from envgen_usd.layers.props_layer import write_props
from envgen_usd.models.city_model import City, CityObject, Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.render.stage.stage_season import set_season, stage_season

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
    pose = opening_poses([Polygons.of_rings([np.roll(ring, first, axis=0)])])[0]
    outward = np.cross(along, [0.0, 0.0, 1.0])
    right, left = ring[1], ring[0]
    np.testing.assert_allclose(apply(pose, (0, 0, 0)), right, atol=1e-5)
    np.testing.assert_allclose(apply(pose, (1, 0, 1)), left + up, atol=1e-5)
    np.testing.assert_allclose(apply(pose, (0, 1, 0)) - apply(pose, (0, 0, 0)), outward, atol=1e-5)


@given(st.floats(-np.pi, np.pi), st.floats(0.2, 1.3), st.integers(0, 3))
def test_a_roof_window_lies_in_its_slope(heading, slope, first):
    """The unit box's corners land on the opening's, its y axis is the normal of the roof."""
    along = np.array([np.cos(heading), np.sin(heading), 0.0])
    level = np.cross([0.0, 0.0, 1.0], along)
    up = 1.2 * (np.cos(slope) * level + np.array([0.0, 0.0, np.sin(slope)]))
    low = np.array([3.0, 2.0, 9.0])
    ring = np.stack([low, low + 0.8 * along, low + 0.8 * along + up, low + up])
    pose = opening_poses([Polygons.of_rings([np.roll(ring, first, axis=0)])])[0]
    normal = np.cross(along, up / 1.2)
    np.testing.assert_allclose(apply(pose, (0, 0, 0)), ring[1], atol=1e-6)
    np.testing.assert_allclose(apply(pose, (1, 0, 0)), ring[0], atol=1e-6)
    np.testing.assert_allclose(apply(pose, (1, 0, 1)), ring[3], atol=1e-6)
    np.testing.assert_allclose(apply(pose, (0, 1, 0)) - ring[1], normal, atol=1e-6)


def test_openings_that_no_rectangle_can_fill_are_left_alone():
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    assert opening_poses([Polygons.of_rings([flat])])[0] is None
    assert opening_poses([Polygons.of_rings([line])])[0] is None
    assert opening_poses([Polygons.of_rings([])])[0] is None


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


def openings(stage, house):
    path = f"/World/chunk_0_0/Buildings/house_{house}_chunk_0_0/Props"
    return stage.GetPrimAtPath(path).GetChildren()


def test_all_windows_of_a_house_look_alike(stage):
    for house in range(4):
        windows = [
            prim for prim in openings(stage, house)
            if prim.GetAttribute("userProperties:category").Get() == "window"
        ]  # fmt: skip
        assert len(windows) == 5 * (2 + house % 3) - 1
        looks = [dict(prim.GetVariantSets().GetAllVariantSelections()) for prim in windows]
        rooms = [look.pop("interior") for look in looks]
        assert all(look == looks[0] for look in looks)
        assert set(rooms) <= {"dark", "lit", "draped", "dim", "cool"}, "each room is lit by itself"


def test_windows_lie_before_their_wall(stage):
    assert openings(stage, 0)
    for prim in openings(stage, 0):
        # Sills and hoods stand out farther than the frame.
        frame = next(
            each
            for each in Usd.PrimRange(prim, Usd.TraverseInstanceProxies())
            if each.GetName() == "Frame"
        )
        box = world_box(frame)
        assert box[1, 1] == pytest.approx(112.0, abs=1e-4)
        assert 0.025 < 112.0 - box[0, 1] < 0.1


def test_prototypes_are_shared(stage):
    instances = [prim for prim in stage.Traverse() if prim.IsInstance()]
    rooms, looks = set(), set()
    for prim in instances:
        look = dict(prim.GetVariantSets().GetAllVariantSelections())
        asset = prim.GetAttribute("userProperties:category").Get()
        rooms.add((asset, *sorted(look.items())))
        look.pop("interior", None)  # Each pane of a house has a room of its own behind it.
        looks.add((asset, *sorted(look.items())))
    assert len(looks) < len(instances) / 3
    assert len(stage.GetPrototypes()) <= len(rooms), "equal looks are one prototype"


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


def leafy(stage):
    """Whether any tree of a stage shows leaves."""
    trees = [p for p in stage.Traverse() if p.GetName().startswith("tree_0_")]
    proxies = Usd.TraverseInstanceProxies()
    below = [p for tree in trees for p in Usd.PrimRange(tree, proxies) if p.IsA(UsdGeom.Mesh)]
    assert below
    looks = [UsdShade.MaterialBindingAPI(p).ComputeBoundMaterial()[0] for p in below]
    return "leaves" in {look.GetPrim().GetName() for look in looks if look}


def test_the_season_of_the_stage_changes_all_trees(stage_file):
    stage = Usd.Stage.Open(str(stage_file))
    assert (stage_season(stage), leafy(stage)) == ("summer", True)
    set_season(stage, "winter")
    assert (stage_season(stage), leafy(stage)) == ("winter", False)


def write(scene, tmp_path, *objects, profile=None, **more):
    path = tmp_path / "props.usdc"
    city, chunk = City(objects), Chunk(0, 0)
    write_props(city, chunk, profile or scene.profile, scene.catalogue, 0, path, **more)
    return Sdf.Layer.OpenAsAnonymous(str(path))


def test_a_sign_has_the_shape_that_the_city_gives(scene, tmp_path, make):
    sign = make.standing(
        "s", "CityFurniture", "traffic_sign", (1, 2, 0), (0, 0, 2.8), shape="octagon"
    )
    layer = write(scene, tmp_path, sign)
    assert layer.GetPrimAtPath("/Props/s").variantSelections["shape"] == "octagon"


def test_no_sign_forbids_parking_where_vehicles_park(scene, tmp_path, make):
    signs = [
        make.standing(f"s{k}", "CityFurniture", "street_sign", (k, 2, 0), (0, 0, 0))
        for k in range(80)
    ]
    parked = frozenset(f"s{k}" for k in range(40))
    every, some = write(scene, tmp_path, *signs), tmp_path / "some"
    some.mkdir()
    kept = write(scene, some, *signs, beside_parked=parked)

    def face(layer, number):
        return layer.GetPrimAtPath(f"/Props/s{number}").variantSelections["face"]

    bans = {"no_parking", "no_stopping"}
    assert {face(every, k) for k in range(40)} & bans == bans
    assert not {face(kept, k) for k in range(40)} & bans
    assert {face(kept, k) for k in range(40)} >= {"parking", "footway"}
    assert [face(kept, k) for k in range(40, 80)] == [face(every, k) for k in range(40, 80)]


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


def test_furniture_of_a_building_lies_below_it(scene, tmp_path, make):
    bench = make.standing("seat", "BuildingFurniture", "bench", (12, 22, 3), (0, 0, 0.8))
    ring = np.array([[10.0, 20, 3], [14, 20, 3], [14, 24, 3], [10, 24, 3]])
    floor = ThematicSurface("f", "GroundSurface", Polygons.of_rings([ring]), 2)
    house = CityObject("b", "Building", surfaces=(floor,), children=(bench,))
    layer = write(scene, tmp_path, house)
    seat = layer.GetPrimAtPath("/Buildings/b/Props/seat")
    assert tuple(seat.attributes["xformOp:translate"].default) == (0.0, 0.0, 0.0)
    assert layer.GetPrimAtPath("/Buildings/b").specifier == Sdf.SpecifierOver
    assert not layer.GetPrimAtPath("/Props").nameChildren


def test_furniture_of_a_building_without_geometry_stays_on_the_stage(scene, tmp_path, make):
    bench = make.standing("seat", "BuildingFurniture", "bench", (12, 22, 3), (0, 0, 0.8))
    layer = write(scene, tmp_path, CityObject("b", "Building", children=(bench,)))
    assert layer.GetPrimAtPath("/Props/seat")
    assert not layer.GetPrimAtPath("/Buildings")


def test_a_garage_gets_a_gate_and_the_front_door_a_door(scene, tmp_path):
    def door(name, x, width):
        ring = np.array([[x, 0, 0], [x + width, 0, 0], [x + width, 0, 2.2], [x, 0, 2.2]])
        return ThematicSurface(name, "DoorSurface", Polygons.of_rings([ring]), 3)

    doors = (door("front", 1.0, 1.0), door("garage", 4.0, 2.6))
    wall = ThematicSurface("w", "WallSurface", Polygons.of_rings([]), 3, openings=doors)
    layer = write(scene, tmp_path, CityObject("b", "Building", surfaces=(wall,)))
    used = {
        name: layer.GetPrimAtPath(f"/Buildings/b/Props/{name}")
        .referenceList.prependedItems[0]
        .assetPath
        for name in ("front", "garage")
    }
    assert used["front"].endswith("door_house.usda")
    assert used["garage"].endswith("door_garage.usda")


@pytest.fixture
def full_and_bare(scene, tmp_path, make):
    """A tree and a window, with geometry and as metadata alone."""
    tree = make.standing("t", "SolitaryVegetationObject", "tree", (10, 20, 1), (0, 0, 9))
    house = next(o for o in make.city(Chunk(0, 0)).objects if o.kind == "Building")
    stages = []
    for only in (False, True):
        # The depth of a chunk's folder: relative references find the library's copy.
        path, city = tmp_path / "chunks" / str(only) / "props.usdc", City((tree, house))
        library, profile = read_catalogue(embed=False), scene.profile
        write_props(city, Chunk(0, 0), profile, library, 0, path, metadata_only=only)
        stage = Usd.Stage.Open(str(path))
        for prim in stage.TraverseAll():
            prim.SetSpecifier(Sdf.SpecifierDef)
        stages.append(stage)
    return stages


PROPS = ("/Props/t", "/Buildings/house_0_chunk_0_0/Props/house_0_chunk_0_0_o1")


@pytest.mark.parametrize("path", PROPS)
def test_metadata_alone_keeps_poses_and_choices_and_draws_nothing(full_and_bare, path):
    full, bare = (stage.GetPrimAtPath(path) for stage in full_and_bare)
    assert full.HasAuthoredReferences()
    assert not bare.HasAuthoredReferences()
    assert not [prim for prim in full_and_bare[1].Traverse() if prim.IsA(UsdGeom.Gprim)]
    assert (
        UsdGeom.Xformable(bare).GetLocalTransformation()
        == UsdGeom.Xformable(full).GetLocalTransformation()
    )
    for name in ("area_type", "asset", "category", "country", "gml_id", "segmentation_class"):
        key = f"userProperties:{name}"
        assert bare.GetAttribute(key).Get() == full.GetAttribute(key).Get()
    layers = [stage.GetRootLayer().GetPrimAtPath(path) for stage in full_and_bare]
    assert dict(layers[0].variantSelections) == dict(layers[1].variantSelections)


@pytest.mark.parametrize("path", PROPS)
def test_metadata_alone_has_the_labels_kind_extent_and_path_of_the_asset(
    full_and_bare, path, scene
):
    full, bare = (stage.GetPrimAtPath(path) for stage in full_and_bare)
    for taxonomy in ("class", "cityscapes"):
        name = f"semantics:labels:{taxonomy}"
        assert bare.HasAPI("SemanticsLabelsAPI", taxonomy)
        assert list(bare.GetAttribute(name).Get()) == list(full.GetAttribute(name).Get())
    assert Usd.ModelAPI(bare).GetKind() == Usd.ModelAPI(full).GetKind() != ""
    assert bare.GetAttribute("extentsHint").Get() == full.GetAttribute("extentsHint").Get()
    box = Gf.BBox3d(Gf.Range3d(*map(Gf.Vec3d, bare.GetAttribute("extentsHint").Get())))
    box.Transform(UsdGeom.XformCache().GetLocalToWorldTransform(bare))
    limits = box.ComputeAlignedRange()
    np.testing.assert_allclose([limits.GetMin(), limits.GetMax()], world_box(full), atol=0.15)
    file = bare.GetAttribute("userProperties:asset_path").Get()
    assert Usd.ModelAPI(bare).GetAssetIdentifier().path == file
    assert Usd.ModelAPI(bare).GetAssetName() == Usd.ModelAPI(full).GetAssetName()
    used = full.GetPrimStack()[1].layer.realPath
    assert (scene.catalogue.folder / file).samefile(used)

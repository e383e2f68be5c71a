"""People and two-wheelers of the shipped library: sizes, ground, gait, closed surfaces, labels."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.people.body_sizes import man
from envgen_usd.assets.people.figure_models import stride
from envgen_usd.assets.people.gait_angles import walking
from envgen_usd.assets.people.pose_skeleton import bent_limb, posed

LIBRARY = read_catalogue()
PEOPLE = [asset.name for asset in LIBRARY.of_kind("pedestrian")]
WALKERS = [name for name in PEOPLE if "walk_0" in LIBRARY.assets[name].variants["pose"]]
ADULTS = [name for name in WALKERS if name not in {"pedestrian_child", "pedestrian_old_man"}]
# A body alone, whose walk has to mirror: what is carried hangs on one side.
UNLADEN = ["pedestrian_man_jacket", "pedestrian_woman_coat", "pedestrian_woman_dress"]
TWO_WHEELERS = ["bicycle", "cyclist", "cyclist_sport", "motorcycle", "motorcyclist"]


def payload(name: str, variant: str) -> dict[str, UsdGeom.Mesh]:
    stage = Usd.Stage.Open(str(LIBRARY.folder / LIBRARY.assets[name].path))
    stage.SetEditTarget(stage.GetSessionLayer())
    for of in LIBRARY.assets[name].variants.keys() & {"pose", "design"}:
        stage.GetDefaultPrim().GetVariantSet(of).SetVariantSelection(variant)
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    KEPT.append(stage)
    return {mesh.GetPrim().GetName(): mesh for mesh in meshes}


KEPT: list[Usd.Stage] = []
"""Stages whose prims are in use."""


def points(mesh: UsdGeom.Mesh) -> np.ndarray:
    return np.asarray(mesh.GetPointsAttr().Get(), float)


def near_points(meshes: dict[str, UsdGeom.Mesh]) -> np.ndarray:
    return np.concatenate([points(mesh) for name, mesh in meshes.items() if name != "Far"])


def edges(mesh: UsdGeom.Mesh) -> Counter[tuple[int, int]]:
    """Directed edges of all faces."""
    ends = np.cumsum(mesh.GetFaceVertexCountsAttr().Get())[:-1]
    found: Counter[tuple[int, int]] = Counter()
    for face in np.split(np.asarray(mesh.GetFaceVertexIndicesAttr().Get()), ends):
        found.update(zip(face.tolist(), np.roll(face, -1).tolist(), strict=True))
    return found


def volume(mesh: UsdGeom.Mesh) -> float:
    """By the divergence theorem; positive if the faces look outwards."""
    place = points(mesh)
    ends = np.cumsum(mesh.GetFaceVertexCountsAttr().Get())[:-1]
    total = 0.0
    for face in np.split(np.asarray(mesh.GetFaceVertexIndicesAttr().Get()), ends):
        first, *rest = place[face]
        total += sum(np.linalg.det([first, a, b]) for a, b in pairwise(rest))
    return total / 6.0


def test_there_are_the_people_that_a_street_needs():
    assert len(PEOPLE) == 12
    for name in PEOPLE:
        assert len(LIBRARY.assets[name].variants["clothes"]) >= 8
    assert len(WALKERS) == 11
    for name in WALKERS:
        assert {f"walk_{k}" for k in range(8)} < set(LIBRARY.assets[name].variants["pose"])


@pytest.mark.parametrize("name", ADULTS)
def test_adults_are_as_tall_as_adults(name):
    """1.60 to 1.85 m; shoes and hair add, an unstretched stand takes a little."""
    height = LIBRARY.assets[name].size({"pose": "standing"})[2]
    assert 1.59 <= height <= 1.88


def test_the_child_is_smaller_and_the_old_stoop():
    assert 1.15 <= LIBRARY.assets["pedestrian_child"].size({"pose": "standing"})[2] <= 1.35
    old = near_points(payload("pedestrian_old_man", "standing"))
    upright = near_points(payload("pedestrian_man_jacket", "standing"))
    heads = [cloud[cloud[:, 2] > cloud[:, 2].max() - 0.2] for cloud in (old, upright)]
    assert heads[0][:, 0].mean() > heads[1][:, 0].mean() + 0.05


@pytest.mark.parametrize("name", [*PEOPLE, *TWO_WHEELERS])
def test_the_lowest_point_is_on_the_ground(name):
    asset = LIBRARY.assets[name]
    for variant in asset.variants.get("pose", ()) or asset.variants["design"]:
        assert near_points(payload(name, variant))[:, 2].min() == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("pose", ["standing", "waiting"])
@pytest.mark.parametrize("name", ADULTS)
def test_who_stands_has_both_soles_on_the_ground(name, pose):
    shoes = points(payload(name, pose)["Shoes"])
    for side in (shoes[:, 1] > 0.0, shoes[:, 1] < 0.0):
        assert shoes[side, 2].min() == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("name", UNLADEN)
@pytest.mark.parametrize("part", ["Shoes", "Legs", "Shins", "Top"])
def test_half_a_cycle_later_left_and_right_have_changed_places(name, part):
    for k in range(4):
        first, second = (payload(name, f"walk_{k + n}").get(part) for n in (0, 4))
        if first is None or second is None:
            continue
        mirrored = points(second) * [1.0, -1.0, 1.0]
        gaps = np.linalg.norm(points(first)[:, None] - mirrored[None], axis=2).min(axis=1)
        assert gaps.max() < 1e-3


def test_a_stride_is_as_long_as_measured_ones():
    """Adults take 1.3 to 1.5 m at 1.2 to 1.4 m/s (Winter 1991; Bohannon 1997)."""
    assert 1.25 < stride(man(1.75)) < 1.5
    assert stride(man(1.85)) / stride(man(1.60)) == pytest.approx(1.85 / 1.60)


def test_the_standing_foot_does_not_slide():
    """At the speed of the stride, the ankle stays within 2.5 cm while the sole lies flat."""
    build = man(1.79)
    shares = np.linspace(0.10, 0.40, 13)
    x = [posed(build, walking(s)).legs[1].points[2, 0] + stride(build) * s for s in shares]
    assert np.ptp(x) < 0.025


def test_the_stage_knows_the_stride():
    stage = Usd.Stage.Open(str(LIBRARY.folder / LIBRARY.assets["pedestrian_man_jacket"].path))
    stage.SetEditTarget(stage.GetSessionLayer())  # the file stays as it is for other tests
    prim = stage.GetDefaultPrim()
    prim.GetVariantSet("pose").SetVariantSelection("walk_3")
    assert prim.GetCustomData()["stride_length"] == pytest.approx(stride(man(1.79)), abs=1e-3)


@pytest.mark.parametrize("name", [*PEOPLE, *TWO_WHEELERS])
def test_surfaces_are_closed_and_look_outwards(name):
    asset = LIBRARY.assets[name]
    variant = asset.defaults.get("pose", asset.defaults.get("design", ""))
    for part, mesh in payload(name, variant).items():
        found = edges(mesh)
        assert all(found[b, a] == count == 1 for (a, b), count in found.items()), part
        assert volume(mesh) > 0.0, part


@pytest.mark.parametrize("name", ["cyclist", "cyclist_sport", "motorcyclist"])
def test_riders_are_labelled_as_such_and_touch_what_they_ride_on(name):
    asset = LIBRARY.assets[name]
    variant = asset.defaults.get("pose", asset.defaults.get("design", ""))
    meshes = payload(name, variant)
    for part, mesh in meshes.items():
        label = mesh.GetPrim().GetAttribute("semantics:labels:class").Get()
        rider = part in {"Head", "Hair", "Eyes", "Top", "Sleeves", "Hands", "Legs", "Shoes",
                         "Shins", "Collar"}  # fmt: skip
        assert (list(label) if label else []) == (["rider"] if rider else []), part
    bar, hands = points(meshes["Handlebar"]), points(meshes["Hands"])
    gaps = np.linalg.norm(bar[:, None] - hands[None], axis=2).min()
    assert gaps < 0.03


@pytest.mark.parametrize(
    ("name", "variant"), [("cyclist_sport", "pedal_1"), ("motorcyclist", "scooter")]
)
def test_wheels_are_parts_around_the_axles_that_the_asset_states(name, variant):
    """A rim turned about its axle, by what is between two spokes, is the same rim."""
    meshes = payload(name, variant)
    stated = meshes["RimFront"].GetPrim().GetStage().GetDefaultPrim().GetCustomData()
    for end, centre in zip(("Front", "Rear"), stated["wheel_centres"], strict=True):
        tyre = points(meshes[f"Tyre{end}"]) - np.array(centre)
        reach = np.hypot(tyre[:, 0], tyre[:, 2])
        assert reach.max() == pytest.approx(centre[2], abs=2e-3)
        assert centre[2] == pytest.approx(stated["wheel_radius"], abs=6e-3)
        np.testing.assert_allclose((tyre.min(axis=0) + tyre.max(axis=0)) / 2, 0.0, atol=3e-3)


def test_a_pose_of_a_body_is_a_prim_of_the_file_of_all_poses():
    """Their faces are stored once: a file of all is smaller than the points and normals apart."""
    home = (LIBRARY.folder / LIBRARY.assets["pedestrian_child"].path).parent.parent / "payload"
    (file,) = home.iterdir()
    poses = LIBRARY.assets["pedestrian_child"].variants["pose"]
    stage = Usd.Stage.Open(str(file))
    assert {prim.GetName() for prim in stage.GetDefaultPrim().GetChildren()} == set(poses)
    arrays = [
        len(attribute.Get()) * 12
        for pose in poses
        for mesh in payload("pedestrian_child", pose).values()
        for attribute in (mesh.GetPointsAttr(), mesh.GetNormalsAttr())
    ]
    assert file.stat().st_size < 1.05 * sum(arrays)


def test_a_bent_limb_has_its_lengths_and_its_knee_in_front():
    root, end = np.array([0.0, 0.1, 0.9]), np.array([0.2, 0.1, 0.1])
    limb = bent_limb(root, end, (0.45, 0.43), np.array([1.0, 0.0, 0.0]), forward=True)
    lengths = np.linalg.norm(np.diff(limb.points, axis=0), axis=1)
    np.testing.assert_allclose(lengths, [0.45, 0.43])
    np.testing.assert_allclose(limb.points[2], end)
    line = (end - root) / np.linalg.norm(end - root)
    aside = limb.points[1] - root - line * ((limb.points[1] - root) @ line)
    assert aside[0] > 0.0
    for axes in (limb.upper, limb.lower):
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1.0)

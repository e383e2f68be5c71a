"""Distant objects are drawn by the simpler meshes that `proxyPrim` names."""

from dataclasses import replace

import numpy as np
import pytest
from pxr import UsdGeom

from envgen_usd.render.stage.stage_reader import read_scene


def _tree(write, depth, *, related=True):
    """A full square, and a narrower one that replaces it at a distance."""
    tree = UsdGeom.Xform.Define(write.stage, "/World/tree").GetPrim()
    write.kind(tree, "component")
    write.label(tree, "vegetation")
    full = write.square("/World/tree/full", depth, (-0.05 * depth, -1), (0.05 * depth, 1))
    far = write.square("/World/tree/far", depth, (-0.02 * depth, -1), (0.02 * depth, 1))
    full.CreatePurposeAttr("render")
    far.CreatePurposeAttr("proxy")
    if related:
        UsdGeom.Imageable(full).CreateProxyPrimRel().SetTargets([far.GetPath()])
    return full, far


def _shown_width(frame, scene_objects):
    """Columns that show the tree, of the middle row."""
    labels = np.array([each.label for each in scene_objects])[frame.scene_objects]
    return int((labels == "vegetation")[50].sum())


def test_proxy_replaces_the_full_mesh_only_where_it_looks_small(author, shoot, small_camera, ahead):
    """The width is 10 % of the distance near by, 10 pixels, and 4 % far away."""
    for depth, pixels in ((1.0, 10), (200.0, 4)):
        write = author()
        _tree(write, depth)
        assert _shown_width(*shoot(write.stage, small_camera, ahead)) == pixels


def test_long_lenses_see_the_full_mesh_farther_away(author, shoot, small_camera, ahead):
    write = author()
    _tree(write, 40.0)
    wide = _shown_width(*shoot(write.stage, small_camera, ahead))
    long = replace(small_camera, fx=1500.0, fy=1500.0)
    assert wide == 4
    assert _shown_width(*shoot(write.stage, long, ahead)) == 150


def test_a_mesh_without_a_drawable_proxy_is_drawn_everywhere(author, shoot, small_camera, ahead):
    write = author()
    _, far = _tree(write, 200.0)
    far.GetPrim().SetActive(False)
    assert _shown_width(*shoot(write.stage, small_camera, ahead)) == 20 // 2
    write = author()
    _tree(write, 200.0, related=False)
    assert _shown_width(*shoot(write.stage, small_camera, ahead)) == 20 // 2


def test_both_levels_have_the_labels_of_one_object(author):
    write = author()
    _tree(write, 5.0)
    scene = read_scene(write.stage)
    assert {use.level.far for use in scene.uses} == {False, True}
    owners = {scene.scene_objects[n].path for use in scene.uses for n in use.scene_objects.tolist()}
    assert owners == {"/World/tree"}


@pytest.mark.parametrize("season", [False, True])
def test_a_proxy_without_its_full_mesh_is_not_drawn(author, shoot, small_camera, ahead, season):
    write = author()
    full, _ = _tree(write, 200.0)
    write.square("/World/wall", 400.0, (-900, -900), (900, 900), label="building")
    full.GetPrim().SetActive(False) if season else full.GetPointsAttr().Set([])
    assert _shown_width(*shoot(write.stage, small_camera, ahead)) == 0

"""A tree and its far level look alike from where the exporter changes between them."""

from dataclasses import replace

import numpy as np
import pytest
from pxr import UsdGeom, UsdLux
from scipy.ndimage import binary_dilation

from envgen_usd.assets.asset_catalogue import read_catalogue

LIBRARY = read_catalogue()
AWAY = 60.0
"""Distance in metres at which KITTI-360's camera changes the level of a tree of 10 m."""


def _shown(write, shoot, camera, pose, chosen, *, far):
    """Mask of the tree, and the light of the sky that it hides at each pixel."""
    name, shape, season = chosen
    prim = write.stage.DefinePrim("/World/tree", "Xform")
    prim.GetReferences().AddReference(str(LIBRARY.folder / LIBRARY.assets[name].path))
    for variant_set, variant in (("shape", shape), ("season", season)):
        if variant:
            prim.GetVariantSets().SetSelection(variant_set, variant)
    UsdGeom.Xformable(prim).AddTranslateOp().Set((0.0, AWAY, -5.0))
    for part in ("Wood", "Leaves"):
        full, proxy = (
            write.stage.GetPrimAtPath(f"/World/tree/Geometry/{part}{end}") for end in ("", "Proxy")
        )
        (full if far else proxy).SetActive(False)
        UsdGeom.Imageable(proxy if far else full).GetPurposeAttr().Set("default")
    UsdLux.DomeLight.Define(write.stage, "/World/Sky").CreateIntensityAttr(1.0)
    frame, scene_objects = shoot(write.stage, camera, pose)
    labels = np.array([each.label for each in scene_objects])[frame.scene_objects]
    light = frame.radiance.mean(axis=2)
    return labels == "vegetation", light[:, :5].mean() - light


@pytest.mark.parametrize(
    "chosen",
    [
        ("tree_broadleaf", "lime", "summer"),
        ("tree_broadleaf", "oak", "winter"),
        ("tree_broadleaf", "birch", "winter"),
        ("tree_conifer", "spruce", ""),
    ],
)
def test_far_level_covers_and_hides_as_much(author, shoot, small_camera, ahead, chosen):
    camera = replace(small_camera, fx=552.0, fy=552.0)
    near, far = (
        _shown(author(), shoot, camera, ahead, chosen, far=level) for level in (False, True)
    )
    assert near[0].sum() > 1000
    assert far[0].sum() == pytest.approx(near[0].sum(), rel=0.12)
    # Twigs that are seen one by one lie elsewhere; the crowns that they fill do not.
    around = [binary_dilation(level[0], iterations=2) for level in (near, far)]
    assert (around[0] & around[1]).sum() > 0.7 * (around[0] | around[1]).sum()
    assert far[1].sum() == pytest.approx(near[1].sum(), rel=0.15)

"""Shipped assets collide by boxes that fit them."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdPhysics

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.environment_files import read_profile

LIBRARY = read_catalogue()
FURNITURE = read_profile("1", "residential").furniture
FREE = {"tree", "traffic_sign", "silo", "container", "pallets", *vars(FURNITURE)} - {"gully"}
"""Kinds that stand by themselves."""
GEOMETRIES = [
    (asset.name, name, variant)
    for asset in LIBRARY.assets.values()
    if not asset.name.startswith("traffic_sign_")
    for name, variants in (asset.variants or {"": ("",)}).items()
    for variant in variants
]


def boxes(stage, kind):
    """Boxes (2 x 3) of the prims of a type, from their own geometry."""
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default", "render", "guide"])
    for prim in stage.Traverse():
        if prim.IsA(kind) and UsdGeom.Imageable(prim).ComputePurpose() != "proxy":
            box = cache.ComputeWorldBound(prim).ComputeAlignedRange()
            yield prim, np.array([box.GetMin(), box.GetMax()])


def opened(asset, name, variant):
    stage = Usd.Stage.Open(str(LIBRARY.folder / asset.path))
    stage.SetEditTarget(stage.GetSessionLayer())
    if name:
        stage.GetDefaultPrim().GetVariantSet(name).SetVariantSelection(variant)
    return stage


@pytest.mark.parametrize(("asset", "name", "variant"), GEOMETRIES)
def test_a_collider_stands_on_the_ground_within_the_asset(asset, name, variant):
    asset = LIBRARY.assets[asset]
    stage = opened(asset, name, variant)
    found = list(boxes(stage, UsdGeom.Cube))
    if not found:
        # Twigs, and what hangs on a wall or lies in the ground.
        assert asset.kind == "bush" or asset.kind not in FREE
        return
    ((prim, box),) = found
    assert prim.HasAPI(UsdPhysics.CollisionAPI)
    assert UsdGeom.Imageable(prim).ComputePurpose() == "guide"
    drawn = np.array([other for _, other in boxes(stage, UsdGeom.Mesh)])
    low, high = drawn[:, 0].min(axis=0), drawn[:, 1].max(axis=0)
    assert (box[0] > low - 1e-3).all()
    assert (box[1] < high + 1e-3).all()
    assert abs(box[0, 2]) < 0.05
    if asset.kind == "tree":
        assert np.ptp(box, axis=0)[:2].max() < 0.3 * np.ptp([low, high], axis=0)[:2].max()
    elif asset.kind in {"bin", "bench", "control_box"}:
        np.testing.assert_allclose(box, [low, high], atol=1e-3)
    elif asset.kind in {"street_light", "traffic_light"}:
        # Nobody runs into the arm above the road.
        assert np.ptp(box, axis=0)[:2].max() < 0.6
        assert box[1, 2] == pytest.approx(high[2], abs=1e-3)

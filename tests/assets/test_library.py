"""The library that comes with the package."""

import filecmp
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Usd, UsdGeom, UsdShade, UsdValidation

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.library_author import author_library
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.label_taxonomy import labels

LIBRARY = read_catalogue()
NEEDED = {
    *("asphalt", "asphalt_worn", "paving", "curb_stone", "marking_white", "marking_yellow"),
    *("grass", "grass_verge", "lawn", "rubble", "gravel", "forest_floor", "brick_red"),
    *("flagstone", "sheet_metal", "sheet_metal_roof", "roof_tiles_red", "roof_slate"),
    *("roof_shingles", "bitumen", "concrete", "plaster", "glass", "wood", "metal_dark"),
}


def findings(path: Path) -> list[str]:
    stage = Usd.Stage.Open(str(path))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    return [error.GetErrorAsString() for error in errors]


def selections(asset):
    """Every variant of every set, the other sets at their default."""
    yield {}
    for name, variants in asset.variants.items():
        for variant in variants:
            yield {name: variant}


def open_with(asset, chosen):
    stage = Usd.Stage.Open(str(LIBRARY.folder / asset.path))
    prim = stage.GetDefaultPrim()
    stage.SetEditTarget(stage.GetSessionLayer())
    for name, variant in chosen.items():
        prim.GetVariantSet(name).SetVariantSelection(variant)
    return stage


def meshes(stage, purposes=("default", "render")):
    found = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    return [mesh for mesh in found if mesh.ComputePurpose() in purposes]


def test_holds_every_material_of_the_environments():
    assert set(LIBRARY.materials) >= NEEDED
    for country, areas in known_environments().items():
        for area in areas:
            profile = read_profile(country, area)
            rules = profile.buildings
            names = {
                *profile.ground_materials.values(),
                *rules.materials,
                *rules.roof_materials,
                *rules.flat_roof_materials,
                *profile.road.materials,
                *profile.road.sidewalk_materials,
                *profile.road.kerb_materials,
            }
            assert names <= set(LIBRARY.materials)


def test_is_small():
    size = sum(path.stat().st_size for path in LIBRARY.folder.rglob("*") if path.is_file())
    assert size < 60e6


@pytest.mark.parametrize("name", LIBRARY.materials)
def test_material_is_valid_and_its_textures_exist(name):
    path = LIBRARY.folder / LIBRARY.materials[name].path
    assert findings(path) == []
    stage = Usd.Stage.Open(str(path))
    surface, _, _ = UsdShade.Material(stage.GetDefaultPrim()).ComputeSurfaceSource()
    assert surface.GetShaderId() == "UsdPreviewSurface"
    for prim in stage.Traverse():
        file = prim.GetAttribute("inputs:file").Get()
        if file is not None:
            assert Path(file.resolvedPath).is_file()
            assert prim.GetAttribute("inputs:wrapS").Get() == "repeat"
            assert 200.0 % LIBRARY.materials[name].size == 0.0


@pytest.mark.parametrize("name", LIBRARY.assets)
def test_asset_is_valid_in_every_variant(name):
    asset = LIBRARY.assets[name]
    assert findings(LIBRARY.folder / asset.path) == []
    for chosen in selections(asset):
        stage = open_with(asset, chosen)
        assert meshes(stage)
        for mesh in meshes(stage):
            material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
            assert material, f"{chosen}: {mesh.GetPath()} has no material"


@pytest.mark.parametrize("name", LIBRARY.assets)
def test_asset_says_how_big_it_is(name):
    asset = LIBRARY.assets[name]
    for chosen in selections(asset):
        if chosen.get("season") == "winter":
            continue
        stage = open_with(asset, chosen)
        points = np.concatenate([np.asarray(mesh.GetPointsAttr().Get()) for mesh in meshes(stage)])
        box = np.stack([points.min(axis=0), points.max(axis=0)])
        hint = asset.extent(chosen)
        assert (hint[0] <= box[0] + 1e-4).all()
        assert (hint[1] >= box[1] - 1e-4).all()
        # Parts that this variant takes away may reach a little farther.
        np.testing.assert_allclose(hint, box, atol=0.2 if "season" in asset.variants else 1e-4)
        if asset.kind not in {"window", "door"}:
            assert box[0, 2] == pytest.approx(0.0, abs=0.02), "stands on the ground"
            assert asset.size(chosen)[2] == pytest.approx(box[1, 2], rel=0.01)
            assert asset.size(chosen)[:2] == pytest.approx(np.ptp(box, axis=0)[:2], rel=0.15)


@pytest.mark.parametrize("name", LIBRARY.assets)
def test_asset_speaks_the_closed_vocabulary(name):
    asset = LIBRARY.assets[name]
    table = {label.name: label.cityscapes for label in labels()}
    stage = open_with(asset, {})
    root = stage.GetDefaultPrim()
    assert list(root.GetAttribute("semantics:labels:class").Get()) == [asset.label]
    assert list(root.GetAttribute("semantics:labels:cityscapes").Get()) == [table[asset.label]]
    expected = {"tree": "vegetation", "street_light": "pole", "window": "building"}
    assert asset.label == expected.get(asset.kind, asset.label)
    for mesh in meshes(stage):
        assert len(mesh.GetPrim().GetAttribute("semantics:labels:part").Get()) == 1


@pytest.mark.parametrize("name", ["tree_broadleaf", "tree_conifer"])
def test_trees_have_a_sensible_number_of_triangles(name):
    for shape in ("round", "tall", "wide"):
        stage = open_with(LIBRARY.assets[name], {"shape": shape})
        counts = [np.asarray(m.GetFaceVertexCountsAttr().Get()) - 2 for m in meshes(stage)]
        assert 1200 <= np.concatenate(counts).sum() <= 4000
        proxies = meshes(stage, ("proxy",))
        counts = [np.asarray(m.GetFaceVertexCountsAttr().Get()) - 2 for m in proxies]
        assert 50 <= np.concatenate(counts).sum() <= 250


@pytest.mark.parametrize("name", ["tree_broadleaf", "tree_conifer"])
def test_far_trees_have_the_outline_of_near_ones(name):
    def box(stage, purpose):
        found = meshes(stage, (purpose,))
        points = np.concatenate([np.asarray(mesh.GetPointsAttr().Get()) for mesh in found])
        return np.stack([points.min(axis=0), points.max(axis=0)])

    for shape in ("round", "tall", "wide"):
        stage = open_with(LIBRARY.assets[name], {"shape": shape})
        np.testing.assert_allclose(box(stage, "proxy"), box(stage, "render"), atol=1.3)
        full, proxy = (
            stage.GetPrimAtPath(f"/{name}/Geometry/{p}") for p in ("Leaves", "LeavesProxy")
        )
        assert UsdGeom.Imageable(full).GetProxyPrimRel().GetTargets() == [proxy.GetPath()]


def test_seasons_change_the_leaves():
    def leaves(season):
        stage = open_with(LIBRARY.assets["tree_broadleaf"], {"season": season})
        prim = stage.GetPrimAtPath("/tree_broadleaf/Geometry/Leaves")
        if not prim.IsActive():
            return None
        return UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0].GetPrim().GetName()

    found = {season: leaves(season) for season in ("summer", "autumn", "winter")}
    assert found == {"summer": "leaves", "autumn": "leaves_autumn", "winter": None}


def test_lamp_arm_points_forward():
    low, high = LIBRARY.assets["street_light"].extent({"design": "new_york"})
    assert high[0] > 2.0
    assert low[0] > -0.5


def test_authoring_again_gives_what_is_shipped(tmp_path):
    author_library(tmp_path)
    made = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file())
    usd = [path for path in made if path.suffix in {".usda", ".usdc"}]
    _, different, missing = filecmp.cmpfiles(tmp_path, LIBRARY.folder, usd, shallow=False)
    assert not different
    assert not missing
    for path in made:
        if path.suffix in {".jpg", ".png"}:
            new, old = (np.asarray(Image.open(f / path), int) for f in (tmp_path, LIBRARY.folder))
            assert np.abs(new - old).mean() < 1.0, path

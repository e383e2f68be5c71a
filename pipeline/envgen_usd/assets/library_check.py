"""Checks an asset library, so that authors see errors before a build."""

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdShade, UsdValidation  # type: ignore[attr-defined]

from envgen_usd.assets.asset_catalogue import Asset, Catalogue, LibraryMaterial
from envgen_usd.assets.usd_values import from_vectors
from envgen_usd.errors import Issue, Severity
from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import FloatArray

PROTOTYPE_CAP = 64
"""Largest number of variant combinations without a warning; each combination is a prototype."""
GROUND_TOLERANCE = 0.05
"""Largest distance of an asset's lowest point from the ground, metres.

A larger value tolerates more.
"""
_HANGING = {"window", "door"}
_DRAWN = {UsdGeom.Tokens.default_, UsdGeom.Tokens.render}


def check_library(catalogue: Catalogue) -> tuple[Issue, ...]:
    """Checks every material and every variant of every asset.

    1. OpenUSD's validators report no error.
    2. An asset's class is in the label taxonomy.
    3. Every drawn mesh has a material.
    4. All textures exist.
    5. `extentsHint` contains the geometry, and standing objects touch the ground.
    6. The number of combinations of variants stays below `PROTOTYPE_CAP`.
    """
    issues: list[Issue] = []
    for material in catalogue.materials.values():
        issues += _check_material(catalogue.folder, material)
    for asset in catalogue.assets.values():
        issues += _check_asset(catalogue.folder, asset)
    return tuple(issues)


def _check_material(folder: Path, material: LibraryMaterial) -> Iterator[Issue]:
    stage = Usd.Stage.Open(str(folder / material.path))
    yield from _validate(stage, material.path)
    yield from _check_textures(stage, material.path)


def _check_asset(folder: Path, asset: Asset) -> Iterator[Issue]:
    if asset.label not in {entry.name for entry in labels()}:
        known = ", ".join(entry.name for entry in labels())
        text = f"class '{asset.label}' is not in the label taxonomy; known: {known}"
        yield Issue("library.label", Severity.ERROR, asset.path, text)
    combinations = int(np.prod([len(variants) for variants in asset.variants.values()]))
    if combinations > PROTOTYPE_CAP:
        text = (
            f"{combinations} combinations of variants; more than {PROTOTYPE_CAP} slow down stages"
        )
        yield Issue("library.prototypes", Severity.WARNING, asset.path, text)
    stage = Usd.Stage.Open(str(folder / asset.path))
    yield from _validate(stage, asset.path)
    stage.SetEditTarget(stage.GetSessionLayer())
    for chosen in _selections(asset):
        root = stage.GetDefaultPrim()
        for name, variant in chosen.items():
            root.GetVariantSet(name).SetVariantSelection(variant)
        where = f"{asset.path} {' '.join(f'{k}={v}' for k, v in chosen.items())}".strip()
        yield from _check_textures(stage, where)
        yield from _check_meshes(stage, asset, chosen, where)


def _selections(asset: Asset) -> Iterator[dict[str, str]]:
    """All combinations of variants, up to the cap."""
    names = list(asset.variants)
    for count, choice in enumerate(product(*asset.variants.values())):
        if count < PROTOTYPE_CAP:
            yield dict(zip(names, choice, strict=True))


def _validate(stage: Usd.Stage, where: str) -> Iterator[Issue]:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    for error in UsdValidation.ValidationContext(validators).Validate(stage):
        yield Issue("library.validator", Severity.ERROR, where, str(error.GetErrorAsString()))


def _check_textures(stage: Usd.Stage, where: str) -> Iterator[Issue]:
    for prim in stage.Traverse():
        file = prim.GetAttribute("inputs:file").Get()
        if file is not None and not file.resolvedPath:
            text = f"{prim.GetPath()}: texture {file.path} does not exist"
            yield Issue("library.texture", Severity.ERROR, where, text)


def _check_meshes(
    stage: Usd.Stage, asset: Asset, chosen: Mapping[str, str], where: str
) -> Iterator[Issue]:
    boxes = []
    cache = UsdGeom.XformCache()
    for prim in stage.Traverse():
        if not prim.IsA("Mesh") or UsdGeom.Imageable(prim).ComputePurpose() not in _DRAWN:
            continue
        boxes.append(_box(UsdGeom.Mesh(prim), cache))
        subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
        for part in [subset.GetPrim() for subset in subsets] or [prim]:
            if not UsdShade.MaterialBindingAPI(part).ComputeBoundMaterial()[0]:
                text = f"{part.GetPath()} has no material"
                yield Issue("library.material", Severity.ERROR, where, text)
    if not boxes:
        yield Issue("library.empty", Severity.WARNING, where, "has no drawn geometry")
        return
    low = np.min([box[0] for box in boxes], axis=0)
    high = np.max([box[1] for box in boxes], axis=0)
    hint = asset.extent(chosen)
    if (hint[0] > low + 1e-3).any() or (hint[1] < high - 1e-3).any():
        extent = [low.tolist(), high.tolist()]
        text = f"extentsHint {hint.tolist()} does not contain the geometry {extent}"
        yield Issue("library.extent", Severity.ERROR, where, text)
    if asset.kind not in _HANGING and abs(low[2]) > GROUND_TOLERANCE:
        text = f"the lowest point is {low[2]:.3f} m from the ground"
        yield Issue("library.ground", Severity.WARNING, where, text)


def _box(mesh: UsdGeom.Mesh, cache: UsdGeom.XformCache) -> FloatArray:
    """2 x 3 bounding box of a mesh in the asset's frame, metres."""
    points = from_vectors(mesh.GetPointsAttr().Get())
    matrix = from_vectors(cache.GetLocalToWorldTransform(mesh.GetPrim()))
    moved = points @ matrix[:3, :3] + matrix[3, :3]
    box: FloatArray = np.stack([moved.min(axis=0), moved.max(axis=0)])
    return box

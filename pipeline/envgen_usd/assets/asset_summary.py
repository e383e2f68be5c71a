"""What an asset holds: variants, sizes, triangles, materials, labels."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdSemantics, UsdShade  # type: ignore[attr-defined]

from envgen_usd.assets.asset_catalogue import Asset
from envgen_usd.assets.preview_stage import asset_variants


@dataclass(frozen=True)
class VariantSummary:
    """A variant, with the other sets at their default.

    Attributes:
        name: ``set=variant``, or empty for an asset without variant sets.
        size: Nominal extent along x, y, z, metres.
        near: Triangles that are drawn nearby.
        far: Triangles that are drawn at a distance.
        lamps: Number of lights.
        materials: Names of the materials that are drawn.
        parts: Tokens of the `part` taxonomy.
    """

    name: str
    size: tuple[float, float, float]
    near: int
    far: int
    lamps: int
    materials: tuple[str, ...]
    parts: tuple[str, ...]


def summarise(library: Path, asset: Asset) -> Iterator[VariantSummary]:
    """Yields the variants of an asset.

    Args:
        library: Folder of the library.
        asset: Asset.
    """
    stage = Usd.Stage.Open(str(library / asset.path))
    stage.SetEditTarget(stage.GetSessionLayer())
    for name, selections in asset_variants(asset):
        for variant_set, variant in selections.items():
            root = stage.GetDefaultPrim()
            root.GetVariantSet(variant_set).SetVariantSelection(variant)
        x, y, z = asset.size(selections).tolist()
        text = name.removeprefix(asset.name).strip()
        yield _summary(stage, text, (x, y, z))


def _summary(stage: Usd.Stage, name: str, size: tuple[float, float, float]) -> VariantSummary:
    near = far = lamps = 0
    materials: set[str] = set()
    labels: set[str] = set()
    query = UsdSemantics.LabelsQuery("part", Usd.TimeCode.Default())
    for prim in stage.Traverse():
        if not prim.IsA("Mesh"):
            lamps += prim.HasAPI("LightAPI")
            continue
        sizes = np.asarray(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get() or [0])
        triangles = int(np.maximum(sizes - 2, 0).sum())
        purpose = UsdGeom.Imageable(prim).ComputePurpose()
        near += triangles if purpose in {"default", "render"} else 0
        far += triangles if purpose in {"default", "proxy"} else 0
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        materials |= {material.GetPrim().GetName()} if material else set()
        labels |= set(map(str, query.ComputeUniqueInheritedLabels(prim)))
    return VariantSummary(
        name, size, near, far, lamps, tuple(sorted(materials)), tuple(sorted(labels))
    )

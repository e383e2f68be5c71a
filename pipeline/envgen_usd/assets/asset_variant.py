"""Makes a variant of an asset from an existing one, ready to be edited."""

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from envgen_usd.assets.asset_catalogue import Asset, Catalogue, read_catalogue, scan_library
from envgen_usd.assets.asset_design import AssetDesign
from envgen_usd.assets.asset_import import ImportOptions, import_model
from envgen_usd.assets.asset_layers import MATERIALS, payload_layer
from envgen_usd.assets.library_check import check_used
from envgen_usd.assets.library_drafts import library_draft
from envgen_usd.assets.prim_authoring import (
    SURFACES,
    add_prim,
    bind_material,
    prim_names,
    set_attribute,
    set_extents_hint,
    set_surface,
)
from envgen_usd.assets.usd_files import new_layer, read_layer, write_layer
from envgen_usd.assets.usd_values import to_float3
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.array_types import FloatArray

_GEOMETRY = "Geometry"


@dataclass(frozen=True)
class VariantOptions:
    """What differs from the existing variant.

    Attributes:
        variant_set: Variant set; empty: the set that has the existing variant.
        materials: Material of the library by name of a part, e.g. ``{"Body": "paint_red"}``.
        size: Extent along x, y, z in metres; `None` keeps it.
        geometry: File of another program that replaces the geometry, or `None`.
    """

    variant_set: str = ""
    materials: Mapping[str, str] = field(default_factory=dict)
    size: tuple[float, float, float] | None = None
    geometry: Path | None = None


@dataclass(frozen=True)
class NewVariant:
    """The result.

    Attributes:
        variant_set: Set of the variant.
        interface: Path of the asset's interface, relative to the library.
        payload: Path of the variant's own geometry; empty if it shares that of other variants.
        issues: Findings.
    """

    variant_set: str
    interface: str
    payload: str
    issues: tuple[Issue, ...]


def new_variant(
    library: Path, asset: str, variant: str, existing: str, options: VariantOptions
) -> NewVariant:
    """Adds a variant to an asset: a copy of an existing one, with other materials or sizes.

    1. The set is the one that holds the existing variant. An asset without variant sets gets the
       set of the options, whose variant `existing` is its present look.
    2. A variant with a payload gets a copy of it, which may be edited alone.
    3. Materials, size or geometry are changed.
    4. The asset is checked as `library_check.check_used` does, and that its parts have the
       materials that were asked for.

    Args:
        library: Folder of the library.
        asset: Name of the asset.
        variant: Name of the new variant.
        existing: Name of the variant that it begins as.
        options: What differs.

    Raises:
        EnvgenError: A name is unknown or taken, or the result is faulty; the library is unchanged
            then.
    """
    catalogue, _ = scan_library(library)
    known = _known(catalogue, asset)
    if variant != prim_names([variant])[variant]:
        raise EnvgenError(f"variant '{variant}': use letters, digits and underscores")
    name = _set_of(known, variant, existing, options)
    for material in options.materials.values():
        catalogue.material(material, f"{asset} {name}={variant}")
    folder = Path(known.path).parents[1]
    with library_draft(library, folder) as draft:
        layer = read_layer(draft / known.path)
        root = layer.GetPrimAtPath(f"/{asset}")
        if name not in known.variants:
            _divide(root, name, existing)
        paths = [root.path.AppendVariantSelection(name, each) for each in (existing, variant)]
        Sdf.CopySpec(layer, paths[0], layer, paths[1])
        made = layer.GetPrimAtPath(paths[1])
        payload = _own_payload(made, draft / folder, name, variant, known)
        if options.geometry:
            payload = _replace_geometry(made, known, draft, f"{asset}_{variant}", options.geometry)
        if options.size:
            _scale(made, known, {name: existing}, options.size)
        write_layer(layer, draft / known.path)
        proxies = _proxies(draft / known.path, {name: variant})
        for part, material in options.materials.items():
            for mesh in (part, *proxies.get(part, ())):
                _bind(made, root, mesh, material)
        write_layer(layer, draft / known.path)
        again = read_catalogue(draft)
        issues = check_used(again, [asset], options.materials.values())
        _refuse(issues, asset)
        _check_bindings(draft / known.path, again.assets[asset], {name: variant}, options.materials)
    relative = (folder / payload).as_posix() if payload else ""
    return NewVariant(name, known.path, relative, issues)


def _known(catalogue: Catalogue, asset: str) -> Asset:
    if asset not in catalogue.assets:
        raise EnvgenError(f"unknown asset '{asset}'; known: {', '.join(catalogue.assets)}")
    return catalogue.assets[asset]


def _set_of(asset: Asset, variant: str, existing: str, options: VariantOptions) -> str:
    """The set of the existing variant."""
    name = options.variant_set
    if not asset.variants:
        if not name or name != prim_names([name])[name]:
            raise EnvgenError(
                f"{asset.name} has no variant sets; name one with --set, e.g. --set design: its "
                f"variant '{existing}' becomes the present look"
            )
        if variant == existing:
            raise EnvgenError(f"{asset.name} {name}: both variants are named '{variant}'")
        return name
    found = [of for of, names in asset.variants.items() if existing in names and name in {"", of}]
    if len(found) != 1:
        sets = "; ".join(f"{of}: {', '.join(names)}" for of, names in asset.variants.items())
        what = (
            f"several sets have '{existing}'; choose one with --set"
            if found
            else (f"no variant '{existing}'{f' in the set {name}' if name else ''}")
        )
        raise EnvgenError(f"{asset.name}: {what}; known: {sets}")
    if variant in asset.variants[found[0]]:
        raise EnvgenError(f"{asset.name} {found[0]}: '{variant}' exists; choose another name")
    return found[0]


def _divide(root: Sdf.PrimSpec, name: str, variant: str) -> None:
    """Moves payload and size of an asset without variants into the first variant of a set."""
    root.variantSetNameList.prependedItems = [name]
    root.variantSelections[name] = variant
    first = Sdf.VariantSpec(Sdf.VariantSetSpec(root, name), variant).primSpec
    first.payloadList.prependedItems = list(root.payloadList.prependedItems)
    root.payloadList.ClearEdits()
    hint = root.attributes.get("extentsHint")
    if hint is not None:
        set_extents_hint(first, np.asarray(hint.default, dtype=np.float64))
        root.RemoveProperty(hint)
    if "nominal_size" in root.customData:
        first.customData["nominal_size"] = root.customData["nominal_size"]
        del root.customData["nominal_size"]


def _own_payload(made: Sdf.PrimSpec, folder: Path, name: str, variant: str, asset: Asset) -> str:
    """Copies the payload of the variant; returns its path relative to the asset's folder."""
    items = list(made.payloadList.prependedItems)
    if not items:
        return ""
    taken = {each for of, names in asset.variants.items() if of != name for each in names}
    source = folder / "usd" / items[0].assetPath
    stem = f"{name}_{variant}" if variant in taken | {asset.name} else variant
    target = folder / "payload" / f"{stem}{source.suffix}"
    target.unlink(missing_ok=True)
    if items[0].primPath:
        write_layer(_alone(source, items[0].primPath, asset.name), target)
    else:
        shutil.copyfile(source, target)
    made.payloadList.prependedItems = [Sdf.Payload(f"../payload/{target.name}")]
    return f"payload/{target.name}"


def _alone(source: Path, path: Sdf.Path, name: str) -> Sdf.Layer:
    """A layer whose default prim is a prim of a file, with the classes of its surfaces."""
    read, layer = read_layer(source), new_layer(name)
    Sdf.CopySpec(read, path, layer, Sdf.Path(f"/{name}"))
    if read.GetPrimAtPath(SURFACES):
        Sdf.CopySpec(read, SURFACES, layer, SURFACES)
    return layer


def _replace_geometry(made: Sdf.PrimSpec, asset: Asset, draft: Path, name: str, file: Path) -> str:
    """Gives a variant the geometry of a file; returns the payload's path in the asset's folder."""
    items = list(made.payloadList.prependedItems)
    if not items:
        sets = ", ".join(sorted({of for of, _ in asset.sizes if of}))
        raise EnvgenError(
            f"{asset.name}: variants of this set have no geometry of their own"
            f"{f'; use the set {sets}' if sets else ''}"
        )
    folder = draft / Path(asset.path).parents[1]
    model, _, _ = import_model(file, draft, name, ImportOptions(asset.kind))
    design = AssetDesign(asset.name, asset.kind, asset.label, {"": model})
    target = folder / "usd" / items[0].assetPath
    write_layer(payload_layer(design, model), target)
    _set_box(made, model.extent())
    made.customData["nominal_size"] = Gf.Vec3d(*model.size())
    return f"payload/{target.name}"


def _scale(
    made: Sdf.PrimSpec,
    asset: Asset,
    existing: Mapping[str, str],
    size: tuple[float, float, float],
) -> None:
    """Scales the geometry of a variant, and its stated sizes, to an extent in metres."""
    general = ("", "") in asset.sizes or not asset.variants
    if "nominal_size" not in made.customData and not general:
        sets = ", ".join(sorted({of for of, _ in asset.sizes if of}))
        raise EnvgenError(f"{asset.name}: the set {sets} decides the size; use --set {sets}")
    if not (np.isfinite(size).all() and min(size) > 0.0):
        raise EnvgenError(f"size {size}: expected three numbers above 0, metres")
    stated = made.customData.get("nominal_size")
    before = np.asarray(stated, dtype=np.float64) if stated else asset.size(existing)
    hint = made.attributes.get("extentsHint")
    box: FloatArray = np.asarray(hint.default, dtype=np.float64) if hint else asset.extent(existing)
    factor = np.asarray(size) / before
    _set_box(made, box * factor)
    made.customData["nominal_size"] = Gf.Vec3d(*size)
    geometry = _over(made, _GEOMETRY)
    types = Sdf.ValueTypeNames
    op = geometry.attributes.get("xformOp:scale")
    if op is not None:
        op.default = to_float3(np.asarray(op.default, dtype=np.float64) * factor)
        return
    set_attribute(geometry, "xformOp:scale", types.Float3, to_float3(factor))
    set_attribute(geometry, "xformOpOrder", types.TokenArray, ["xformOp:scale"], uniform=True)


def _set_box(made: Sdf.PrimSpec, box: FloatArray) -> None:
    """Authors `extentsHint` (2 x 3) anew."""
    hint = made.attributes.get("extentsHint")
    if hint is not None:
        made.RemoveProperty(hint)
    set_extents_hint(made, box)


def _over(parent: Sdf.PrimSpec, name: str) -> Sdf.PrimSpec:
    """The opinion over a child of a prim, added if missing."""
    child = parent.nameChildren.get(name)
    return child or add_prim(parent, name, specifier=Sdf.SpecifierOver)


def _bind(made: Sdf.PrimSpec, root: Sdf.PrimSpec, part: str, material: str) -> None:
    """Gives a part a material in the variant."""
    scope = made.nameChildren.get("Materials") or add_prim(made, "Materials", "Scope")
    if material not in scope.nameChildren:
        entry = add_prim(scope, material, "Material")
        entry.referenceList.prependedItems = [Sdf.Reference(f"{MATERIALS}/{material}.usda")]
    mesh = _over(_over(made, _GEOMETRY), part)
    if "material:binding" in mesh.relationships:
        mesh.RemoveProperty(mesh.relationships["material:binding"])
    mesh.inheritPathList.ClearEdits()
    mesh.ClearInfo("active")
    bind_material(mesh, root.path.AppendPath(f"Materials/{material}"))
    set_surface(mesh, material)


def _proxies(interface: Path, chosen: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Names of the meshes that show each part at a distance."""
    stage = _opened(interface, chosen)
    return {
        prim.GetName(): tuple(
            path.name for path in UsdGeom.Imageable(prim).GetProxyPrimRel().GetTargets()
        )
        for prim in stage.Traverse()
        if prim.IsA("Mesh")
    }


def _opened(interface: Path, chosen: Mapping[str, str]) -> Usd.Stage:
    """An asset with these variants."""
    stage = Usd.Stage.Open(str(interface))
    stage.SetEditTarget(stage.GetSessionLayer())
    for name, variant in chosen.items():
        stage.GetDefaultPrim().GetVariantSet(name).SetVariantSelection(variant)
    return stage


def _refuse(issues: tuple[Issue, ...], asset: str) -> None:
    errors = [issue for issue in issues if issue.severity == Severity.ERROR]
    if errors:
        raise EnvgenError(f"{asset}: {errors[0].where}: {errors[0].message}")


def _check_bindings(
    interface: Path, asset: Asset, chosen: Mapping[str, str], materials: Mapping[str, str]
) -> None:
    """Checks that the parts have their materials in the composed asset.

    Raises:
        EnvgenError: A part does not exist, or another variant set decides its material.
    """
    stage = _opened(interface, chosen)
    geometry = stage.GetDefaultPrim().GetPath().AppendChild(_GEOMETRY)
    children = stage.GetPrimAtPath(geometry).GetAllChildren()
    meshes = [prim.GetName() for prim in children if prim.IsA("Mesh")]
    for part, material in materials.items():
        prim = stage.GetPrimAtPath(geometry.AppendChild(part))
        if part not in meshes:
            raise EnvgenError(f"{asset.name}: no part '{part}'; known: {', '.join(meshes)}")
        bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        if not bound or bound.GetPrim().GetName() != material:
            other = bound.GetPrim().GetName() if bound else "none"
            others = ", ".join(of for of in asset.variants if of not in chosen) or "the payload"
            raise EnvgenError(
                f"{asset.name}: part '{part}' keeps the material {other}: {others} decides it; "
                "make the variant in that set with --set"
            )

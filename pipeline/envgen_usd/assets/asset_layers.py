"""Writes an asset: an interface with its variant sets, and payloads that hold the geometry.

    assets/<kind>/<name>/usd/<name>.usda        variant sets, labels, metadata
    assets/<kind>/<name>/payload/<model>.usdc   meshes and materials

A design's model set becomes a variant set with a payload for each variant. Poses of one body share
a file, ``payload/<name>.usdc``: a crate file stores equal arrays once, and faces and texture
coordinates are the same in all poses. A design's looks become variant sets that bind other
materials to the meshes. Meshes bind materials of the asset; on a stage, they inherit the binding to
the stage's material of that name.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf

from envgen_usd.assets.asset_design import AssetDesign, Lamp, Model, Part, Subset
from envgen_usd.assets.collider_boxes import collider_box
from envgen_usd.assets.prim_authoring import (
    add_material_references,
    add_mesh,
    add_prim,
    add_subset,
    apply_schemas,
    bind_material,
    set_attribute,
    set_class,
    set_extents_hint,
    set_label,
    set_pose,
    set_surface,
)
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.assets.usd_values import to_double3s, to_points
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.atmosphere import STAGE_UNIT

MATERIALS = "../../../../materials"
"""Path of the materials, relative to an asset's `usd` and `payload` folders."""
AUTHORED = "2026-11-21"
"""Date in the metadata; a constant, so that the same source gives the same bytes."""


def write_asset(design: AssetDesign, library: Path) -> None:
    """Writes the interface and the payloads of an asset.

    Args:
        design: Asset.
        library: Folder of the library.
    """
    folder = library / "assets" / design.kind / design.name
    if design.has_poses:
        write_layer(_pose_layer(design), folder / "payload" / f"{design.name}.usdc")
    else:
        for variant, model in design.models.items():
            payload = payload_layer(design, model)
            write_layer(payload, folder / "payload" / f"{variant or design.name}.usdc")
    write_layer(_interface_layer(design), folder / "usd" / f"{design.name}.usda")


def payload_layer(design: AssetDesign, model: Model) -> Sdf.Layer:
    """The geometry of an asset as the default prim of a layer."""
    layer = new_layer(design.name)
    _add_geometry(add_prim(layer, design.name, "Xform"), design, model)
    return layer


def _pose_layer(design: AssetDesign) -> Sdf.Layer:
    """A layer with a prim for each pose, below the default prim."""
    layer = new_layer(design.name)
    root = add_prim(layer, design.name, "Xform")
    for pose, model in design.models.items():
        _add_geometry(add_prim(root, pose, "Xform"), design, model)
    return layer


def _add_geometry(root: Sdf.PrimSpec, design: AssetDesign, model: Model) -> None:
    """Adds meshes, lamps and materials of a model below a prim."""
    looked_after = {
        part for variants in design.looks.values() for look in variants.values() for part in look
    }
    fixed = {part.material for part in model.parts if _has_material(part, looked_after)}
    fixed |= {
        subset.material
        for part in model.parts
        for subset in part.subsets
        if f"{part.name}/{subset.name}" not in looked_after
    }
    paths = add_material_references(root, {name: _material(name) for name in fixed})
    geometry = add_prim(root, "Geometry", "Xform")
    for part in model.parts:
        mesh = add_mesh(geometry, part.name, part.mesh, double_sided=part.double_sided)
        set_label(mesh, "part", part.label)
        if part.of_class:
            set_class(mesh, part.of_class)
        if _has_material(part, looked_after):
            bind_material(mesh, paths[part.material])
            set_surface(mesh, part.material)
        for subset in part.subsets:
            fixed_path = paths.get(subset.material)
            if f"{part.name}/{subset.name}" in looked_after:
                fixed_path = None
            _add_subset(mesh, subset, fixed_path)
    for lamp in model.lamps:
        _add_lamp(geometry, lamp)
    _set_purposes(geometry, model)
    box = collider_box(design.kind, model)
    if box is not None:
        _add_collider(geometry, box)


def _has_material(part: Part, looked_after: set[str]) -> bool:
    """True if the payload binds the part's material; subsets have their own."""
    return part.name not in looked_after and not part.subsets


def _add_subset(mesh: Sdf.PrimSpec, subset: Subset, material: Sdf.Path | None) -> None:
    """Adds a subset with its labels, and with its material unless looks bind one."""
    prim = add_subset(mesh, subset.name, subset.faces, subset.material if material else "")
    set_label(prim, "part", subset.label)
    if subset.of_class:
        set_class(prim, subset.of_class)
    if material:
        bind_material(prim, material)


def _add_collider(parent: Sdf.PrimSpec, box: FloatArray) -> None:
    """Adds a box that collides and is not drawn (UsdPhysics); boxes allow any scale."""
    types = Sdf.ValueTypeNames
    cube = add_prim(parent, "Collider", "Cube")
    set_attribute(cube, "size", types.Double, 1.0)
    set_attribute(cube, "extent", types.Float3Array, to_points(np.array([[-0.5] * 3, [0.5] * 3])))
    set_attribute(cube, "purpose", types.Token, "guide", uniform=True)
    apply_schemas(cube, "PhysicsCollisionAPI")
    set_pose(cube, translate=box.mean(axis=0), scale=box[1] - box[0])


def _add_lamp(parent: Sdf.PrimSpec, lamp: Lamp) -> None:
    types = Sdf.ValueTypeNames
    light = add_prim(parent, lamp.name, "DiskLight" if lamp.faces_down else "SphereLight")
    set_attribute(light, "inputs:radius", types.Float, lamp.radius)
    set_attribute(light, "inputs:intensity", types.Float, lamp.luminance() / STAGE_UNIT)
    set_attribute(light, "inputs:color", types.Color3f, Gf.Vec3f(*lamp.colour))
    set_pose(light, translate=np.array(lamp.place))


def _set_purposes(geometry: Sdf.PrimSpec, model: Model) -> None:
    """Sets the purpose of parts with a proxy to render, and relates both (UsdGeomImageable)."""
    meshes = {mesh.name: mesh for mesh in geometry.nameChildren}
    for part in model.parts:
        if part.proxy_of:
            proxy = meshes[part.name]
            full = [meshes[name] for name in (part.proxy_of, *part.stands_for)]
            for mesh, purpose in (*((each, "render") for each in full), (proxy, "proxy")):
                set_attribute(mesh, "purpose", Sdf.ValueTypeNames.Token, purpose, uniform=True)
            for mesh in full:
                relation = Sdf.RelationshipSpec(mesh, "proxyPrim", custom=False)
                relation.targetPathList.explicitItems = [proxy.path]


def _material(name: str) -> str:
    return f"{MATERIALS}/{name}.usda"


def _interface_layer(design: AssetDesign) -> Sdf.Layer:
    layer = new_layer(design.name)
    layer.customLayerData = {
        "asset_name": design.name,
        "asset_type": design.kind,
        "source_file": f"{design.name}.usda",
        "usd_date_generated": AUTHORED,
    }
    classes = add_prim(layer, "__class__", specifier=Sdf.SpecifierClass)
    template = add_prim(classes, design.name, specifier=Sdf.SpecifierClass)
    root = add_prim(layer, design.name, "Xform", kind="component")
    root.inheritPathList.prependedItems = [template.path]
    root.assetInfo["identifier"] = Sdf.AssetPath(f"./{design.name}.usda")
    root.assetInfo["name"] = design.name
    root.assetInfo["version"] = "1"
    for key, value in _metadata(design).items():
        root.customData[key] = value
    if design.widths:
        root.customData["fits_width"] = Gf.Vec2d(*design.widths)
    set_class(root, design.label)
    if design.model_set:
        _add_models(root, design)
    else:
        _add_payload(root, design, "", design.models[""])
    for name, variants in design.looks.items():
        _add_looks(root, name, variants)
    return layer


def _metadata(design: AssetDesign) -> dict[str, str]:
    return {
        "area_types": " ".join(design.areas),
        "category": design.kind,
        "countries": " ".join(design.countries),
        "segmentation_class": design.label,
    }


def _add_payload(prim: Sdf.PrimSpec, design: AssetDesign, variant: str, model: Model) -> None:
    if design.has_poses:
        payload = Sdf.Payload(f"../payload/{design.name}.usdc", f"/{design.name}/{variant}")
    else:
        payload = Sdf.Payload(f"../payload/{variant or design.name}.usdc")
    prim.payloadList.prependedItems = [payload]
    set_extents_hint(prim, model.extent())
    prim.customData["nominal_size"] = Gf.Vec3d(*model.size())
    for name, value in model.custom.items():
        prim.customData[name] = to_double3s(value) if isinstance(value, np.ndarray) else value


def _variant_set(root: Sdf.PrimSpec, name: str, default: str) -> Sdf.VariantSetSpec:
    root.variantSetNameList.prependedItems = [*root.variantSetNameList.prependedItems, name]
    root.variantSelections[name] = default
    return Sdf.VariantSetSpec(root, name)


def _add_models(root: Sdf.PrimSpec, design: AssetDesign) -> None:
    variants = _variant_set(root, design.model_set, next(iter(design.models)))
    for name, model in design.models.items():
        _add_payload(Sdf.VariantSpec(variants, name).primSpec, design, name, model)


def _add_looks(root: Sdf.PrimSpec, name: str, variants: Mapping[str, Mapping[str, str]]) -> None:
    variant_set = _variant_set(root, name, next(iter(variants)))
    for variant, look in variants.items():
        prim = Sdf.VariantSpec(variant_set, variant).primSpec
        used = {material for material in look.values() if material}
        add_material_references(prim, {material: _material(material) for material in used})
        geometry = add_prim(prim, "Geometry", specifier=Sdf.SpecifierOver)
        for part, material in look.items():
            mesh = _over(geometry, part)
            if material:
                bind_material(mesh, root.path.AppendPath(f"Materials/{material}"))
                set_surface(mesh, material)
            else:
                mesh.active = False


def _over(geometry: Sdf.PrimSpec, part: str) -> Sdf.PrimSpec:
    """The over of a part, or of a subset of a part: ``<part>/<subset>``."""
    prim = geometry
    for name in part.split("/"):
        child = prim.nameChildren.get(name)
        prim = child or add_prim(prim, name, specifier=Sdf.SpecifierOver)
    return prim

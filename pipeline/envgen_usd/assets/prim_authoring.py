"""Authors prims on an Sdf layer: meshes, subsets, labels, bindings, transforms.

For many prims, the Sdf API is some hundred times faster than the Usd API. Its output depends only
on its arguments.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from pxr import Gf, Sdf, Vt

from envgen_usd.assets.polygon_mesh import Mesh
from envgen_usd.assets.usd_values import to_double3, to_float3, to_ints, to_points, to_uv
from envgen_usd.label_taxonomy import label
from envgen_usd.models.array_types import FloatArray, IntArray

Parent = Sdf.PrimSpec | Sdf.Layer
SURFACES = Sdf.Path("/__surface__")
"""Scope of the classes of surfaces: one for each material, of the same name."""
SEASON = "season"
"""Variant set of plants, and the end of the name of the class that selects for the whole stage."""
SEASON_CLASS = Sdf.Path(f"/__{SEASON}__")
"""Class that all plants inherit; its variant selection is the season of the stage."""


def add_prim(
    parent: Parent,
    name: str,
    type_name: str = "",
    *,
    kind: str = "",
    specifier: Sdf.Specifier = Sdf.SpecifierDef,
) -> Sdf.PrimSpec:
    """Adds a child prim; `parent` is a prim or the layer itself."""
    prim = Sdf.PrimSpec(parent, name, specifier, type_name)
    if kind:
        prim.kind = kind
    return prim


def set_attribute(  # noqa: PLR0913 - what an attribute consists of
    prim: Sdf.PrimSpec,
    name: str,
    type_name: Sdf.ValueTypeName,
    value: object,
    *,
    uniform: bool = False,
    custom: bool = False,
) -> Sdf.AttributeSpec:
    """Adds an attribute with its default value."""
    variability = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
    attribute = Sdf.AttributeSpec(prim, name, type_name, variability, custom)
    attribute.default = value
    return attribute


def apply_schemas(prim: Sdf.PrimSpec, *names: str) -> None:
    """Adds applied API schemas to those of the prim."""
    schemas_op = prim.GetInfo("apiSchemas") if prim.HasInfo("apiSchemas") else Sdf.TokenListOp()
    items = [*schemas_op.prependedItems, *(n for n in names if n not in schemas_op.prependedItems)]
    prim.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=items))


def set_label(prim: Sdf.PrimSpec, taxonomy: str, token: str) -> None:
    """Gives the prim a label of a taxonomy of UsdSemantics."""
    apply_schemas(prim, f"SemanticsLabelsAPI:{taxonomy}")
    name = f"semantics:labels:{taxonomy}"
    set_attribute(prim, name, Sdf.ValueTypeNames.TokenArray, Vt.TokenArray([token]))


def set_class(prim: Sdf.PrimSpec, name: str) -> None:
    """Labels a component with its class, and with its Cityscapes class.

    Raises:
        KeyError: The class is not in `schemas/labels.toml`.
    """
    set_label(prim, "class", label(name).name)
    set_label(prim, "cityscapes", label(name).cityscapes)


def bind_material(prim: Sdf.PrimSpec, material: Sdf.Path) -> None:
    """Binds a material for all purposes."""
    apply_schemas(prim, "MaterialBindingAPI")
    binding = Sdf.RelationshipSpec(prim, "material:binding", custom=False)
    binding.targetPathList.explicitItems = [material]


def set_surface(prim: Sdf.PrimSpec, material: str) -> None:
    """Makes a mesh or subset a surface of a material, by inheriting the material's class.

    A binding in a payload or an asset cannot name a prim above it. The stage binds the class to its
    one material; inherits are stronger than what an asset binds itself.
    """
    path = SURFACES.AppendChild(material)
    for ancestor in path.GetPrefixes():
        if not prim.layer.GetPrimAtPath(ancestor):
            parent = prim.layer.GetPrimAtPath(ancestor.GetParentPath())
            add_prim(parent, ancestor.name, specifier=Sdf.SpecifierClass)
    inherits = prim.inheritPathList
    inherits.prependedItems = [*inherits.prependedItems, path]


def set_collider(mesh: Sdf.PrimSpec) -> None:
    """Makes a mesh that does not move a collider, by its own triangles (UsdPhysics)."""
    apply_schemas(mesh, "PhysicsCollisionAPI", "PhysicsMeshCollisionAPI")
    kind = Sdf.ValueTypeNames.Token
    set_attribute(mesh, "physics:approximation", kind, "none", uniform=True)


def set_extents_hint(prim: Sdf.PrimSpec, extent: FloatArray) -> None:
    """Authors the bounding box (2 x 3) of a model with an unloaded payload."""
    apply_schemas(prim, "GeomModelAPI")
    set_attribute(prim, "extentsHint", Sdf.ValueTypeNames.Float3Array, to_points(extent))


def set_pose(
    prim: Sdf.PrimSpec,
    translate: FloatArray | None = None,
    rotate: FloatArray | None = None,
    scale: FloatArray | None = None,
) -> None:
    """Authors translate (metres, double), rotateXYZ (degrees) and scale, in USD's usual order."""
    order: list[str] = []
    if translate is not None:
        _add_op(prim, order, "translate", Sdf.ValueTypeNames.Double3, to_double3(translate))
    if rotate is not None:
        _add_op(prim, order, "rotateXYZ", Sdf.ValueTypeNames.Float3, to_float3(rotate))
    if scale is not None:
        _add_op(prim, order, "scale", Sdf.ValueTypeNames.Float3, to_float3(scale))
    kind = Sdf.ValueTypeNames.TokenArray
    set_attribute(prim, "xformOpOrder", kind, Vt.TokenArray(order), uniform=True)


def _add_op(
    prim: Sdf.PrimSpec, order: list[str], op: str, type_name: Sdf.ValueTypeName, value: object
) -> None:
    set_attribute(prim, f"xformOp:{op}", type_name, value)
    order.append(f"xformOp:{op}")


def add_mesh(
    parent: Parent, name: str, mesh: Mesh, *, double_sided: bool = False, kind: str = ""
) -> Sdf.PrimSpec:
    """Adds a polygon mesh; normals and texture coordinates per corner are indexed."""
    types = Sdf.ValueTypeNames
    prim = add_prim(parent, name, "Mesh", kind=kind)
    set_attribute(prim, "points", types.Point3fArray, to_points(mesh.points))
    set_attribute(prim, "faceVertexCounts", types.IntArray, to_ints(mesh.face_sizes))
    set_attribute(prim, "faceVertexIndices", types.IntArray, to_ints(mesh.face_vertices))
    set_attribute(prim, "extent", types.Float3Array, to_points(mesh.extent()))
    set_attribute(prim, "subdivisionScheme", types.Token, "none", uniform=True)
    if double_sided:
        set_attribute(prim, "doubleSided", types.Bool, True, uniform=True)
    set_normals(prim, mesh.normals, at_corners=mesh.corner_normals)
    set_uv(prim, mesh.uv, at_corners=mesh.corner_uv)
    return prim


def set_normals(mesh: Sdf.PrimSpec, normals: FloatArray, *, at_corners: bool) -> None:
    """Authors `normals` per vertex, or `primvars:normals` per corner, indexed.

    A wall has few normals and many corners: they were two thirds of the bytes of buildings.
    """
    kind = Sdf.ValueTypeNames.Normal3fArray
    if not at_corners:
        stated = set_attribute(mesh, "normals", kind, to_points(normals))
        stated.SetInfo("interpolation", "vertex")
        return
    exact = np.ascontiguousarray(normals, dtype=np.float32) + np.float32(0.0)
    rows = exact.view(np.dtype((np.void, exact.dtype.itemsize * 3))).reshape(-1)
    _, first, index = np.unique(rows, return_index=True, return_inverse=True)
    stated = set_attribute(
        mesh, "primvars:normals", kind, to_points(exact[first].astype(np.float64))
    )
    stated.SetInfo("interpolation", "faceVarying")
    set_attribute(mesh, "primvars:normals:indices", Sdf.ValueTypeNames.IntArray, to_ints(index))


def set_uv(mesh: Sdf.PrimSpec, uv: FloatArray, *, at_corners: bool) -> None:
    """Authors `primvars:st` per vertex (indexed where values repeat) or, indexed, per corner."""
    types = Sdf.ValueTypeNames
    exact = np.ascontiguousarray(uv, dtype=np.float32).view(np.complex64).reshape(-1)
    values, index = np.unique(exact, return_inverse=True)
    indexed = at_corners or len(values) < len(uv)
    pairs = values.view(np.float32).reshape(-1, 2).astype(np.float64)
    st = set_attribute(mesh, "primvars:st", types.TexCoord2fArray, to_uv(pairs if indexed else uv))
    st.SetInfo("interpolation", "faceVarying" if at_corners else "vertex")
    if indexed:
        set_attribute(mesh, "primvars:st:indices", types.IntArray, to_ints(index))


def set_display_colour(mesh: Sdf.PrimSpec, colour: Gf.Vec3f) -> None:
    """Authors one `primvars:displayColor` for a mesh; tinted materials multiply their colour."""
    kind = Sdf.ValueTypeNames.Color3fArray
    primvar = set_attribute(mesh, "primvars:displayColor", kind, Vt.Vec3fArray([colour]))
    primvar.SetInfo("interpolation", "constant")


def add_subset(mesh: Sdf.PrimSpec, name: str, faces: IntArray, material: str) -> Sdf.PrimSpec:
    """Adds faces of a material as a subset; all subsets of a mesh must partition its faces.

    Args:
        mesh: The mesh.
        name: Name of the subset.
        faces: Numbers of the faces.
        material: Its surface, see `set_surface`; empty for a surface that variants choose.
    """
    types = Sdf.ValueTypeNames
    prim = add_prim(mesh, name, "GeomSubset")
    set_attribute(prim, "elementType", types.Token, "face", uniform=True)
    set_attribute(prim, "familyName", types.Token, "materialBind", uniform=True)
    set_attribute(prim, "indices", types.IntArray, to_ints(faces))
    if material:
        set_surface(prim, material)
    family = "subsetFamily:materialBind:familyType"
    if family not in mesh.attributes:
        set_attribute(mesh, family, types.Token, "partition", uniform=True)
    return prim


def add_material_references(
    root: Sdf.PrimSpec, references: Mapping[str, str]
) -> dict[str, Sdf.Path]:
    """Adds a `Materials` scope below a prim, with a reference for each material.

    Args:
        root: Parent of the scope.
        references: Asset path of each material file, by material name.

    Returns:
        Prim path of each material.
    """
    if not references:
        return {}
    scope = add_prim(root, "Materials", "Scope")
    paths = {}
    for name in sorted(references):
        prim = add_prim(scope, name, "Material")
        prim.referenceList.prependedItems = [Sdf.Reference(references[name])]
        paths[name] = prim.path
    return paths


def set_custom(prim: Sdf.PrimSpec, values: Mapping[str, str]) -> None:
    """Authors `userProperties:<name>` strings, the only metadata that Blender imports."""
    for name in sorted(values):
        attribute = f"userProperties:{name}"
        set_attribute(prim, attribute, Sdf.ValueTypeNames.String, values[name], custom=True)


def prim_names(ids: Iterable[str]) -> dict[str, str]:
    """A valid and unique prim name for each id; depends on the ids alone."""
    names: dict[str, str] = {}
    taken: set[str] = set()
    for key in sorted(set(ids)):
        name = "".join(char if char.isascii() and char.isalnum() else "_" for char in key)
        name = f"_{name}" if not name or name[0].isdigit() else name
        unique, count = name, 1
        while unique in taken:
            count += 1
            unique = f"{name}_{count}"
        taken.add(unique)
        names[key] = unique
    return names


def union_extent(extents: Sequence[FloatArray]) -> FloatArray:
    """The union of boxes, each 2 x 3; an empty sequence gives a zero-size box at the origin."""
    if not extents:
        return np.zeros((2, 3))
    boxes = np.stack(extents)
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

"""Reads the arrays of meshes of a stage."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.render_scene import Material
from envgen_usd.render.stage.typed_values import BadValueError, rows, whole_numbers


@dataclass(frozen=True)
class FaceGroup:
    """Faces of a mesh that share look and labels.

    Attributes:
        material: Index of the material.
        look: Material of the group.
    """

    material: int
    look: Material


@dataclass(frozen=True)
class Primvar:
    """Values (N x k) with the index of each element of an interpolation, or `None` if in order."""

    values: FloatArray
    interpolation: str
    indices: IntArray | None


@dataclass(frozen=True)
class MeshArrays:
    """A mesh as the stage gives it.

    Attributes:
        points: P x 3.
        sizes: F, number of corners of each face.
        corners: C, point of each corner.
        group_of: F, group of each face.
        groups: Looks of the groups.
        normals: Authored normals, or `None`.
        smooth: True if normals are computed for each point; without normals, faces are flat.
        uvs: Texture coordinates by the name of their primvar.
        colours: Linear ``displayColor``, or `None`.
        left_handed: True if faces turn clockwise, seen from outside.
        double_sided: True if both sides are visible.
    """

    points: FloatArray
    sizes: IntArray
    corners: IntArray
    group_of: IntArray
    groups: tuple[FaceGroup, ...]
    normals: Primvar | None
    smooth: bool
    uvs: Mapping[str, Primvar]
    colours: Primvar | None
    left_handed: bool
    double_sided: bool


@dataclass(frozen=True)
class Topology:
    """Points and faces of a mesh; shapes as in `MeshArrays`."""

    points: FloatArray
    sizes: IntArray
    corners: IntArray


class BadMeshError(BadValueError):
    """The arrays of the mesh are inconsistent."""


def read_topology(mesh: UsdGeom.Mesh, time: Usd.TimeCode) -> Topology:
    """Points and faces of a mesh.

    Raises:
        BadMeshError: An index lies outside its array, or a point is not finite.
        BadValueError: An array holds no numbers.
    """
    points = rows(mesh.GetPointsAttr(), time, 3)
    sizes = whole_numbers(mesh.GetFaceVertexCountsAttr(), time)
    corners = whole_numbers(mesh.GetFaceVertexIndicesAttr(), time)
    if sizes.sum() != len(corners) or (sizes < 0).any():
        raise BadMeshError(
            f"{len(corners)} face vertex indices, but faceVertexCounts add up to {sizes.sum()}"
        )
    if len(corners) and (corners.min() < 0 or corners.max() >= len(points)):
        raise BadMeshError(f"face vertex indices outside the {len(points)} points")
    if not np.isfinite(points).all():
        bad = np.count_nonzero(~np.isfinite(points).all(axis=1))
        raise BadMeshError(f"{bad} of {len(points)} points are not finite")
    return Topology(points, sizes, corners)


def read_mesh(
    mesh: UsdGeom.Mesh,
    topology: Topology,
    group_of: IntArray,
    groups: Sequence[FaceGroup],
    time: Usd.TimeCode,
) -> MeshArrays:
    """Reads normals, texture coordinates and colours of a mesh, as far as its looks use them.

    Without authored normals, polygonal meshes get flat normals and subdivision surfaces smooth
    normals (UsdGeomMesh: normals).
    """
    primvars = UsdGeom.PrimvarsAPI(mesh)
    names = dict.fromkeys(group.look.uv_name for group in groups if group.look.textures)
    found = {name: _find(primvars, name, 2, topology, time) for name in names}
    coloured = any(group.look.vertex_colour or group.look.tinted for group in groups)
    normals, smooth = _normals(mesh, primvars, topology, time)
    return MeshArrays(
        points=topology.points,
        sizes=topology.sizes,
        corners=topology.corners,
        group_of=group_of,
        groups=tuple(groups),
        normals=normals,
        smooth=smooth,
        uvs={name: primvar for name, primvar in found.items() if primvar is not None},
        colours=_find(primvars, "displayColor", 3, topology, time) if coloured else None,
        left_handed=mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded,
        double_sided=bool(mesh.GetDoubleSidedAttr().Get()),
    )


def _normals(
    mesh: UsdGeom.Mesh, primvars: UsdGeom.PrimvarsAPI, topology: Topology, time: Usd.TimeCode
) -> tuple[Primvar | None, bool]:
    """Authored normals, and whether a mesh without them is smooth."""
    primvar = primvars.GetPrimvar("normals")
    if primvar and primvar.HasValue():
        return _primvar(primvar, 3, topology, time), False
    try:
        values = rows(mesh.GetNormalsAttr(), time, 3)
    except BadValueError:
        return None, False
    if len(values):
        normals = Primvar(values, mesh.GetNormalsInterpolation(), None)
        return (normals if _fits(normals, topology) else None), False
    return None, mesh.GetSubdivisionSchemeAttr().Get() != UsdGeom.Tokens.none


def _find(
    primvars: UsdGeom.PrimvarsAPI, name: str, width: int, topology: Topology, time: Usd.TimeCode
) -> Primvar | None:
    primvar = primvars.FindPrimvarWithInheritance(name)
    return _primvar(primvar, width, topology, time) if primvar and primvar.HasValue() else None


def _primvar(
    primvar: UsdGeom.Primvar, width: int, topology: Topology, time: Usd.TimeCode
) -> Primvar | None:
    """A primvar's values, or `None` if they do not match the mesh."""
    try:
        values = rows(primvar.GetAttr(), time, width)
        indices = whole_numbers(primvar.GetIndicesAttr(), time) if primvar.IsIndexed() else None
    except BadValueError:
        return None
    result = Primvar(values, str(primvar.GetInterpolation()), indices)
    return result if _fits(result, topology) else None


def _fits(primvar: Primvar, topology: Topology) -> bool:
    needed = {
        "constant": 1,
        "uniform": len(topology.sizes),
        "faceVarying": len(topology.corners),
    }
    count = needed.get(primvar.interpolation, len(topology.points))
    if primvar.indices is None:
        return len(primvar.values) >= count
    inside = len(primvar.indices) == 0 or (
        primvar.indices.min() >= 0 and primvar.indices.max() < len(primvar.values)
    )
    return len(primvar.indices) >= count and bool(inside)

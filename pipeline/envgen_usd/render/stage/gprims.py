"""Spheres, boxes, cylinders, cones and capsules of a stage as triangles."""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import trimesh
from pxr import Gf, Usd, UsdGeom

from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.render_scene import Geometry
from envgen_usd.render.stage.mesh_batches import srgb_bytes
from envgen_usd.render.stage.typed_values import BadValueError, number, rows

_Maker: TypeAlias = Callable[[Any, Usd.TimeCode], trimesh.Trimesh]
_SECTIONS = 32
_AXES = {"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1)}
_GREY = np.array([118, 118, 118, 255], np.uint8)


def read_gprim(gprim: UsdGeom.Gprim, material: int, time: Usd.TimeCode) -> Geometry | None:
    """Triangles of a gprim without texture coordinates; `None` for other kinds of gprim.

    The whole gprim has the first value of its ``displayColor``.

    Args:
        gprim: Prim; its size and axis are read at `time`.
        material: Index of its material.
        time: Time code.

    Raises:
        BadValueError: A size is no finite number, or the axis is none.
    """
    make = _MAKERS.get(str(gprim.GetPrim().GetTypeName()))
    if make is None:
        return None
    solid = make(gprim.GetPrim(), time)
    corners = np.asarray(solid.triangles, np.float64)  # T x 3 x 3
    normals = np.repeat(np.asarray(solid.face_normals, np.float32), 3, axis=0)
    count = 3 * len(corners)
    return Geometry(
        points=corners.reshape(-1, 3),
        normals=normals,
        uvs=np.zeros((count, 2), np.float32),
        colours=np.broadcast_to(_colour(gprim, time), (count, 4)),
        triangles=np.arange(count, dtype=np.uint32).reshape(-1, 3),
        material=material,
        double_sided=bool(gprim.GetDoubleSidedAttr().Get()),
    )


def _colour(gprim: UsdGeom.Gprim, time: Usd.TimeCode) -> ByteArray:
    """Colour of the corners: 4, as `Geometry.colours`."""
    primvar = UsdGeom.PrimvarsAPI(gprim).FindPrimvarWithInheritance("displayColor")
    try:
        values = rows(primvar.GetAttr(), time, 3) if primvar and primvar.HasValue() else None
    except BadValueError:
        return _GREY
    if values is None or not len(values) or not np.isfinite(values[0]).all():
        return _GREY
    return np.append(srgb_bytes(values[0]), np.uint8(255))


def _get(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> float:
    return number(prim.GetAttribute(name), time)


def _cube(prim: Usd.Prim, time: Usd.TimeCode) -> trimesh.Trimesh:
    box: trimesh.Trimesh = trimesh.creation.box(extents=np.full(3, _get(prim, "size", time)))
    return box


def _sphere(prim: Usd.Prim, time: Usd.TimeCode) -> trimesh.Trimesh:
    return trimesh.creation.uv_sphere(_get(prim, "radius", time), count=(_SECTIONS, _SECTIONS))


def _cylinder(prim: Usd.Prim, time: Usd.TimeCode) -> trimesh.Trimesh:
    radius, height = _get(prim, "radius", time), _get(prim, "height", time)
    return _turned(prim, trimesh.creation.cylinder(radius, height, sections=_SECTIONS))


def _capsule(prim: Usd.Prim, time: Usd.TimeCode) -> trimesh.Trimesh:
    radius, height = _get(prim, "radius", time), _get(prim, "height", time)
    solid = trimesh.creation.capsule(height, radius, count=(_SECTIONS, _SECTIONS))
    solid.apply_translation(-solid.bounds.mean(axis=0))
    return _turned(prim, solid)


def _cone(prim: Usd.Prim, time: Usd.TimeCode) -> trimesh.Trimesh:
    radius, height = _get(prim, "radius", time), _get(prim, "height", time)
    solid = trimesh.creation.cone(radius, height, sections=_SECTIONS)
    solid.apply_translation(-solid.bounds.mean(axis=0))
    return _turned(prim, solid)


def _turned(prim: Usd.Prim, solid: trimesh.Trimesh) -> trimesh.Trimesh:
    """Rotates a solid from the z axis to the prim's ``axis``."""
    axis = _AXES.get(str(prim.GetAttribute("axis").Get()))
    if axis is None:
        raise BadValueError("axis is not X, Y or Z")
    rotation = Gf.Rotation(Gf.Vec3d(0, 0, 1), Gf.Vec3d(*axis))
    solid.apply_transform(np.array(Gf.Matrix4d(rotation, Gf.Vec3d(0))).T)
    return solid


_MAKERS: dict[str, _Maker] = {
    "Cube": _cube,
    "Sphere": _sphere,
    "Cylinder": _cylinder,
    "Capsule": _capsule,
    "Cone": _cone,
}

"""Reads meshes of a stage as triangles with normals and texture coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray, IntArray
from envgen_usd.render.mesh_triangles import triangulate
from envgen_usd.render.render_scene import Floats, Geometry, Indices, Material, extent

_PER_POINT = {"vertex", "varying", "constant"}
_GREY = np.array([118, 118, 118, 255], np.uint8)


@dataclass(frozen=True)
class FaceGroup:
    """Faces of a mesh that share look and labels.

    Attributes:
        faces: F, True for the faces of the group; `None` means all faces.
        material: Index of the material.
        look: Material of the group.
    """

    faces: BoolArray | None
    material: int
    look: Material


@dataclass(frozen=True)
class _Primvar:
    """Values (N x k) with the index of each element of an interpolation, or `None` if in order."""

    values: FloatArray
    interpolation: str
    indices: IntArray | None

    def at(self, layout: "_Layout") -> FloatArray:
        """Values for each vertex of a layout: V x k."""
        if self.interpolation == "constant":
            place = np.zeros(len(layout.point), np.int64)
        elif self.interpolation == "uniform":
            place = layout.face
        elif self.interpolation == "faceVarying":
            place = layout.corner
        else:
            place = layout.point
        values: FloatArray = self.values[place if self.indices is None else self.indices[place]]
        return values


@dataclass(frozen=True)
class _Layout:
    """Point, corner and face of each vertex; corner and face only for split vertices."""

    point: IntArray
    corner: IntArray
    face: IntArray
    triangles: Indices


@dataclass(frozen=True)
class _Faces:
    points: FloatArray
    corners: IntArray
    triangles: IntArray
    face: IntArray
    count: int


class BadMeshError(ValueError):
    """The arrays of the mesh are inconsistent."""


def read_geometries(
    mesh: UsdGeom.Mesh, groups: Sequence[FaceGroup], time: Usd.TimeCode
) -> list[Geometry | None]:
    """Reads a mesh; returns a geometry for each group of faces, `None` without triangles.

    Polygons are triangulated, and left-handed faces are reversed. Without authored normals,
    polygonal meshes get flat normals and subdivision surfaces smooth normals (UsdGeomMesh:
    normals).

    Raises:
        BadMeshError: An index lies outside its array, or a point is not finite.
    """
    faces = _read_faces(mesh, time)
    normals = _normals(mesh, faces, time)
    return [_geometry(mesh, group, faces, normals, time) for group in groups]


def face_count(mesh: UsdGeom.Mesh, time: Usd.TimeCode) -> int:
    """Number of faces of a mesh."""
    return len(mesh.GetFaceVertexCountsAttr().Get(time) or ())


def _read_faces(mesh: UsdGeom.Mesh, time: Usd.TimeCode) -> _Faces:
    points = np.array(mesh.GetPointsAttr().Get(time) or (), np.float64).reshape(-1, 3)
    sizes = np.array(mesh.GetFaceVertexCountsAttr().Get(time) or (), np.int64)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get(time) or (), np.int64)
    if sizes.sum() != len(corners) or (sizes < 0).any():
        raise BadMeshError(
            f"{len(corners)} face vertex indices, but faceVertexCounts add up to {sizes.sum()}"
        )
    if len(corners) and (corners.min() < 0 or corners.max() >= len(points)):
        raise BadMeshError(f"face vertex indices outside the {len(points)} points")
    if not np.isfinite(points).all():
        bad = np.count_nonzero(~np.isfinite(points).all(axis=1))
        raise BadMeshError(f"{bad} of {len(points)} points are not finite")
    triangles, face = triangulate(points, sizes, corners)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        triangles = triangles[:, ::-1]
    return _Faces(points, corners, triangles, face, len(sizes))


def _normals(mesh: UsdGeom.Mesh, faces: _Faces, time: Usd.TimeCode) -> _Primvar | None:
    """Authored normals, smooth normals of a subdivision surface, or `None` for flat shading."""
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    if primvar and primvar.HasValue():
        return _primvar(primvar, 3, faces, time)
    values = mesh.GetNormalsAttr().Get(time)
    if values:
        normals = _Primvar(np.array(values, np.float64), mesh.GetNormalsInterpolation(), None)
        return normals if _fits(normals, faces) else None
    if mesh.GetSubdivisionSchemeAttr().Get() == UsdGeom.Tokens.none:
        return None
    return _Primvar(_smooth_normals(faces), "vertex", None)


def _smooth_normals(faces: _Faces) -> FloatArray:
    index = faces.corners[faces.triangles]  # T x 3
    weighted = _cross(faces.points[index])
    total = np.zeros_like(faces.points)
    for axis in range(3):
        per_corner = np.repeat(weighted[:, axis], 3)
        total[:, axis] = np.bincount(index.ravel(), per_corner, len(faces.points))
    return total


def _cross(corners: FloatArray) -> FloatArray:
    """Unnormalised normals, of twice the area, of triangles T x 3 x 3."""
    crossed: FloatArray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return crossed


def _primvar(
    primvar: UsdGeom.Primvar, width: int, faces: _Faces, time: Usd.TimeCode
) -> _Primvar | None:
    """A primvar's values, or `None` if they do not match the mesh."""
    raw = primvar.Get(time)
    values = np.array(raw if raw is not None else (), np.float64).reshape(-1, width)
    indices = np.array(primvar.GetIndices(time), np.int64) if primvar.IsIndexed() else None
    result = _Primvar(values, str(primvar.GetInterpolation()), indices)
    return result if _fits(result, faces) else None


def _fits(primvar: _Primvar, faces: _Faces) -> bool:
    needed = {"constant": 1, "uniform": faces.count, "faceVarying": len(faces.corners)}
    count = needed.get(primvar.interpolation, len(faces.points))
    if primvar.indices is None:
        return len(primvar.values) >= count
    inside = len(primvar.indices) == 0 or (
        primvar.indices.min() >= 0 and primvar.indices.max() < len(primvar.values)
    )
    return len(primvar.indices) >= count and bool(inside)


def _geometry(
    mesh: UsdGeom.Mesh,
    group: FaceGroup,
    faces: _Faces,
    normals: _Primvar | None,
    time: Usd.TimeCode,
) -> Geometry | None:
    keep = slice(None) if group.faces is None else group.faces[faces.face]
    triangles, owner = faces.triangles[keep], faces.face[keep]
    if not len(triangles):
        return None
    api = UsdGeom.PrimvarsAPI(mesh)
    textured = bool(group.look.textures)
    uvs = _find(api, group.look.uv_name, 2, faces, time) if textured else None
    colours = _find(api, "displayColor", 3, faces, time) if group.look.vertex_colour else None
    normals, uvs, colours = (_joined(p, faces, triangles) for p in (normals, uvs, colours))
    used = [p for p in (normals, uvs, colours) if p is not None]
    split = normals is None or any(p.interpolation not in _PER_POINT for p in used)
    layout = _split_layout(faces, triangles, owner) if split else _shared_layout(faces, triangles)
    points = faces.points[layout.point]
    unit = _flat(points) if normals is None else _unit(normals.at(layout))
    return Geometry(
        points=points,
        normals=unit,
        uvs=_texture_coordinates(uvs, layout, group.look),
        colours=_bytes(colours, layout),
        triangles=layout.triangles,
        material=group.material,
        double_sided=bool(mesh.GetDoubleSidedAttr().Get()),
    )


def _find(
    api: UsdGeom.PrimvarsAPI, name: str, width: int, faces: _Faces, time: Usd.TimeCode
) -> _Primvar | None:
    primvar = api.FindPrimvarWithInheritance(name)
    return _primvar(primvar, width, faces, time) if primvar and primvar.HasValue() else None


def _joined(primvar: _Primvar | None, faces: _Faces, triangles: IntArray) -> _Primvar | None:
    """Converts a faceVarying primvar to a vertex primvar, if the corners at each point agree.

    The triangles of smooth ground then share their vertices: a sixth of the split vertices.
    """
    if primvar is None or primvar.interpolation != "faceVarying":
        return primvar
    corner = triangles.reshape(-1)
    point = faces.corners[corner]
    index = corner if primvar.indices is None else primvar.indices[corner]
    chosen = np.zeros(len(faces.points), np.int64)
    chosen[point] = index
    agreed = chosen[point]
    if not (primvar.values[agreed] == primvar.values[index])[index != agreed].all():
        return primvar
    return _Primvar(primvar.values, "vertex", chosen)


def _split_layout(faces: _Faces, triangles: IntArray, owner: IntArray) -> _Layout:
    corner = triangles.reshape(-1)
    order = np.arange(len(corner), dtype=np.uint32).reshape(-1, 3)
    return _Layout(faces.corners[corner], corner, np.repeat(owner, 3), order)


def _shared_layout(faces: _Faces, triangles: IntArray) -> _Layout:
    index = faces.corners[triangles]
    used = np.zeros(len(faces.points), bool)
    used[index] = True
    place = (np.cumsum(used) - 1).astype(np.uint32)
    none = np.empty(0, np.int64)
    return _Layout(np.flatnonzero(used), none, none, place[index])


def _flat(points: FloatArray) -> Floats:
    return _unit(np.repeat(_cross(points.reshape(-1, 3, 3)), 3, axis=0))


def _unit(vectors: FloatArray) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit = np.where(length > 0, vectors / np.maximum(length, 1e-30), (0.0, 0.0, 1.0))
    unit_vectors: Floats = unit.astype(np.float32)
    return unit_vectors


def _texture_coordinates(uvs: _Primvar | None, layout: _Layout, look: Material) -> Floats:
    """Transformed texture coordinates; integer repeats are removed to keep precision."""
    if uvs is None:
        return np.zeros((len(layout.point), 2), np.float32)
    coordinates = uvs.at(layout)
    if look.uv_transform != Material.uv_transform:
        matrix = np.array(look.uv_transform)
        coordinates = coordinates @ matrix[:, :2].T + matrix[:, 2]
    if all(texture.repeat == (True, True) for texture in look.textures.values()):
        coordinates = coordinates - np.floor(extent(coordinates)[0])
    result: Floats = coordinates.astype(np.float32)
    return result


def _bytes(colours: _Primvar | None, layout: _Layout) -> ByteArray:
    """Linear colours as sRGB bytes: V x 4."""
    if colours is None:
        return np.broadcast_to(_GREY, (len(layout.point), 4))
    linear = np.clip(colours.at(layout), 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    result: NDArray[np.uint8] = np.full((len(linear), 4), 255, np.uint8)
    result[:, :3] = np.round(encoded * 255)
    return result

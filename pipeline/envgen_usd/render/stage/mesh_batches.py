"""Turns many meshes at once into triangles with normals and texture coordinates.

All arrays of the meshes are joined, so that each step is a single operation on long arrays.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray, IntArray
from envgen_usd.render.render_scene import Floats, Geometry, Indices, Material
from envgen_usd.render.stage.mesh_triangles import triangulate
from envgen_usd.render.stage.stage_meshes import FaceGroup, MeshArrays, Primvar

_GREY = np.array([118, 118, 118, 0], np.uint8)
_REPEATS = 256.0
"""Multiple of repeats that is removed from texture coordinates, as `texture_bombing.glsl` expects;
a larger value leaves less precision."""
_NONE, _PER_POINT, _PER_CORNER, _PER_FACE = range(4)
"""How a value varies: not there, with the point, with the corner, with the face."""
_RULES = {"faceVarying": _PER_CORNER, "uniform": _PER_FACE}


@dataclass(frozen=True)
class _Values:
    """A primvar of all meshes.

    Attributes:
        values: N x k.
        index: C, row of `values` at each corner of the meshes.
        rules: G, how the values of each group vary.
    """

    values: FloatArray
    index: IntArray
    rules: IntArray


@dataclass(frozen=True)
class _Joined:
    """The meshes of a batch in one; indices count over all meshes.

    Attributes:
        points: P x 3.
        corners: C, point of each corner.
        face_of: C, face of each corner.
        group_of: F, group of each face.
        mesh_of: G, mesh of each group.
        starts: M + 1 first points of the meshes.
    """

    points: FloatArray
    corners: IntArray
    face_of: IntArray
    group_of: IntArray
    mesh_of: IntArray
    starts: IntArray


@dataclass(frozen=True)
class _Corners:
    """Corners of the triangles, sorted by group.

    Attributes:
        corner: 3 T, corner of a mesh.
        group: 3 T.
        slot: 3 T, number of the corner's point within its group.
        slot_starts: G + 1, first slot of each group.
        point_of_slot: G, what is added to a slot to get its point.
    """

    corner: IntArray
    group: IntArray
    slot: IntArray
    slot_starts: IntArray
    point_of_slot: IntArray


@dataclass(frozen=True)
class _Layout:
    """Vertices, sorted by group within the shared ones and within the split ones.

    Attributes:
        point: V.
        group: V.
        slot: Slots of the shared vertices, which come first.
        corner: Corners of triangles of the split vertices, which come last.
        first: G, first vertex of each group.
        triangles: 3 T, vertices of the triangles, relative to those of their group.
    """

    point: IntArray
    group: IntArray
    slot: IntArray
    corner: IntArray
    first: IntArray
    triangles: Indices


def geometries_of(meshes: Sequence[MeshArrays]) -> list[list[Geometry | None]]:
    """A geometry for each group of faces of each mesh, `None` without triangles.

    Polygons are triangulated, and left-handed faces are reversed. Triangles share their vertices
    unless their values differ there.
    """
    if not meshes:
        return []
    joined = _joined(meshes)
    groups = [group for mesh in meshes for group in mesh.groups]
    sizes = np.concatenate([mesh.sizes for mesh in meshes])
    triangles, face = triangulate(joined.points, sizes, joined.corners)
    triangles = _oriented(triangles, joined.mesh_of[joined.group_of[face]], meshes)
    smooth = _smooth_normals(joined, triangles, joined.mesh_of[joined.group_of[face]], meshes)
    values = {
        "normals": _values(meshes, joined, lambda mesh, _: mesh.normals, 3, smooth),
        "uvs": _values(meshes, joined, _uvs_of, 2),
        "colours": _values(meshes, joined, _colours_of, 3),
    }
    corners = _corners(joined, triangles, face, len(groups))
    chosen = {name: _chosen(each, corners) for name, each in values.items()}
    flat = values["normals"].rules == _NONE
    split = flat.copy()
    for name, each in values.items():
        split |= _differs(each, chosen[name], corners)
    layout = _layout(joined, corners, split)
    rows = {
        name: np.concatenate((chosen[name][layout.slot], each.index[corners.corner[layout.corner]]))
        for name, each in values.items()
    }
    points = joined.points[layout.point]
    vertices: dict[str, NDArray[Any]] = {
        "points": points,
        "normals": _unit_normals(points, values["normals"].values, rows["normals"], flat, layout),
        "uvs": _texture_coordinates(values["uvs"], rows["uvs"], layout, groups),
        "colours": _bytes(values["colours"], rows["colours"], layout),
    }
    return _sliced(meshes, groups, corners, layout, vertices)


def _sliced(
    meshes: Sequence[MeshArrays],
    groups: Sequence[FaceGroup],
    corners: _Corners,
    layout: _Layout,
    vertices: dict[str, NDArray[Any]],
) -> list[list[Geometry | None]]:
    """Cuts the arrays into geometries, by mesh."""
    numbers = np.arange(len(groups) + 1)
    ends = np.searchsorted(corners.group, numbers).tolist()
    counts = np.bincount(layout.group, minlength=len(groups)).tolist()
    firsts = layout.first.tolist()
    result: list[list[Geometry | None]] = []
    number = 0
    for mesh in meshes:
        result.append([])
        for group in mesh.groups:
            chosen = slice(firsts[number], firsts[number] + counts[number])
            triangles = layout.triangles[ends[number] : ends[number + 1]].reshape(-1, 3)
            arrays = {name: values[chosen] for name, values in vertices.items()}
            cut = Geometry(
                **arrays,
                triangles=triangles,
                material=group.material,
                double_sided=mesh.double_sided,
            )
            result[-1].append(cut if len(triangles) else None)
            number += 1
    return result


def _joined(meshes: Sequence[MeshArrays]) -> _Joined:
    starts = _starts([len(mesh.points) for mesh in meshes])
    group_starts = _starts([len(mesh.groups) for mesh in meshes])
    sizes = np.concatenate([mesh.sizes for mesh in meshes])
    return _Joined(
        points=np.concatenate([mesh.points for mesh in meshes]),
        corners=np.concatenate(
            [mesh.corners + start for mesh, start in zip(meshes, starts, strict=False)]
        ),
        face_of=np.repeat(np.arange(len(sizes)), sizes),
        group_of=np.concatenate(
            [mesh.group_of + start for mesh, start in zip(meshes, group_starts, strict=False)]
        ),
        mesh_of=np.repeat(np.arange(len(meshes)), np.diff(group_starts)),
        starts=starts,
    )


def _starts(counts: Sequence[int]) -> IntArray:
    """0 and the running totals of counts."""
    starts: IntArray = np.cumsum([0, *counts])
    return starts


def _oriented(triangles: IntArray, mesh: IntArray, meshes: Sequence[MeshArrays]) -> IntArray:
    left = np.array([each.left_handed for each in meshes])[mesh]
    return np.where(left[:, None], triangles[:, ::-1], triangles) if left.any() else triangles


def _smooth_normals(
    joined: _Joined, triangles: IntArray, mesh: IntArray, meshes: Sequence[MeshArrays]
) -> FloatArray:
    """Normals by area at the points of smooth meshes (P x 3); empty without such meshes."""
    smooth = np.array([each.smooth for each in meshes])
    if not smooth.any():
        return np.empty((0, 3))
    index = joined.corners[triangles[smooth[mesh]]]  # T x 3
    weighted = cross(joined.points[index])
    total = np.zeros_like(joined.points)
    for axis in range(3):
        per_corner = np.repeat(weighted[:, axis], 3)
        total[:, axis] = np.bincount(index.ravel(), per_corner, len(total))
    return total


def cross(corners: FloatArray) -> FloatArray:
    """Unnormalised normals, of twice the area, of triangles T x 3 x 3."""
    crossed: FloatArray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return crossed


def _uvs_of(mesh: MeshArrays, group: FaceGroup) -> Primvar | None:
    return mesh.uvs.get(group.look.uv_name) if group.look.textures else None


def _colours_of(mesh: MeshArrays, group: FaceGroup) -> Primvar | None:
    return mesh.colours if group.look.vertex_colour or group.look.tinted else None


def _values(
    meshes: Sequence[MeshArrays],
    joined: _Joined,
    choose: Callable[[MeshArrays, FaceGroup], Primvar | None],
    width: int,
    per_point: FloatArray | None = None,
) -> _Values:
    """Joins a primvar of all meshes.

    Args:
        meshes: Meshes.
        joined: Their joined arrays.
        choose: Gives the primvar of a group.
        width: Number of columns.
        per_point: P x k, values of smooth meshes; `None` without values for each point.
    """
    per_point = np.empty((0, width)) if per_point is None else per_point
    values: list[FloatArray] = [np.zeros((1, width)), per_point]
    total = 1 + len(per_point)
    index = np.zeros(len(joined.corners), np.int64)
    rules = np.zeros(len(joined.mesh_of), np.int64)
    number, start = 0, 0
    for mesh, first in zip(meshes, joined.starts.tolist(), strict=False):
        own = slice(start, start + len(mesh.corners))
        start = own.stop
        wanted = [choose(mesh, group) for group in mesh.groups]
        for primvar in {id(each): each for each in wanted if each is not None}.values():
            rows = _rows(primvar, mesh, joined.face_of[own]) + total
            if len({id(each) for each in wanted if each is not None}) > 1:
                those = np.array([each is primvar for each in wanted])
                group = joined.group_of[joined.face_of[own]] - number
                rows = np.where(those[group], rows, index[own])
            index[own] = rows
            values.append(primvar.values)
            total += len(primvar.values)
        found = [_NONE if p is None else _RULES.get(p.interpolation, _PER_POINT) for p in wanted]
        if mesh.smooth and len(per_point):
            index[own] = mesh.corners + first + 1
            found = [_PER_POINT] * len(wanted)
        rules[number : number + len(wanted)] = found
        number += len(wanted)
    return _Values(np.concatenate(values), index, rules)


def _rows(primvar: Primvar, mesh: MeshArrays, face_of: IntArray) -> IntArray:
    """Row of a primvar's values at each corner of a mesh."""
    if primvar.interpolation == "constant":
        place = np.zeros(len(mesh.corners), np.int64)
    elif primvar.interpolation == "uniform":
        place = face_of - (face_of[0] if len(face_of) else 0)
    elif primvar.interpolation == "faceVarying":
        place = np.arange(len(mesh.corners))
    else:
        place = mesh.corners
    return place if primvar.indices is None else primvar.indices[place]


def _corners(joined: _Joined, triangles: IntArray, face: IntArray, groups: int) -> _Corners:
    group = joined.group_of[face]
    if (group[1:] < group[:-1]).any():
        order = np.argsort(group, kind="stable")
        triangles, group = triangles[order], group[order]
    slot_starts = _starts(np.diff(joined.starts)[joined.mesh_of].tolist())
    point_of_slot = joined.starts[joined.mesh_of] - slot_starts[:groups]
    corner, per_corner = triangles.reshape(-1), np.repeat(group, 3)
    slot = joined.corners[corner] - point_of_slot[per_corner]
    return _Corners(corner, per_corner, slot, slot_starts, point_of_slot)


def _chosen(values: _Values, corners: _Corners) -> IntArray:
    """Row of the values that each slot takes: that of its last corner."""
    chosen = np.zeros(int(corners.slot_starts[-1]), np.int64)
    if values.rules.any():
        chosen[corners.slot] = values.index[corners.corner]
    return chosen


def _differs(values: _Values, chosen: IntArray, corners: _Corners) -> BoolArray:
    """Groups whose triangles cannot share vertices, G: the values at a point differ.

    Values for each corner are often equal at the points of smooth ground; sharing them leaves a
    sixth of the vertices.
    """
    differs: BoolArray = values.rules == _PER_FACE
    per_corner = values.rules == _PER_CORNER
    if per_corner.any():
        index, agreed = values.index[corners.corner], chosen[corners.slot]
        other = np.flatnonzero((index != agreed) & per_corner[corners.group])
        unequal = (values.values[index[other]] != values.values[agreed[other]]).any(axis=1)
        differs[corners.group[other[unequal]]] = True
    return differs


def _layout(joined: _Joined, corners: _Corners, split: BoolArray) -> _Layout:
    cut = split[corners.group]
    used = np.zeros(int(corners.slot_starts[-1]), bool)
    used[corners.slot[~cut]] = True
    slot = np.flatnonzero(used)
    of_slot = np.searchsorted(corners.slot_starts, slot, side="right") - 1
    corner = np.flatnonzero(cut)
    group = np.concatenate((of_slot, corners.group[corner]))
    numbers = np.arange(len(split))
    first = np.where(
        split,
        len(slot) + np.searchsorted(corners.group[corner], numbers),
        np.searchsorted(of_slot, numbers),
    )
    place = np.cumsum(used) - 1
    vertex = place[corners.slot]
    vertex[corner] = len(slot) + np.arange(len(corner))
    point = np.concatenate(
        (slot + corners.point_of_slot[of_slot], joined.corners[corners.corner[corner]])
    )
    triangles = (vertex - first[corners.group]).astype(np.uint32)
    return _Layout(point, group, slot, corner, first, triangles)


def _unit_normals(
    points: FloatArray, values: FloatArray, rows: IntArray, flat: BoolArray, layout: _Layout
) -> Floats:
    normals = values[rows]
    facing = np.flatnonzero(flat[layout.group])
    if len(facing):
        normals[facing] = np.repeat(cross(points[facing].reshape(-1, 3, 3)), 3, axis=0)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = np.where(length > 0, normals / np.maximum(length, 1e-30), (0.0, 0.0, 1.0))
    unit_normals: Floats = unit.astype(np.float32)
    return unit_normals


def _texture_coordinates(
    values: _Values, rows: IntArray, layout: _Layout, groups: Sequence[FaceGroup]
) -> Floats:
    """Transformed texture coordinates; whole multiples of repeats are removed to keep precision."""
    coordinates = values.values[rows]
    absent = (values.rules == _NONE)[layout.group]
    coordinates[absent] = 0.0
    counts = np.bincount(layout.group, minlength=len(groups))
    for number, group in enumerate(groups):
        if group.look.uv_transform != Material.uv_transform and values.rules[number] != _NONE:
            matrix = np.array(group.look.uv_transform)
            own = slice(layout.first[number], layout.first[number] + counts[number])
            coordinates[own] = coordinates[own] @ matrix[:, :2].T + matrix[:, 2]
    starts = np.flatnonzero(np.diff(layout.group, prepend=-1))
    repeats = np.array([_repeats(group.look) for group in groups])[layout.group[starts]]
    counts = np.diff(starts, append=len(layout.group))
    for axis in range(2) if len(starts) else ():
        least = np.minimum.reduceat(coordinates[:, axis], starts)
        least = _REPEATS * np.floor(least / _REPEATS)
        coordinates[:, axis] -= np.repeat(np.where(repeats, least, 0.0), counts)
    result: Floats = coordinates.astype(np.float32)
    return result


def _repeats(look: Material) -> bool:
    return all(texture.repeat == (True, True) for texture in look.textures.values())


def _bytes(values: _Values, rows: IntArray, layout: _Layout) -> ByteArray:
    """Linear colours as sRGB bytes: V x 4."""
    coloured = np.flatnonzero((values.rules != _NONE)[layout.group])
    if not len(coloured):
        return np.broadcast_to(_GREY, (len(rows), 4))
    result: ByteArray = np.broadcast_to(_GREY, (len(rows), 4)).copy()
    result[coloured, :3] = srgb_bytes(values.values[rows[coloured]])
    result[coloured, 3] = 255
    return result


def srgb_bytes(linear: FloatArray) -> ByteArray:
    """Linear colours as bytes that are sRGB-encoded, of the same shape."""
    values = np.clip(linear, 0.0, 1.0)
    encoded = np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)
    result: ByteArray = np.round(encoded * 255).astype(np.uint8)
    return result

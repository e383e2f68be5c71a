"""Joins geometries into the primitives of a glTF mesh: one for each material and meaning."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from envgen_usd.exchange.gltf.binary_gltf import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, BinaryGltf
from envgen_usd.exchange.gltf.gltf_materials import GltfMaterials
from envgen_usd.exchange.gltf.y_up import turned
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Geometry, Material
from envgen_usd.render.stage.placed_parts import Part

_SHORT = 65535
"""Vertices up to which an index needs two bytes; glTF reserves the largest number."""


class Look(NamedTuple):
    """What the triangles of a primitive have in common.

    Attributes:
        material: Index of the look.
        double_sided: True if both sides are visible.
        label: Class, or `None`.
        part: Part of the object, or `None`.
    """

    material: int
    double_sided: bool
    label: str | None
    part: str | None


@dataclass(frozen=True, eq=False)
class Piece:
    """A geometry at its placements within a mesh.

    Attributes:
        geometry: Triangles.
        matrices: N x 4 x 4, to the space of the mesh, z up.
        label: Class, or `None`.
        part: Part of the object, or `None`.
    """

    geometry: Geometry
    matrices: FloatArray
    label: str | None
    part: str | None

    @classmethod
    def of(cls, part: Part, matrices: FloatArray | None = None) -> "Piece":
        """A placed part, perhaps at other placements."""
        geometry = part.slot.geometry
        assert geometry is not None
        places = part.matrices if matrices is None else matrices
        return cls(geometry, places, part.label, part.part)


def add_mesh(
    document: BinaryGltf,
    name: str,
    pieces: Iterable[Piece],
    materials: GltfMaterials,
) -> int | None:
    """Adds a mesh with all pieces; `None` without triangles."""
    groups: dict[Look, list[Piece]] = {}
    for piece in pieces:
        shape = piece.geometry
        key = Look(shape.material, shape.double_sided, piece.label, piece.part)
        groups.setdefault(key, []).append(piece)
    primitives = []
    for key, those in groups.items():
        look = materials.look(key.material)
        primitive = _primitive(document, those, look)
        if primitive is None:
            continue
        meaning = {"class": key.label, "part": key.part}
        primitive["material"] = materials.index(key.material, double_sided=key.double_sided)
        primitive["extras"] = {name: token for name, token in meaning.items() if token}
        primitives.append(primitive)
    return document.add("meshes", {"name": name, "primitives": primitives}) if primitives else None


def _primitive(
    document: BinaryGltf, pieces: list[Piece], look: Material
) -> dict[str, object] | None:
    """Attributes and indices of the joined pieces, without triangles of no area."""
    placed = [(piece.geometry, matrix) for piece in pieces for matrix in piece.matrices]
    counts = [len(shape.points) for shape, _ in placed]
    starts = np.cumsum([0, *counts])
    points = np.concatenate(
        [shape.points @ matrix[:3, :3].T + matrix[:3, 3] for shape, matrix in placed]
    )
    triangles = np.concatenate(
        [
            _facing(shape, matrix) + start
            for (shape, matrix), start in zip(placed, starts, strict=False)
        ]
    )
    if not len(triangles):
        return None
    positions = turned(points).astype(np.float32)
    attributes = {
        "POSITION": document.positions(positions),
        "NORMAL": document.accessor(_normals(placed), ARRAY_BUFFER),
    }
    if look.textures:
        uvs = np.concatenate([shape.uvs for shape, _ in placed])
        flipped = np.stack((uvs[:, 0], 1.0 - uvs[:, 1]), axis=1).astype(np.float32)
        attributes["TEXCOORD_0"] = document.accessor(flipped, ARRAY_BUFFER)
    if look.vertex_colour or look.tinted:
        colours = np.concatenate([shape.colours for shape, _ in placed])
        encoded = _linear(colours, plain=look.tinted)
        attributes["COLOR_0"] = document.accessor(encoded, ARRAY_BUFFER, normalized=True)
    kind = np.uint16 if len(positions) <= _SHORT else np.uint32
    indices = document.accessor(triangles.reshape(-1).astype(kind), ELEMENT_ARRAY_BUFFER)
    return {"attributes": attributes, "indices": indices}


def _facing(shape: Geometry, matrix: FloatArray) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """Triangles whose front stays the front under a mirroring matrix."""
    triangles = shape.triangles.astype(np.int64)
    return triangles[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0.0 else triangles


def _normals(
    placed: list[tuple[Geometry, FloatArray]],
) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    """Unit normals at the placements, y up."""
    turns = _cofactors(np.array([matrix[:3, :3] for _, matrix in placed]))
    normals = np.concatenate(
        [shape.normals @ turn for (shape, _), turn in zip(placed, turns, strict=True)]
    )
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = np.where(length > 1e-12, normals / np.maximum(length, 1e-12), (0.0, 0.0, 1.0))
    return turned(unit).astype(np.float32)


def _cofactors(linear: FloatArray) -> FloatArray:
    """For normals as rows: inverses (N x 3 x 3) but for a scale, also where there are none.

    Artists hide and flatten things by a scale of 0.
    """
    x, y, z = np.moveaxis(linear, -1, 0)
    rows = np.stack((np.cross(y, z), np.cross(z, x), np.cross(x, y)), axis=1)
    mirrors = np.where(np.linalg.det(linear) < 0.0, -1.0, 1.0)
    signed: FloatArray = rows * mirrors[:, None, None]
    return signed


def _linear(
    colours: np.ndarray[tuple[int, int], np.dtype[np.uint8]], *, plain: bool
) -> np.ndarray[tuple[int, int], np.dtype[np.uint16]]:
    """Linear colours in sixteen bits, V x 4.

    Args:
        colours: V x 4, sRGB-encoded, with 0 as the last value where the mesh has no colour.
        plain: True makes vertices without a colour white.
    """
    encoded = colours[:, :3] / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    if plain:
        linear[colours[:, 3] == 0] = 1.0
    full = np.column_stack((linear, np.ones(len(linear))))
    return np.round(full * 65535).astype(np.uint16)

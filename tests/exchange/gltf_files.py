"""Readers of glTF files and of stages that know nothing of our exporter."""

import json
import struct
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

TYPES = {5123: ("<u2", 2), 5125: ("<u4", 4), 5126: ("<f4", 4)}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass(frozen=True)
class Gltf:
    """A binary glTF file as its specification defines it."""

    content: dict[str, Any]
    buffer: bytes

    @classmethod
    def of(cls, path: Path) -> "Gltf":
        data = path.read_bytes()
        magic, version, size, length, kind = struct.unpack_from("<4sIII4s", data)
        assert (magic, version, size, kind) == (b"glTF", 2, len(data), b"JSON")
        count, kind = struct.unpack_from("<I4s", data, 20 + length)
        assert kind == b"BIN\0"
        assert 28 + length + count == size
        return cls(json.loads(data[20 : 20 + length]), data[28 + length :])

    def array(self, number: int) -> np.ndarray:
        accessor = self.content["accessors"][number]
        view = self.content["bufferViews"][accessor["bufferView"]]
        kind, _ = TYPES[accessor["componentType"]]
        width = WIDTHS[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        flat = np.frombuffer(self.buffer, kind, accessor["count"] * width, start)
        return flat.reshape(-1, width) if width > 1 else flat

    def nodes(self):
        """Every node of the scene with the translation, rotation and scale of its instances."""
        ahead = [(number, np.eye(4)) for number in self.content["scenes"][0]["nodes"]]
        while ahead:
            number, above = ahead.pop()
            node = self.content["nodes"][number]
            matrix = (
                above
                @ trs(
                    np.array([node.get("translation", (0, 0, 0))], float),
                    np.array([node.get("rotation", (0, 0, 0, 1))], float),
                    np.array([node.get("scale", (1, 1, 1))], float),
                )[0]
            )
            batch = node.get("extensions", {}).get("EXT_mesh_gpu_instancing")
            places = np.eye(4)[None]
            if batch:
                names = ("TRANSLATION", "ROTATION", "SCALE")
                places = trs(
                    *(self.array(batch["attributes"][name]).astype(float) for name in names)
                )
            yield node, matrix @ places
            ahead += [(child, matrix) for child in node.get("children", ())]


def trs(moves: np.ndarray, turns: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """Matrices of glTF's translations, quaternions (x, y, z, w) and scales (3.5.2)."""
    x, y, z, w = turns.T
    rotation = np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
            np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
            np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1),
        ],
        axis=1,
    )
    matrices = np.tile(np.eye(4), (len(moves), 1, 1))
    matrices[:, :3, :3] = rotation * scales[:, None, :]
    matrices[:, :3, 3] = moves
    return matrices


@dataclass
class Sums:
    """Triangles, area in square metres, and extent, by class."""

    triangles: dict[str, int]
    area: dict[str, float]
    low: np.ndarray
    high: np.ndarray


def sums_of_gltf(files: list[Path]) -> Sums:
    """What glTF files hold, in the axes of the stage."""
    sums = Sums(defaultdict(int), defaultdict(float), np.full(3, np.inf), np.full(3, -np.inf))
    for path in files:
        file = Gltf.of(path)
        origin = np.array(file.content["asset"]["extras"]["origin"])
        for node, places in file.nodes():
            if "mesh" not in node:
                continue
            for primitive in file.content["meshes"][node["mesh"]]["primitives"]:
                points = file.array(primitive["attributes"]["POSITION"]).astype(float)
                faces = file.array(primitive["indices"]).reshape(-1, 3)
                label = primitive["extras"].get("class", "")
                sums.triangles[label] += len(faces) * len(places)
                for place in places:
                    moved = points @ place[:3, :3].T + place[:3, 3]
                    moved = np.stack((moved[:, 0], -moved[:, 2], moved[:, 1]), 1) + origin
                    sums.area[label] += areas(moved[faces]).sum()
                    sums.low = np.minimum(sums.low, moved.min(axis=0))
                    sums.high = np.maximum(sums.high, moved.max(axis=0))
    return sums


def sums_of_stage(path: Path) -> Sums:
    """What OpenUSD itself says of a stage."""
    sums = Sums(defaultdict(int), defaultdict(float), np.full(3, np.inf), np.full(3, -np.inf))
    stage = Usd.Stage.Open(str(path))
    xforms = UsdGeom.XformCache()
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        mesh = UsdGeom.Mesh(prim)
        if not mesh or UsdGeom.Imageable(prim).ComputePurpose() not in {"default", "render"}:
            continue
        if UsdGeom.Imageable(prim).ComputeVisibility() == "invisible":
            continue
        matrix = np.array(xforms.GetLocalToWorldTransform(prim))
        points = np.array(mesh.GetPointsAttr().Get(), float) @ matrix[:3, :3] + matrix[3, :3]
        sizes = np.array(mesh.GetFaceVertexCountsAttr().Get())
        corners = np.array(mesh.GetFaceVertexIndicesAttr().Get())
        labels = np.full(len(sizes), label_of(prim), object)
        for subset in UsdGeom.Subset.GetAllGeomSubsets(mesh):
            labels[np.array(subset.GetIndicesAttr().Get())] = label_of(subset.GetPrim())
        starts = np.cumsum(sizes) - sizes
        for label, size in set(zip(labels.tolist(), sizes.tolist(), strict=True)):
            those = starts[(labels == label) & (sizes == size)]
            rings = points[corners[those[:, None] + np.arange(size)]]
            edges = rings - rings[:, :1]
            parts = np.cross(edges[:, 1:-1], edges[:, 2:]) / 2.0
            sums.triangles[label] += len(rings) * int(size - 2)
            # Quads of bodies are twisted, so that their triangles count; others may be concave.
            normals = parts if size == 4 else parts.sum(axis=1)
            sums.area[label] += np.linalg.norm(normals, axis=-1).sum()
        sums.low = np.minimum(sums.low, points.min(axis=0))
        sums.high = np.maximum(sums.high, points.max(axis=0))
    return sums


def label_of(prim: Usd.Prim) -> str:
    while prim:
        labels = prim.GetAttribute("semantics:labels:class").Get()
        if labels:
            return str(labels[0])
        prim = prim.GetParent()
    return ""


def areas(triangles: np.ndarray) -> np.ndarray:
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return np.linalg.norm(np.cross(first, second), axis=1) / 2.0

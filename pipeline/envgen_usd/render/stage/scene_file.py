"""Scenes as files: a record, and the arrays of all regions one after the other.

The arrays are mapped into memory, so that what nobody looks at is never read.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary, ref

import msgspec
import numpy as np
from numpy.typing import NDArray

from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.render.packed_layout import GROUP, VERTEX
from envgen_usd.render.render_scene import (
    Geometry,
    Lamps,
    Lane,
    Level,
    Material,
    Merged,
    SceneObject,
    Use,
)
from envgen_usd.render.stage.stage_regions import Content, Region

_DAMAGED = "render: the file of a cached stage is damaged; empty the cache"
_RECORD, _ARRAYS = "scene.msgpack", "arrays"
_POINT_COLUMNS = {
    "points": ("<f8", 3),
    "normals": ("<f4", 3),
    "uvs": ("<f4", 2),
    "colours": ("u1", 4),
}
_MERGED_COLUMNS = {"groups": (GROUP, 1), "vertices": (VERTEX, 1), "indices": ("<u4", 1)}
_COLUMNS: dict[str, tuple[Any, int]] = {
    **_POINT_COLUMNS,
    "triangles": ("<u4", 3),
    "matrices": ("<f8", 16),
    "scene_objects": ("<u4", 1),
    **_MERGED_COLUMNS,
}
"""Type and width of the rows of each array."""
_ALIGNMENT = 64
"""Bytes; each array starts at a multiple."""
_TABLES = 32
"""Regions whose tables are kept; more take more memory, and are read less often."""


@dataclass(frozen=True)
class SceneSummary:
    """A scene without geometry and light.

    Attributes:
        materials: Looks.
        scene_objects: Labels.
        lanes: Driving lanes.
        lamps: Lamps.
        issues: Warnings about prims.
    """

    materials: tuple[Material, ...]
    scene_objects: tuple[SceneObject, ...]
    lanes: tuple[Lane, ...]
    lamps: Lamps
    issues: tuple[Issue, ...]


@dataclass(frozen=True)
class LayerMark:
    """A layer that a scene follows from.

    Attributes:
        identifier: Name within USD.
        path: Resolved path.
        digest: SHA-256.
    """

    identifier: str
    path: str
    digest: bytes


@dataclass(frozen=True, slots=True)
class _Mesh:
    """Rows of a geometry in the arrays of its region."""

    first_point: int
    points: int
    first_triangle: int
    triangles: int
    material: int
    double_sided: bool


@dataclass(frozen=True, slots=True)
class _Placed:
    """A use: where its geometry lies, and the rows of its placements."""

    region: int
    mesh: int
    first: int
    count: int
    level: Level | None


@dataclass(frozen=True)
class _Tables:
    """Meshes of a region, what it places of them and of others, and numbers of merged rows."""

    meshes: list[_Mesh]
    uses: list[_Placed]
    merged: dict[str, int]


@dataclass(frozen=True)
class _Part:
    """A region: its corners, and the place of each array and of the tables in the file.

    Its tables are read with its arrays: those of a large map take more memory than all else.
    """

    number: int
    bounds: list[list[float]]
    size: int
    places: dict[str, int]
    tables: tuple[int, int]


@dataclass(frozen=True)
class _Record:
    """Content of the record."""

    layers: list[LayerMark]
    materials: list[Material]
    scene_objects: list[SceneObject]
    lanes: list[tuple[str, list[list[float]], tuple[str, ...]]]
    lamps: dict[str, Any]
    issues: list[Issue]
    parts: list[_Part]
    shared: list[tuple[int, int]]
    size: int
    note: bytes


class SceneWriter:
    """Writes a scene into a folder, region by region."""

    def __init__(self, folder: Path) -> None:
        """Starts the file of arrays."""
        self._folder = folder
        self._file = (folder / _ARRAYS).open("wb")
        self._parts: list[_Part] = []
        self._known: dict[int, tuple[ref[Geometry], int, int]] = {}
        self._shared: set[tuple[int, int]] = set()

    def add(self, region: Region, content: Content) -> None:
        """Writes a region; geometry of earlier regions is referred to."""
        own: list[Geometry] = []
        where = [self._place(each, region.number, own) for each in content.geometries]
        first, uses = 0, []
        for use in content.uses:
            uses.append(_Placed(*where[use.geometry], first, len(use.matrices), use.level))
            first += len(use.matrices)
        columns = {name: [getattr(mesh, name) for mesh in own] for name in _POINT_COLUMNS}
        columns["triangles"] = [mesh.triangles for mesh in own]
        columns["matrices"] = [use.matrices.reshape(-1, 16) for use in content.uses]
        columns["scene_objects"] = [use.scene_objects[:, None] for use in content.uses]
        merged = {name: getattr(content.merged, name) for name in _MERGED_COLUMNS}
        columns |= {name: [array] for name, array in merged.items()}
        places = {name: self._write(name, arrays) for name, arrays in columns.items()}
        self._shared.update(place for place in where if place[0] != region.number)
        start = self._file.tell()
        rows = {name: len(array) for name, array in merged.items()}
        length = self._file.write(msgspec.msgpack.encode(_Tables(_meshes(own), uses, rows)))
        bounds = region.bounds.tolist()
        self._parts.append(_Part(region.number, bounds, region.size, places, (start, length)))

    def finish(self, summary: SceneSummary, layers: Sequence[LayerMark], note: bytes = b"") -> None:
        """Writes the record, without which the folder holds no scene."""
        size = self._file.tell()
        self._file.close()
        record = _Record(
            layers=list(layers),
            materials=list(summary.materials),
            scene_objects=list(summary.scene_objects),
            lanes=[(lane.id, lane.points.tolist(), lane.successors) for lane in summary.lanes],
            lamps={name: array.tolist() for name, array in vars(summary.lamps).items()},
            issues=list(summary.issues),
            parts=self._parts,
            shared=sorted(self._shared),
            size=size,
            note=note,
        )
        (self._folder / _RECORD).write_bytes(msgspec.msgpack.encode(record))

    def close(self) -> None:
        """Ends the writing without a record."""
        self._file.close()

    def _place(self, geometry: Geometry, region: int, own: list[Geometry]) -> tuple[int, int]:
        known = self._known.get(id(geometry))
        if known is None or known[0]() is not geometry:
            known = self._known[id(geometry)] = ref(geometry), region, len(own)
            own.append(geometry)
        return known[1], known[2]

    def _write(self, name: str, arrays: Sequence[NDArray[Any]]) -> int:
        self._file.write(bytes(-self._file.tell() % _ALIGNMENT))
        place = self._file.tell()
        for array in arrays:
            self._file.write(np.ascontiguousarray(array, _COLUMNS[name][0]).data)
        return place


class StoredScene:
    """A scene of a folder; the file of arrays stays mapped, whatever becomes of the folder.

    Attributes:
        layers: Layers that it follows from.
        summary: The scene without geometry.
        base: What is in no payload.
        regions: Regions with geometry.
        note: What else the writer has stored.
    """

    def __init__(self, folder: Path) -> None:
        """Opens a scene.

        Raises:
            OSError: The folder holds no scene.
            msgspec.MsgspecError: The record is damaged.
            EnvgenError: The arrays are damaged.
        """
        record = msgspec.msgpack.decode((folder / _RECORD).read_bytes(), type=_Record)
        if (folder / _ARRAYS).stat().st_size != record.size:
            raise EnvgenError(_DAMAGED)
        self._data = np.asarray(np.memmap(folder / _ARRAYS, np.uint8, "r"))
        self._parts = {part.number: part for part in record.parts}
        self._meshes: WeakValueDictionary[tuple[int, int], Geometry] = WeakValueDictionary()
        self._tables = lru_cache(_TABLES)(self._read_tables)
        self._shared = set(record.shared)
        self.layers = tuple(record.layers)
        self.note = record.note
        self.summary = SceneSummary(
            materials=tuple(record.materials),
            scene_objects=tuple(record.scene_objects),
            lanes=tuple(
                Lane(name, np.array(points), successors)
                for name, points, successors in record.lanes
            ),
            lamps=_lamps(record.lamps),
            issues=tuple(record.issues),
        )
        regions = [Region(part.number, np.array(part.bounds), part.size) for part in record.parts]
        self.regions = tuple(region for region in regions if region.number)

    def content(self, number: int) -> Content:
        """Geometry of a region; 0 for what is in no payload."""
        part, tables = self._parts[number], self._tables(number)
        count = sum(use.count for use in tables.uses)
        matrices = self._rows(part, "matrices", 0, count).reshape(-1, 4, 4)
        names = self._rows(part, "scene_objects", 0, count).reshape(-1)
        own = self._own_meshes(part, tables.meshes)
        places: dict[tuple[int, int], int] = {}
        uses = []
        for use in tables.uses:
            place = places.setdefault((use.region, use.mesh), len(places))
            rows = slice(use.first, use.first + use.count)
            uses.append(Use(place, matrices[rows], names[rows], number, use.level))
        geometries = [own[key] if key in own else self._mesh(*key) for key in places]
        found = {name: self._rows(part, name, 0, rows) for name, rows in tables.merged.items()}
        merged = Merged(**{name: values[:, 0] for name, values in found.items()})
        return Content(tuple(geometries), tuple(uses), known=merged)

    def _read_tables(self, number: int) -> _Tables:
        start, length = self._parts[number].tables
        return msgspec.msgpack.decode(self._data[start : start + length].tobytes(), type=_Tables)

    def _own_meshes(self, part: _Part, own: Sequence[_Mesh]) -> dict[tuple[int, int], Geometry]:
        """The meshes of a region that no other region shares, as views of common arrays."""
        points = sum(mesh.points for mesh in own)
        columns = {name: self._rows(part, name, 0, points) for name in _POINT_COLUMNS}
        triangles = sum(mesh.triangles for mesh in own)
        columns["triangles"] = self._rows(part, "triangles", 0, triangles)
        meshes = {}
        for number, mesh in enumerate(own):
            if (part.number, number) not in self._shared:
                cut = {
                    name: values[slice(*_rows_of(mesh, name))] for name, values in columns.items()
                }
                meshes[part.number, number] = _geometry(mesh, cut)
        return meshes

    def _mesh(self, region: int, number: int) -> Geometry:
        """A mesh that regions share; each has the same object."""
        geometry = self._meshes.get((region, number))
        if geometry is None:
            part = self._parts[region]
            mesh = self._tables(region).meshes[number]
            columns = {}
            for name in (*_POINT_COLUMNS, "triangles"):
                first, end = _rows_of(mesh, name)
                columns[name] = self._rows(part, name, first, end - first)
            geometry = self._meshes[region, number] = _geometry(mesh, columns)
        return geometry

    def _rows(self, part: _Part, name: str, first: int, count: int) -> NDArray[Any]:
        kind, width = _COLUMNS[name]
        row = width * np.dtype(kind).itemsize
        start = part.places[name] + first * row
        data = self._data[start : start + count * row]
        if len(data) < count * row:
            raise EnvgenError(_DAMAGED)
        values: NDArray[Any] = data.view(kind).reshape(count, width)
        return values


def _rows_of(mesh: _Mesh, name: str) -> tuple[int, int]:
    """First row of a mesh in an array of its region, and the one after its last."""
    if name == "triangles":
        return mesh.first_triangle, mesh.first_triangle + mesh.triangles
    return mesh.first_point, mesh.first_point + mesh.points


def _geometry(mesh: _Mesh, columns: Mapping[str, NDArray[Any]]) -> Geometry:
    return Geometry(**columns, material=mesh.material, double_sided=mesh.double_sided)


def _meshes(geometries: Sequence[Geometry]) -> list[_Mesh]:
    meshes, point, triangle = [], 0, 0
    for each in geometries:
        counts = len(each.points), len(each.triangles)
        look = each.material, each.double_sided
        meshes.append(_Mesh(point, counts[0], triangle, counts[1], *look))
        point, triangle = point + counts[0], triangle + counts[1]
    return meshes


def _lamps(columns: Mapping[str, list[Any]]) -> Lamps:
    wide = {"places", "powers", "axes"}
    return Lamps(
        **{
            name: np.array(values, np.float64).reshape((-1, 3) if name in wide else -1)
            for name, values in columns.items()
        }
    )

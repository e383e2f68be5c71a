"""Reads geometry objects of CityJSON as arrays."""

import copy
import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from envgen_usd.chunks import snap
from envgen_usd.cityjson.cityjson_types import SURFACE_KINDS
from envgen_usd.cityjson.json_attributes import read_attributes
from envgen_usd.geometry.city_frame import Frame
from envgen_usd.geometry.flat_arrays import join, join_solids, turned
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons, ShellPath, Solids

Json = dict[str, Any]
Nested: TypeAlias = "int | list[Any] | None"
"""An index, a list of indices, or a nested list of indices."""
_DIGITS = 9
_ORIGIN = np.zeros(3)
_OWN = frozenset({"type", "id", "space", "parent", "children"})


@dataclass
class Shapes:
    """Geometry of a city object, or of a part of it.

    Attributes:
        surfaces: Surfaces with semantics.
        solid_lod: Level of detail at which the surfaces form a solid, or -1.
        geometry: Polygons without semantics, by CityGML property name.
        curves: Polylines, by CityGML property name.
        placement: Placement of a template, or `None`.
    """

    surfaces: list[ThematicSurface] = field(default_factory=list)
    solid_lod: int = -1
    geometry: dict[str, Polygons] = field(default_factory=dict)
    curves: dict[str, tuple[FloatArray, ...]] = field(default_factory=dict)
    placement: Placement | None = None

    def add(self, name: str, polygons: Polygons) -> None:
        """Adds polygons to those of the same property."""
        if name in self.geometry:
            both = [self.geometry[name], polygons]
            polygons = join_solids(both) if name.endswith("Solid") else join(both)
        self.geometry[name] = polygons

    def add_solids(self, solids: dict[int, list[Polygons]]) -> None:
        """Adds the solids that surfaces form; the finest needs no polygons besides them.

        Args:
            solids: By level of detail.
        """
        for level, members in solids.items():
            alone = len(members) == 1 and level == max(solids)
            if alone and f"lod{level}Solid" not in self.geometry:
                self.solid_lod = level
            else:
                for solid in members:
                    self.add(f"lod{level}Solid", solid)


class GeometryReader:
    """Reads geometry objects of a file.

    Attributes:
        coarser: Objects with several refinements of a level: their ids by the refinement that is
            left out and the finest one.
    """

    def __init__(self, file: Json, offset: FloatArray, frame: Frame | None = None) -> None:
        """Transforms the vertices of a file.

        Args:
            file: Top-level JSON object.
            offset: 3, metres, subtracted from coordinates.
            frame: Frame of coordinates that are not in metres, with the same offset.

        Raises:
            ValueError: Vertices are not finite, or their scale is not positive.
        """
        moved = vertices_of(file, offset) if frame is None else frame.place(vertices_of(file))
        if not np.isfinite(moved).all():
            raise ValueError("vertices are not finite, or lie outside their reference system")
        self._points: FloatArray = snap(moved)
        self._materials = [m["name"] for m in file.get("appearance", {}).get("materials", [])]
        self._templates = file.get("geometry-templates", {})
        self._mirrored = False
        self.coarser: dict[tuple[str, str], list[str]] = defaultdict(list)

    def read(self, objects: list[Json], name: str, *, shaped: bool) -> dict[str, Shapes]:
        """Returns geometry by the space that it belongs to; the object's geometry has the empty id.

        Of several refinements of a level (1.2 and 1.3) the finest is read.

        Args:
            objects: Geometry objects of a city object.
            name: Id of the city object; surfaces without an id derive theirs from it.
            shaped: True for the placed geometry of templates, false for a placement.
        """
        shapes: dict[str, Shapes] = {"": Shapes()}
        solids: dict[int, list[Polygons]] = defaultdict(list)
        shown = [
            self._templates["templates"][item["template"]]
            if shaped and item["type"] == "GeometryInstance"
            else item
            for item in objects
        ]
        for number in self._finest(shown, name):
            item = objects[number]
            if item["type"] != "GeometryInstance":
                self._add(item, f"{name}_{number}", shapes, solids)
            elif shaped:
                self._instance(item)._add(shown[number], f"{name}_{number}", shapes, solids)
            else:
                shapes[""].placement = self._placement(item)
        shapes[""].add_solids(solids)
        return shapes

    def _finest(self, objects: list[Json], name: str) -> list[int]:
        """Indices of the geometry objects without a finer one of the same level."""
        finest: dict[tuple[int, bool], Json] = {}
        for item in objects:
            if "lod" in item and _degree(item) > _degree(finest.get(_family(item))):
                finest[_family(item)] = item
        kept = []
        for number, item in enumerate(objects):
            best = finest.get(_family(item)) if "lod" in item else None
            if best is None or _degree(item) == _degree(best):
                kept.append(number)
            else:
                self.coarser[str(item["lod"]), str(best["lod"])].append(name)
        return kept

    def _add(
        self, item: Json, name: str, shapes: dict[str, Shapes], solids: dict[int, list[Polygons]]
    ) -> None:
        """Adds a geometry object other than an instance to the shapes."""
        if item["type"] == "MultiLineString":
            self._lines(item, shapes)
        elif item["type"] != "MultiPoint":
            rows = list(_flat(item))
            semantics = (item.get("semantics") or {}).get("surfaces", [])
            self._thematic(item, name, rows, shapes)
            is_solid = item["type"].endswith("Solid")
            rest = [row for row in rows if row.surface is None or not semantics]
            whole = self._solids(item, rows) if is_solid else self._polygons(rest)
            if is_solid and not rest and not isinstance(whole, Solids):
                solids[_level(item)].append(whole)
            elif is_solid or rest or not semantics:
                kind = "Solid" if is_solid else "MultiSurface"
                shapes[""].add(f"lod{_level(item)}{kind}", whole)

    def _instance(self, item: Json) -> "GeometryReader":
        """A reader whose vertices are those of a template, placed as the instance."""
        matrix = np.array(item["transformationMatrix"], dtype=np.float64).reshape(4, 4)
        local = np.array(self._templates["vertices-templates"], dtype=np.float64).reshape(-1, 3)
        moved = local @ matrix[:3, :3].T + matrix[:3, 3] + self._points[item["boundaries"][0]]
        if not np.isfinite(moved).all():
            raise ValueError("vertices of templates are not finite")
        placed = copy.copy(self)
        placed._points = snap(moved)
        placed._mirrored = bool(np.linalg.det(matrix[:3, :3]) < 0)
        return placed

    def _lines(self, item: Json, shapes: dict[str, Shapes]) -> None:
        semantics = item.get("semantics", {}).get("surfaces", [{}])[:1]
        space = semantics[0].get("space", "") if semantics else ""
        curves = tuple(self._points[line] for line in item["boundaries"])
        known = shapes.setdefault(space, Shapes()).curves
        known[f"lod{_level(item)}MultiCurve"] = (
            *known.get(f"lod{_level(item)}MultiCurve", ()),
            *curves,
        )

    def _thematic(
        self, item: Json, name: str, rows: list["_Row"], shapes: dict[str, Shapes]
    ) -> None:
        """Adds the surfaces of a geometry object's semantics."""
        semantics = (item.get("semantics") or {}).get("surfaces", [])
        members: dict[int | None, list[_Row]] = defaultdict(list)
        materials: dict[int | None, str] = {}
        for row in rows:
            members[row.surface].append(row)
            if row.material is not None:
                materials[row.surface] = self._materials[row.material]
        for index, semantic in enumerate(semantics):
            if "parent" not in semantic:
                surface = self._surface(index, semantics, members, materials, (name, _level(item)))
                shapes.setdefault(semantic.get("space", ""), Shapes()).surfaces.append(surface)

    def _surface(
        self,
        index: int,
        semantics: list[Json],
        members: dict[int | None, list["_Row"]],
        materials: dict[int | None, str],
        where: tuple[str, int],
    ) -> ThematicSurface:
        semantic = semantics[index]
        openings = tuple(
            self._surface(child, semantics, members, materials, where)
            for child in semantic.get("children", [])
        )
        return ThematicSurface(
            id=semantic.get("id", f"{where[0]}_{index}"),
            kind=SURFACE_KINDS.get(semantic["type"], "GenericThematicSurface"),
            polygons=self._polygons(members.get(index, [])),
            lod=where[1],
            material=materials.get(index, ""),
            attributes=read_attributes(
                {key: value for key, value in semantic.items() if key not in _OWN}
            ),
            openings=openings,
        )

    def _polygons(self, rows: list["_Row"]) -> Polygons:
        rings = [ring for row in rows for ring in row.rings]
        ends = np.cumsum([0, *(len(ring) for ring in rings)])
        indices = np.array([index for ring in rings for index in ring], dtype=np.int64)
        if len(indices) and indices.min() < 0:
            raise ValueError(f"vertex {indices.min()} does not exist")
        owners = np.cumsum([0, *(len(row.rings) for row in rows)])
        faces = Polygons(self._points[indices], ends.astype(np.int64), owners.astype(np.int64))
        return turned(faces) if self._mirrored else faces

    def _solids(self, item: Json, rows: list["_Row"]) -> Polygons:
        composite = item["type"] == "CompositeSolid"
        return Solids.of_shells(
            self._polygons(rows), [row.shell for row in rows], composite=composite
        )

    def _placement(self, item: Json) -> Placement:
        matrix = np.array(item["transformationMatrix"], dtype=np.float64).reshape(4, 4)
        lengths = np.linalg.norm(matrix[:3, :3], axis=0)
        turn = matrix[:3, :3] / np.where(lengths > 0, lengths, 1.0)
        heading, down, roll = Rotation.from_matrix(turn).as_euler("ZYX").tolist()
        extent, foot = self._template_box(item["template"])
        position = self._points[item["boundaries"][0]] + matrix[:3, :3] @ foot + matrix[:3, 3]
        return Placement(
            position=snap(position),
            heading=round(heading, _DIGITS),
            size=lengths * extent,
            template="",
            pitch=round(-down, _DIGITS) + 0.0,
            roll=round(roll, _DIGITS),
        )

    def _template_box(self, index: int) -> tuple[FloatArray, FloatArray]:
        """Extent of a template, and the centre of its base."""
        used = sorted(set(_integers(self._templates["templates"][index]["boundaries"])))
        points = np.array(self._templates["vertices-templates"], dtype=np.float64)[used]
        low, high = points.min(axis=0), points.max(axis=0)
        middle = (low + high) / 2
        return high - low, np.array([middle[0], middle[1], low[2]])


def vertices_of(file: Json, offset: FloatArray = _ORIGIN) -> FloatArray:
    """Returns the vertices of a file less an offset, V x 3, in units of its reference system.

    Raises:
        ValueError: The scale is not positive.
    """
    transform = file.get("transform", {"scale": [1, 1, 1], "translate": [0, 0, 0]})
    places = np.array(file.get("vertices", []), dtype=np.float64).reshape(-1, 3)
    scale = np.array(transform["scale"], dtype=np.float64)
    if not (scale > 0).all():
        raise ValueError(f"the scale {scale.tolist()} is not positive")
    # Division by an integer gives the same numbers as `chunks.snap`.
    parts = np.maximum(np.round(1 / scale), 1.0)
    exact = np.where(np.isclose(1 / scale, parts), places / parts, places * scale)
    moved: FloatArray = exact + (np.array(transform["translate"], dtype=np.float64) - offset)
    return moved


def _level(item: Json) -> int:
    """Level of detail without its refinement: 2.2 becomes 2; 4 of older files becomes 3."""
    return min(math.floor(float(item["lod"])), 3)


def _degree(item: Json | None) -> float:
    """Level of detail with its refinement; below all levels without an object."""
    return -1.0 if item is None else float(item["lod"])


def _family(item: Json) -> tuple[int, bool]:
    """Geometry objects that represent the same at several refinements."""
    return _level(item), item["type"] == "MultiLineString"


def _integers(nested: Nested) -> Iterator[int]:
    if isinstance(nested, int):
        yield nested
    for item in nested if isinstance(nested, list) else ():
        yield from _integers(item)


@dataclass(frozen=True)
class _Row:
    """A polygon of a geometry object.

    Attributes:
        rings: Vertices of its rings.
        surface: Index of its semantics, or `None`.
        material: Index of its material, or `None`.
        shell: Number of its solid, and number of its shell; zeros outside solids.
    """

    rings: list[list[int]]
    surface: int | None
    material: int | None
    shell: ShellPath


_DEPTH = {
    "MultiSurface": 0,
    "CompositeSurface": 0,
    "Solid": 1,
    "MultiSolid": 2,
    "CompositeSolid": 2,
}
"""Levels of lists around the polygons of each type."""


def _flat(item: Json) -> Iterator[_Row]:
    """Each polygon of a geometry object."""
    depth = _DEPTH[item["type"]]
    values = (item.get("semantics") or {}).get("values")
    theme: Json = next(iter((item.get("material") or {}).values()), {})
    materials = theme.get("values", theme.get("value"))
    yield from _nested(item["boundaries"], values, materials, depth, ())


def _nested(
    boundaries: list[Any], values: Nested, materials: Nested, depth: int, path: tuple[int, ...]
) -> Iterator[_Row]:
    for place, member in enumerate(boundaries):
        value = values[place] if isinstance(values, list) else values
        material = materials[place] if isinstance(materials, list) else materials
        if depth:
            yield from _nested(member, value, material, depth - 1, (*path, place))
        else:
            solid, shell = (0, 0, *path)[-2:]
            yield _Row(member, _index(value), _index(material), (solid, shell))


def _index(value: Nested) -> int | None:
    if isinstance(value, list):
        raise TypeError(f"{value} is not an index of a surface or a material")
    return value

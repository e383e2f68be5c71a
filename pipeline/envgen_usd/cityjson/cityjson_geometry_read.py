"""Reads geometry objects of CityJSON as arrays."""

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from envgen_usd.chunks import snap
from envgen_usd.cityjson.cityjson_types import SURFACE_KINDS
from envgen_usd.cityjson.json_attributes import read_attributes
from envgen_usd.geometry.flat_arrays import turned
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

Json = dict[str, Any]
Nested: TypeAlias = "int | list[Any] | None"
"""An index, a list of indices, or a nested list of indices."""
_DIGITS = 9
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


class GeometryReader:
    """Reads geometry objects of a file."""

    def __init__(self, file: Json, offset: FloatArray) -> None:
        """Transforms the vertices of a file.

        Args:
            file: Top-level JSON object.
            offset: 3, metres, subtracted from coordinates.

        Raises:
            ValueError: Vertices are not finite, or their scale is not positive.
        """
        transform = file.get("transform", {"scale": [1, 1, 1], "translate": [0, 0, 0]})
        places = np.array(file.get("vertices", []), dtype=np.float64).reshape(-1, 3)
        scale = np.array(transform["scale"], dtype=np.float64)
        # Division by an integer gives the same numbers as `chunks.snap`.
        if not (scale > 0).all():
            raise ValueError(f"the scale {scale.tolist()} is not positive")
        parts = np.maximum(np.round(1 / scale), 1.0)
        exact = np.where(np.isclose(1 / scale, parts), places / parts, places * scale)
        moved = exact + (np.array(transform["translate"], dtype=np.float64) - offset)
        if not np.isfinite(moved).all():
            raise ValueError("vertices are not finite")
        self._points: FloatArray = snap(moved)
        self._materials = [m["name"] for m in file.get("appearance", {}).get("materials", [])]
        self._templates = file.get("geometry-templates", {})
        self._mirrored = False

    def read(self, objects: list[Json], name: str, *, shaped: bool) -> dict[str, Shapes]:
        """Returns geometry by the space that it belongs to; the object's geometry has the empty id.

        Args:
            objects: Geometry objects of a city object.
            name: Id of the city object; surfaces without an id derive theirs from it.
            shaped: True for the placed geometry of templates, false for a placement.
        """
        shapes: dict[str, Shapes] = {"": Shapes()}
        for number, item in enumerate(objects):
            if item["type"] != "GeometryInstance":
                self._add(item, f"{name}_{number}", shapes)
            elif shaped:
                template = self._templates["templates"][item["template"]]
                self._instance(item)._add(template, f"{name}_{number}", shapes)
            else:
                shapes[""].placement = self._placement(item)
        return shapes

    def _add(self, item: Json, name: str, shapes: dict[str, Shapes]) -> None:
        """Adds a geometry object other than an instance to the shapes."""
        if item["type"] == "MultiLineString":
            self._lines(item, shapes)
        elif item.get("semantics"):
            self._thematic(item, name, shapes)
        elif item["type"] != "MultiPoint":
            self._plain(item, shapes[""])

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
        shapes.setdefault(space, Shapes()).curves[f"lod{_level(item)}MultiCurve"] = curves

    def _plain(self, item: Json, shapes: Shapes) -> None:
        polygons = self._polygons([rings for rings, _, _ in _flat(item)])
        is_solid = item["type"].endswith("Solid")
        shapes.geometry[f"lod{_level(item)}{'Solid' if is_solid else 'MultiSurface'}"] = polygons

    def _thematic(self, item: Json, name: str, shapes: dict[str, Shapes]) -> None:
        semantics = item["semantics"]["surfaces"]
        members: dict[int | None, list[Any]] = {}
        materials: dict[int | None, str] = {}
        for rings, value, material in _flat(item):
            members.setdefault(value, []).append(rings)
            if material is not None:
                materials[value] = self._materials[material]
        for index, semantic in enumerate(semantics):
            if "parent" not in semantic:
                surface = self._surface(index, semantics, members, materials, (name, _level(item)))
                shapes.setdefault(semantic.get("space", ""), Shapes()).surfaces.append(surface)
        if item["type"] == "Solid":
            shapes[""].solid_lod = _level(item)
        if None in members:
            rest = self._polygons(members[None])
            shapes[""].geometry[f"lod{_level(item)}MultiSurface"] = rest

    def _surface(
        self,
        index: int,
        semantics: list[Json],
        members: dict[int | None, list[Any]],
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

    def _polygons(self, members: list[list[list[int]]]) -> Polygons:
        rings = [ring for polygon in members for ring in polygon]
        ends = np.cumsum([0, *(len(ring) for ring in rings)])
        indices = np.array([index for ring in rings for index in ring], dtype=np.int64)
        if len(indices) and indices.min() < 0:
            raise ValueError(f"vertex {indices.min()} does not exist")
        owners = np.cumsum([0, *(len(polygon) for polygon in members)])
        faces = Polygons(self._points[indices], ends.astype(np.int64), owners.astype(np.int64))
        return turned(faces) if self._mirrored else faces

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


def _level(item: Json) -> int:
    """Level of detail without its refinement: 2.2 becomes 2; 4 of older files becomes 3."""
    return min(math.floor(float(item["lod"])), 3)


def _integers(nested: Nested) -> Iterator[int]:
    if isinstance(nested, int):
        yield nested
    for item in nested if isinstance(nested, list) else ():
        yield from _integers(item)


_DEPTH = {
    "MultiSurface": 0,
    "CompositeSurface": 0,
    "Solid": 1,
    "MultiSolid": 2,
    "CompositeSolid": 2,
}


def _flat(item: Json) -> Iterator[tuple[list[list[int]], int | None, int | None]]:
    """Each polygon with the index of its semantics and of its material."""
    depth = _DEPTH[item["type"]]
    values = (item.get("semantics") or {}).get("values")
    theme: Json = next(iter((item.get("material") or {}).values()), {})
    materials = theme.get("values", theme.get("value"))
    yield from _nested(item["boundaries"], values, materials, depth)


def _nested(
    boundaries: list[Any], values: Nested, materials: Nested, depth: int
) -> Iterator[tuple[list[list[int]], int | None, int | None]]:
    for place, member in enumerate(boundaries):
        value = values[place] if isinstance(values, list) else values
        material = materials[place] if isinstance(materials, list) else materials
        if depth:
            yield from _nested(member, value, material, depth - 1)
        else:
            yield member, value, material

"""Validates the geometry of CityJSON files against ISO 19107."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.cityjson.cityjson_geometry_read import Json, Nested
from envgen_usd.cityjson.read import MISFITS, city_of, load_cityjson
from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.iso19107.body_collection import (
    BodyCollection,
    Membership,
    Place,
    role_of,
)
from envgen_usd.geometry.iso19107.fault_report import body_issues
from envgen_usd.models.array_types import FloatArray


def cityjson_issues(path: Path) -> tuple[Issue, ...]:
    """Returns objects that violate CityJSON, and the faults of all polygons and solids.

    Vertices are taken as they are, without rounding. A template is checked once, with the scale of
    its first instance.

    Args:
        path: CityJSON 1.0, 1.1 or 2.0, or CityJSONSeq.

    Raises:
        EnvgenError: The file is missing, is not CityJSON, or has no readable object.
    """
    file, features = load_cityjson(path)
    # What the reader leaves out of a valid file is no fault of the file.
    read = city_of(path, file, features).issues
    issues = tuple(issue for issue in read if issue.severity is Severity.ERROR)
    reader = _BodyReader({issue.where for issue in issues})
    for number, part in enumerate([file, *features]):
        # A feature shares all members of the first line except objects and vertices.
        reader.add_part({**file, **part} if number else part)
    reader.add_templates(file.get("geometry-templates", {}))
    return (*issues, *body_issues(reader.bodies, reader.bodies.bodies()))


class _BodyReader:
    """Collects the bodies of a file.

    Attributes:
        bodies: All bodies, metres.
    """

    def __init__(self, known: set[str]) -> None:
        """Starts with the names of objects whose violations are known."""
        self.bodies = BodyCollection()
        self._known = known
        self._matrices: dict[int, FloatArray] = {}
        self._composites = 0

    def add_part(self, part: Json) -> None:
        """Adds the bodies of all objects of a file, or of a feature of a sequence."""
        try:
            points = np.array(part.get("vertices", []), dtype=np.float64).reshape(-1, 3)
            # Far from the origin, the figures would lose digits; a middle place is no outlier.
            points = points - np.sort(points, axis=0)[len(points) // 2] if len(points) else points
            points *= np.array(part.get("transform", {}).get("scale", [1, 1, 1]), dtype=np.float64)
            items: Json = part["CityObjects"]
        except MISFITS:
            # The reader has reported this feature.
            return
        for name, item in items.items():
            try:
                self._add_object(name, items, points)
            except MISFITS as error:
                if name not in self._known:
                    place = Place(f"{item.get('type', '')}[{name}]")
                    self.bodies.issues.append(place.fault(901, repr(error)))

    def add_templates(self, templates: Json) -> None:
        """Adds the bodies of the templates of a file."""
        place = Place("geometry-templates")
        try:
            local = np.array(templates.get("vertices-templates", []), dtype=np.float64)
            for number, template in enumerate(templates.get("templates", [])):
                place = Place(f"template[{number}]")
                matrix = self._matrices.get(number, np.eye(3))
                target = _Target(place, local.reshape(-1, 3) @ matrix.T, np.linalg.det(matrix) < 0)
                self._add_geometry(template, target, Membership())
        except MISFITS as error:
            self.bodies.issues.append(place.fault(901, repr(error)))

    def _add_object(self, name: str, items: Json, points: FloatArray) -> None:
        item = items[name]
        target = _Target(Place(f"{item['type']}[{name}]"), points)
        around = _around(name, items)
        kinds = [items[each]["type"] for each in around]
        building = kinds.index("Building") if "Building" in kinds else -1
        for geometry in item.get("geometry", []):
            if geometry["type"] == "GeometryInstance":
                matrix = np.array(geometry["transformationMatrix"], dtype=np.float64)
                self._matrices.setdefault(geometry["template"], matrix.reshape(4, 4)[:3, :3])
                continue
            member = Membership()
            if building >= 0:
                role = role_of(str(geometry.get("lod", "")), kinds[:building])
                member = Membership(around[building], role)
            self._add_geometry(geometry, target, member)

    def _add_geometry(self, geometry: Json, target: "_Target", member: Membership) -> None:
        kind, boundaries = geometry["type"], geometry["boundaries"]
        values = (geometry.get("semantics") or {}).get("values")
        surfaces = (geometry.get("semantics") or {}).get("surfaces", [])
        reader = _GeometryReader(self.bodies, target, surfaces)
        if kind == "MultiSurface":
            reader.add_surfaces(boundaries, values, shell=-1)
        elif kind == "CompositeSurface":
            reader.add_surfaces(boundaries, values, self.bodies.add_shell(target.place))
        elif kind == "Solid":
            reader.add_solid(boundaries, values, member)
        elif kind in ("MultiSolid", "CompositeSolid"):
            self._composites += kind == "CompositeSolid"
            composite = self._composites if kind == "CompositeSolid" else -1
            member = Membership(member.building, member.role, composite)
            for solid, inner in _with(boundaries, values):
                reader.add_solid(solid, inner, member)


@dataclass(frozen=True)
class _Target:
    """What a geometry describes.

    Attributes:
        place: The object or template.
        points: V x 3, vertices in metres.
        mirrored: Whether the vertices of a template are mirrored, which reverses its faces.
    """

    place: Place
    points: FloatArray
    mirrored: bool = False


class _GeometryReader:
    """Collects the bodies of a geometry object."""

    def __init__(self, bodies: BodyCollection, target: _Target, surfaces: list[Json]) -> None:
        self._bodies = bodies
        self._place = target.place
        self._points = target.points
        self._step = -1 if target.mirrored else 1
        self._surfaces = surfaces
        self._count = 0

    def add_solid(self, boundaries: list[Any], values: Nested, member: Membership) -> None:
        """Adds a solid: shells of polygons of rings, and the surface of each polygon."""
        solid = self._bodies.add_solid(member)
        for shell, inner in _with(boundaries, values):
            if not shell:
                self._bodies.issues.append(self._place.fault(902))
            self.add_surfaces(shell, inner, self._bodies.add_shell(self._place, solid))

    def add_surfaces(self, boundaries: list[Any], values: Nested, shell: int) -> None:
        """Adds polygons of rings, and the surface of each."""
        for rings, value in _with(boundaries, values):
            surface = self._surfaces[value] if isinstance(value, int) else {}
            named = f"{surface['type']}[{surface['id']}]" if "id" in surface else ""
            where = named or self._place.feature
            place = Place(where, f"polygon {self._count}")
            self._count += 1
            if not rings:
                self._bodies.issues.append(place.fault(902))
                continue
            if min(min(ring, default=0) for ring in rings) < 0:
                raise IndexError(f"polygon {self._count - 1} has a negative vertex")
            coordinates = [self._points[ring[:: self._step]].ravel().tolist() for ring in rings]
            self._bodies.add_polygon(place, coordinates, shell)


def _around(name: str, items: Json) -> list[str]:
    """An object and all objects around it, the innermost first."""
    names = [name]
    while parents := items[names[-1]].get("parents"):
        if parents[0] in names or parents[0] not in items:
            break
        names.append(parents[0])
    return names


def _with(boundaries: list[Any], values: Nested) -> Iterator[tuple[Any, Nested]]:
    """Each part of boundaries with its part of the nested indices of semantics."""
    for number, part in enumerate(boundaries):
        yield part, values[number] if isinstance(values, list) else values

"""Polygons and solids of a CityGML file, unrepaired, for validation."""

import math
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np
from lxml import etree

from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.iso19107.body_collection import (
    BodyCollection,
    Membership,
    Place,
    role_of,
)
from envgen_usd.models.array_types import FloatArray
from envgen_usd.xml_events import local_name

_HREF = "{http://www.w3.org/1999/xlink}href"
_GML = "http://www.opengis.net/gml"
_POLYGONS = ("Polygon", "Triangle", "Rectangle")
_BOUNDARIES = ("exterior", "interior")
_RINGS = ("exterior", "interior", "outerBoundaryIs", "innerBoundaryIs")


@dataclass(frozen=True)
class _Target:
    """Where bodies go: the collection, and the matrix (3 x 3) of the template."""

    collection: BodyCollection
    matrix: FloatArray

    @property
    def mirrored(self) -> bool:
        """Whether the matrix reverses the orientation of faces."""
        return bool(np.linalg.det(self.matrix) < 0)

    def scaled(self, numbers: list[float]) -> list[float]:
        """Coordinates of a ring after the matrix."""
        if (self.matrix == np.eye(3)).all():
            return numbers
        scaled: list[float] = (np.array(numbers).reshape(-1, 3) @ self.matrix.T).ravel().tolist()
        return scaled


@dataclass
class BodyReader:
    """Collects the bodies of many features.

    Attributes:
        placed: Bodies in the coordinates of the file.
        templates: Bodies of implicit geometry, scaled and turned by its matrix, metres.
    """

    placed: BodyCollection = field(default_factory=BodyCollection)
    templates: BodyCollection = field(default_factory=BodyCollection)
    _composites: int = 0

    def add(self, feature: etree._Element, shared: Mapping[str, etree._Element]) -> None:
        """Collects the bodies of a top-level feature.

        Args:
            feature: Top-level feature with all its parts.
            shared: Elements of other features that this feature may reference, by id.
        """
        ids = {name: element for element in feature.iter() if (name := _id(element))}
        ids = {**shared, **ids}
        composites = dict[etree._Element, int]()
        for composite in feature.iter("{*}CompositeSolid"):
            composites[composite] = self._composites = self._composites + 1
        used: set[etree._Element] = set()
        for solid in feature.iter("{*}Solid"):
            used |= self._add_solid(solid, ids, composites)
        for surface in feature.iter("{*}CompositeSurface"):
            if _first_above(surface, (*_BOUNDARIES, "CompositeSurface")) is None:
                target = self._target_of(surface)
                shell = target.collection.add_shell(_place(surface))
                used |= _add_members(target, surface, ids, shell)
        for polygon in feature.iter(*(f"{{*}}{name}" for name in _POLYGONS)):
            if polygon not in used:
                _add_polygon(self._target_of(polygon), polygon, turned=False, shell=-1)

    def _add_solid(
        self,
        solid: etree._Element,
        ids: Mapping[str, etree._Element],
        composites: Mapping[etree._Element, int],
    ) -> set[etree._Element]:
        target = self._target_of(solid)
        composite = _first_above(solid, ("CompositeSolid",))
        number = composites[composite] if composite is not None else -1
        member = target.collection.add_solid(replace(_membership(solid), composite=number))
        used = set()
        for boundary in solid:
            if local_name(boundary) in _BOUNDARIES:
                shell = target.collection.add_shell(_place(solid), member)
                members = _add_members(target, boundary, ids, shell)
                if not members:
                    target.collection.issues.append(_place(solid).fault(902))
                used |= members
        return used

    def _target_of(self, geometry: etree._Element) -> _Target:
        """Where the bodies of a geometry go."""
        implicit = _first_above(geometry, ("ImplicitGeometry",))
        if implicit is None:
            return _Target(self.placed, np.eye(3))
        return _Target(self.templates, _matrix(implicit))


def _add_members(
    target: _Target, boundary: etree._Element, ids: Mapping[str, etree._Element], shell: int
) -> set[etree._Element]:
    """Adds the polygons of a shell, and returns them."""
    used = set()
    for polygon, turned in _members(target, boundary, ids):
        used.add(polygon)
        _add_polygon(target, polygon, turned=turned, shell=shell)
    return used


def _members(
    target: _Target, boundary: etree._Element, ids: Mapping[str, etree._Element]
) -> Iterator[tuple[etree._Element, bool]]:
    """Polygons of a shell, contained or referenced, and whether each is reversed."""
    waiting = [(boundary, False)]
    followed: set[etree._Element] = set()
    while waiting:
        element, turned = waiting.pop()
        if local_name(element) in _POLYGONS:
            yield element, turned
            continue
        below = list(element)
        referenced = _referenced(target, element, ids)
        # No surface is followed twice, as it might reference itself.
        if referenced is not None and referenced not in followed:
            if local_name(referenced) not in _POLYGONS:
                followed.add(referenced)
            below.append(referenced)
        turned ^= element.get("orientation") == "-"
        waiting += [(each, turned) for each in reversed(below)]


def _referenced(
    target: _Target, element: etree._Element, ids: Mapping[str, etree._Element]
) -> etree._Element | None:
    """Target of a reference; an issue if it does not exist."""
    href = element.get(_HREF)
    if href is None or href.removeprefix("#") in ids:
        return ids.get((href or "").removeprefix("#"))
    place = _place(element)
    message = f"no element of the file has the id of the reference {href}"
    target.collection.issues.append(
        Issue("gml.reference", Severity.ERROR, place.name, message, line=place.line)
    )
    return None


def _add_polygon(target: _Target, polygon: etree._Element, *, turned: bool, shell: int) -> None:
    place = _place(polygon)
    boundaries = [ring for ring in polygon if local_name(ring) in _RINGS]
    if not boundaries:
        target.collection.issues.append(place.fault(902))
        return
    rings = [_ring(target, ring, place) for ring in boundaries]
    backwards = turned != target.mirrored
    target.collection.add_polygon(
        place, [_backwards(ring) if backwards else ring for ring in rings], shell
    )


def _ring(target: _Target, boundary: etree._Element, place: Place) -> list[float]:
    """Coordinates of a ring, without the repeated last point."""
    try:
        numbers = [
            float(number)
            for positions in boundary.iter("{*}posList", "{*}pos", "{*}coordinates")
            for number in (positions.text or "").replace(",", " ").split()
        ]
    except ValueError as error:
        target.collection.issues.append(place.fault(901, str(error)))
        return []
    if len(numbers) % 3 or not math.isfinite(sum(numbers)):
        target.collection.issues.append(place.fault(901, "coordinates are not finite triples"))
        return []
    closed = numbers[:3] == numbers[-3:]
    if not closed:
        target.collection.issues.append(place.fault(103))
    return target.scaled(numbers[:-3] if closed else numbers)


def _backwards(ring: list[float]) -> list[float]:
    return [value for k in range(len(ring) - 3, -1, -3) for value in ring[k : k + 3]]


def _id(element: etree._Element) -> str:
    return element.get(f"{{{_GML}/3.2}}id") or element.get(f"{{{_GML}}}id") or ""


def _place(geometry: etree._Element) -> Place:
    feature = _feature(geometry)
    name = f"{local_name(feature)}[{_id(feature)}]"
    return Place(name, _id(geometry), cast("int | None", geometry.sourceline) or 0)


def _feature(element: etree._Element) -> etree._Element:
    """The nearest enclosing element that is neither geometry nor property."""
    above = element
    while (parent := above.getparent()) is not None:
        above = parent
        is_geometry = above.tag.startswith(f"{{{_GML}")
        if local_name(above)[:1].isupper() and not is_geometry:
            return above
    return above


def _membership(solid: etree._Element) -> Membership:
    """The building of a solid, and its role in it."""
    above = [solid, *solid.iterancestors()]
    names = [local_name(element) for element in above]
    level = next((name for name in names if name.startswith("lod")), "")
    if "Building" not in names:
        return Membership()
    at = names.index("Building")
    return Membership(_id(above[at]), role_of(level, names[:at]))


def _first_above(element: etree._Element, names: Container[str]) -> etree._Element | None:
    """The nearest element around a geometry that has one of the names, within its feature."""
    return next((above for above in element.iterancestors() if local_name(above) in names), None)


def _matrix(implicit: etree._Element) -> FloatArray:
    """Scale and turn of implicit geometry, 3 x 3; those of a faulty matrix are left out."""
    text = implicit.findtext("{*}transformationMatrix") or ""
    try:
        matrix: FloatArray = np.array(text.split(), dtype=np.float64).reshape(4, 4)[:3, :3]
    except ValueError:
        return np.eye(3)
    return matrix if np.isfinite(matrix).all() else np.eye(3)

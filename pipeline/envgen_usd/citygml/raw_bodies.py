"""Polygons and solids of a CityGML file, unrepaired, for validation."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import cast

import numpy as np
from lxml import etree

from envgen_usd.citygml.city_frame import Frame
from envgen_usd.citygml.gml_geometry_read import local_name
from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.iso19107.fault_report import INSIDE, fault_issue
from envgen_usd.geometry.iso19107.fault_search import Bodies
from envgen_usd.models.polygon_arrays import Polygons

_HREF = "{http://www.w3.org/1999/xlink}href"
_GML = "http://www.opengis.net/gml"
_POLYGONS = ("Polygon", "Triangle", "Rectangle")
_RINGS = ("exterior", "interior", "outerBoundaryIs", "innerBoundaryIs")


@dataclass(frozen=True)
class Place:
    """Place of a geometry in a file: its feature, its id, and its line."""

    feature: str
    geometry: str
    line: int

    @property
    def name(self) -> str:
        """The feature and the geometry."""
        return f"{self.feature}/{self.geometry}" if self.geometry else self.feature

    def fault(self, code: int, detail: str = "") -> Issue:
        """Returns a fault at this place."""
        return fault_issue(code, self.name, detail, self.line)


@dataclass
class BodyReader:
    """Collects the bodies of many features.

    Attributes:
        polygons: Place of each polygon.
        shells: Place of the solid of each shell.
        solids: Feature that each solid describes, and the property that holds it.
        issues: Faults of the GML itself.
    """

    polygons: list[Place] = field(default_factory=list)
    shells: list[Place] = field(default_factory=list)
    solids: list[tuple[str, str]] = field(default_factory=list)
    issues: list[Issue] = field(default_factory=list)
    _numbers: list[float] = field(default_factory=list)
    _rings: list[int] = field(default_factory=lambda: [0])
    _polygon_ends: list[int] = field(default_factory=lambda: [0])
    _shell: list[int] = field(default_factory=list)
    _solid: list[int] = field(default_factory=list)

    def bodies(self, frame: Frame) -> Bodies:
        """All collected bodies, in metres."""
        points = np.array(self._numbers, dtype=np.float64).reshape(-1, 3)
        polygons = Polygons(
            frame.place(points),
            np.array(self._rings, dtype=np.int64),
            np.array(self._polygon_ends, dtype=np.int64),
        )
        shell = np.array(self._shell, dtype=np.int64)
        return Bodies(polygons, shell, np.array(self._solid, dtype=np.int64))

    def add(self, feature: etree._Element, shared: Mapping[str, etree._Element]) -> None:
        """Collects the bodies of a top-level feature.

        Args:
            feature: Top-level feature with all its parts.
            shared: Elements of other features that this feature may reference, by id.
        """
        ids = {name: element for element in feature.iter() if (name := _id(element))}
        ids = {**shared, **ids}
        used: set[etree._Element] = set()
        for solid in feature.iter("{*}Solid"):
            self.solids.append(_described(solid))
            used |= self._add_solid(solid, ids)
        for polygon in feature.iter(*(f"{{*}}{name}" for name in _POLYGONS)):
            if polygon not in used:
                self._add_polygon(polygon, turned=False, shell=-1)

    def _add_solid(
        self, solid: etree._Element, ids: dict[str, etree._Element]
    ) -> set[etree._Element]:
        used = set()
        for boundary in solid:
            if local_name(boundary) not in ("exterior", "interior"):
                continue
            shell = len(self.shells)
            self.shells.append(_place(solid))
            self._solid.append(len(self.solids) - 1)
            before = len(self._shell)
            for polygon, turned in self._members(boundary, ids):
                used.add(polygon)
                self._add_polygon(polygon, turned, shell)
            if len(self._shell) == before:
                self.issues.append(_place(solid).fault(902))
        return used

    def _members(
        self, boundary: etree._Element, ids: Mapping[str, etree._Element]
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
            target = self._target(element, ids)
            # No surface is followed twice, as it might reference itself.
            if target is not None and target not in followed:
                if local_name(target) not in _POLYGONS:
                    followed.add(target)
                below.append(target)
            turned ^= element.get("orientation") == "-"
            waiting += [(each, turned) for each in reversed(below)]

    def _target(
        self, element: etree._Element, ids: Mapping[str, etree._Element]
    ) -> etree._Element | None:
        """Target of a reference; an issue if it does not exist."""
        href = element.get(_HREF)
        if href is None or href.removeprefix("#") in ids:
            return ids.get((href or "").removeprefix("#"))
        place = _place(element)
        message = f"no element of the file has the id of the reference {href}"
        self.issues.append(
            Issue("gml.reference", Severity.ERROR, place.name, message, line=place.line)
        )
        return None

    def _add_polygon(self, polygon: etree._Element, turned: bool, shell: int) -> None:
        place = _place(polygon)
        rings = [self._ring(ring, place) for ring in polygon if local_name(ring) in _RINGS]
        if not rings:
            self.issues.append(place.fault(902))
            return
        for ring in rings:
            self._numbers += _backwards(ring) if turned else ring
            self._rings.append(len(self._numbers) // 3)
        self._polygon_ends.append(len(self._rings) - 1)
        self._shell.append(shell)
        self.polygons.append(place)

    def _ring(self, boundary: etree._Element, place: Place) -> list[float]:
        """Coordinates of a ring, without the repeated last point."""
        try:
            numbers = [
                float(number)
                for positions in boundary.iter("{*}posList", "{*}pos", "{*}coordinates")
                for number in (positions.text or "").replace(",", " ").split()
            ]
        except ValueError as error:
            self.issues.append(place.fault(901, str(error)))
            return []
        if len(numbers) % 3 or not math.isfinite(sum(numbers)):
            self.issues.append(place.fault(901, "coordinates are not finite triples"))
            return []
        if numbers[:3] != numbers[-3:]:
            self.issues.append(place.fault(103))
            return numbers
        return numbers[:-3]


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


def _described(solid: etree._Element) -> tuple[str, str]:
    """Id of the building of a solid, and the name of the property that holds the solid."""
    above: etree._Element | None = solid
    name = ""
    while above is not None:
        label = local_name(above)
        if label.startswith("lod") and not name:
            name = label
        if label in INSIDE and " " not in name:
            name = f"{label} {name}"
        if label == "Building":
            return _id(above), name
        above = above.getparent()
    return "", name

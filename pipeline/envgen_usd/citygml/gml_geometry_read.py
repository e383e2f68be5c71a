"""Reads GML 3.1 and 3.2 geometry elements as arrays, in any namespace."""

from collections.abc import Iterable, Iterator

import numpy as np
from lxml import etree

from envgen_usd.chunks import snap
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.polygon_arrays import Polygons, ShellPath, Solids
from envgen_usd.xml_events import local_name

_POLYGONS = ("{*}Polygon", "{*}Triangle", "{*}Rectangle")
_RINGS = ("exterior", "interior", "outerBoundaryIs", "innerBoundaryIs")


class GeometryReader:
    """Reads coordinates of the file frame into the road frame.

    Attributes:
        offset: 3, metres; subtracted from the coordinates.
    """

    def __init__(self, offset: FloatArray) -> None:
        """Starts with the offset of the file."""
        self.offset = offset
        self._moves = bool(np.any(offset))

    def points(self, numbers: list[float]) -> FloatArray:
        """N x 3 points in the road frame, from 3 N coordinates of the file."""
        points = np.array(numbers, dtype=np.float64).reshape(-1, 3)
        return snap(points - self.offset) if self._moves else points

    def polygons(self, element: etree._Element) -> Polygons:
        """All polygons at any depth below a geometry element."""
        return self._polygons(element.iter(*_POLYGONS))

    def solids(self, element: etree._Element) -> Polygons:
        """All polygons below a geometry element, by the shells of the solids there."""
        elements: list[etree._Element] = []
        paths: list[ShellPath] = []
        for number, solid in enumerate(element.iter("{*}Solid")):
            shells = (child for child in solid if local_name(child) in ("exterior", "interior"))
            for shell, boundary in enumerate(sorted(shells, key=local_name)):
                polygons = list(boundary.iter(*_POLYGONS))
                elements += polygons
                paths += [(number, shell)] * len(polygons)
        if not elements:
            return self.polygons(element)
        composite = next(element.iter("{*}CompositeSolid"), None) is not None
        return Solids.of_shells(self._polygons(elements), paths, composite=composite)

    def _polygons(self, elements: Iterable[etree._Element]) -> Polygons:
        numbers: list[float] = []
        ring_offsets, polygon_offsets = [0], [0]
        for polygon in elements:
            for ring in _rings(polygon):
                coordinates = _coordinates(ring)
                # GML repeats a ring's first point at its end.
                numbers += coordinates[:-3]
                ring_offsets.append(len(numbers) // 3)
            polygon_offsets.append(len(ring_offsets) - 1)
        return Polygons(
            self.points(numbers),
            np.array(ring_offsets, dtype=np.int64),
            np.array(polygon_offsets, dtype=np.int64),
        )

    def curves(self, element: etree._Element) -> tuple[FloatArray, ...]:
        """All line strings at any depth below a geometry element; each N_i x 3."""
        lines = element.iter("{*}LineString", "{*}LineStringSegment")
        return tuple(self.points(_coordinates(line)) for line in lines)

    def point(self, element: etree._Element) -> FloatArray:
        """The point below an element, 3.

        Raises:
            ValueError: There is no point, or there are several.
        """
        points = self.points(_coordinates(element))
        if len(points) != 1:
            raise ValueError(f"{local_name(element)} has {len(points)} points instead of 1")
        point: FloatArray = points[0]
        return point


def _rings(polygon: etree._Element) -> Iterator[etree._Element]:
    for boundary in polygon:
        if local_name(boundary) in _RINGS:
            yield boundary


def _coordinates(element: etree._Element) -> list[float]:
    numbers: list[float] = []
    for positions in element.iter("{*}posList", "{*}pos"):
        numbers += map(float, (positions.text or "").split())
    return numbers

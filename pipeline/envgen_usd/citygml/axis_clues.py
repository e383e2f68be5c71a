"""What the geometry of a CityGML file tells of the order of its axes."""

from collections.abc import Iterable

import numpy as np
from lxml import etree

from envgen_usd.citygml.xlinks import name_of, polygons_below
from envgen_usd.models.array_types import FloatArray
from envgen_usd.xml_events import local_name

_RINGS = ("exterior", "interior", "outerBoundaryIs", "innerBoundaryIs")
_UPWARD = {"RoofSurface": 1.0, "GroundSurface": -1.0}
_LEAST_FACES = 4
"""Faces of a closed shell; a larger value lets fewer solids decide."""


def facing(member: etree._Element) -> int:
    """Solids that face outwards with easting first, less those that face inwards.

    Without solids roofs count, which look upwards, and ground surfaces, which look downwards.

    Args:
        member: Element with features, of any version of CityGML.
    """
    known = {name_of(e): e for e in member.iter(etree.Element) if name_of(e)}
    votes = 0
    solids = list(member.iter("{*}Solid"))
    for solid in solids:
        polygons = polygons_below(solid, known)
        if len(polygons) >= _LEAST_FACES:
            votes += _sign(_volume(polygons))
    if not solids:
        for surface in member.iter(*(f"{{*}}{name}" for name in _UPWARD)):
            area = _area_vector(polygons_below(surface, known))[2]
            votes += _sign(_UPWARD[local_name(surface)] * area)
    return votes


def _sign(value: float) -> int:
    return int(np.sign(value)) if np.isfinite(value) else 0


def _volume(polygons: Iterable[etree._Element]) -> float:
    """Signed volume of a shell: a sixth of the sum of the triple products of its triangles."""
    corners = _triangles(polygons)
    if not len(corners):
        return 0.0
    corners -= corners[0, 0]
    crossed = np.cross(corners[:, 1], corners[:, 2])
    return float((corners[:, 0] * crossed).sum()) / 6


def _area_vector(polygons: Iterable[etree._Element]) -> FloatArray:
    corners = _triangles(polygons)
    edges = corners[:, 1:] - corners[:, :1]
    area: FloatArray = np.cross(edges[:, 0], edges[:, 1]).sum(axis=0) / 2
    return area


def _triangles(polygons: Iterable[etree._Element]) -> FloatArray:
    """Fans of all rings, T x 3 x 3; those of holes count against those of their exterior."""
    fans = [np.empty((0, 3, 3))]
    for polygon in polygons:
        for boundary in polygon:
            ring = _ring(boundary) if local_name(boundary) in _RINGS else np.empty((0, 3))
            if len(ring) > 2:
                first = np.broadcast_to(ring[0], (len(ring) - 2, 3))
                fans.append(np.stack([first, ring[1:-1], ring[2:]], axis=1))
    return np.concatenate(fans)


def _ring(boundary: etree._Element) -> FloatArray:
    numbers = [
        number
        for positions in boundary.iter("{*}posList", "{*}pos", "{*}coordinates")
        for number in (positions.text or "").replace(",", " ").split()
    ]
    try:
        return np.array(numbers, dtype=np.float64).reshape(-1, 3)
    except ValueError:
        # Points without heights, or no numbers: such a ring tells nothing.
        return np.empty((0, 3))

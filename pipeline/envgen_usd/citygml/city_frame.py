"""Coordinate reference systems of CityGML files, and their transformation to the road frame."""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pyproj
from pyproj.aoi import AreaOfInterest
from pyproj.database import query_crs_info, query_utm_crs_info
from pyproj.enums import PJType
from pyproj.exceptions import CRSError, ProjError

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.geometry.georeference import horizontal
from envgen_usd.models.array_types import FloatArray

_NEAR_ORIGIN = 1e5
_OFFSET_STEP = 100.0
_LARGEST_DEGREES = 1000.0
"""Largest magnitude of degrees; larger coordinates are lengths.

A larger value reads more lengths as wrong degrees.
"""
# Names used by German surveying offices: ETRS89 / UTM, and DHDN / 3-degree Gauss-Krüger.
_ADV_UTM = re.compile(r"ETRS89_UTM(\d\d)")
_ADV_GAUSS_KRUGER = re.compile(r"DE_DHDN_3GK(\d)")
_EPSG = re.compile(r"EPSG(?::[^:]*:|:|/[^/]*/)(\d+)", re.IGNORECASE)


@dataclass(frozen=True)
class Frame:
    """Transformation of a file's coordinates to the road frame.

    Attributes:
        source: CRS of the file; `None` if unknown.
        swapped: True if northing (or latitude) precedes easting (or longitude) in the file.
        crs: Metric CRS of the result, as in `City`.
        offset: 3, metres, subtracted from coordinates in `crs`.
        issues: Decisions beyond the srsName.
    """

    source: pyproj.CRS | None
    swapped: bool
    crs: str
    offset: FloatArray
    issues: tuple[Issue, ...] = ()

    @cached_property
    def _transformer(self) -> pyproj.Transformer | None:
        if self.source is None or not self.crs or pyproj.CRS(self.crs) == self.source:
            return None
        try:
            return pyproj.Transformer.from_crs(self.source, self.crs, always_xy=True)
        except ProjError as error:
            # A missing geoid grid concerns heights only, which are not transformed.
            if self.source.is_projected:
                return None
            raise EnvgenError(
                f"no transformation leads from {self.source.name} to {self.crs}"
            ) from error

    def place(self, points: FloatArray) -> FloatArray:
        """Returns points (N x 3) of the file in the road frame, metres."""
        moved = points[:, [1, 0, 2]] if self.swapped else points
        if self._transformer is not None:
            x, y = self._transformer.transform(moved[:, 0], moved[:, 1])
            moved = np.column_stack([x, y, moved[:, 2]])
        placed: FloatArray = moved - self.offset
        return placed


def frame_of(
    name: str, corner: FloatArray, crs: str = "", offset: tuple[float, float, float] | None = None
) -> Frame:
    """Returns the frame of a file.

    The CRS's authority defines the axis order; names like ``EPSG:25832`` mean easting first. The
    order is swapped if only the swapped corner lies in the area of use of the CRS. Geographic
    coordinates are projected to UTM.

    Args:
        name: The file's srsName, or a PROJ string or WKT, or empty.
        corner: 3, any point of the file, in the file's coordinates.
        crs: Target CRS; empty for that of the file, or for UTM if that is not metric.
        offset: Target offset, 3, metres; `None` chooses an offset that gives small coordinates.

    Raises:
        EnvgenError: The target CRS is not a coordinate reference system, or no zone of UTM contains
            the file.
    """
    source = _projected(_crs(name), corner)
    swapped = source is not None and _is_swapped(source, name, corner)
    wanted = horizontal(crs) or _metric(source, name, corner[[1, 0]] if swapped else corner[:2])
    try:
        if wanted:
            pyproj.CRS(wanted)
    except CRSError as error:
        raise EnvgenError(f"'{crs}' is not a coordinate reference system: {error}") from error
    start = Frame(source, swapped, wanted, np.zeros(3))
    if offset is None:
        offset = _small_offset(start.place(corner.reshape(1, 3))[0])
    issues = _issues(name, source, swapped)
    return Frame(source, swapped, wanted, np.array(offset, dtype=np.float64), issues)


def _crs(name: str) -> pyproj.CRS | None:
    """Horizontal CRS of an srsName, or `None`."""
    if match := _ADV_UTM.search(name):
        code = 25800 + int(match[1])
    elif match := _ADV_GAUSS_KRUGER.search(name):
        code = 31464 + int(match[1])
    elif match := _EPSG.search(name):
        code = int(match[1])
    else:
        code = 0
    try:
        crs = pyproj.CRS.from_epsg(code) if code else pyproj.CRS.from_user_input(name)
    except CRSError:
        return None
    return crs.sub_crs_list[0] if crs.is_compound else crs


def _projected(crs: pyproj.CRS | None, corner: FloatArray) -> pyproj.CRS | None:
    """The CRS, or a projected CRS of the same datum if the coordinates cannot be degrees.

    Files name the datum alone, as ``CH1903``, and mean its national projection.
    """
    if crs is None or not crs.is_geographic or np.abs(corner[:2]).max() <= _LARGEST_DEGREES:
        return crs
    for entry in query_crs_info("EPSG", PJType.PROJECTED_CRS):
        if entry.name.startswith(f"{crs.name} / "):
            candidate = pyproj.CRS.from_epsg(int(entry.code))
            if any(_in_area(candidate, corner[order]) for order in ([0, 1], [1, 0])):
                return candidate
    return None


def _issues(name: str, source: pyproj.CRS | None, swapped: bool) -> tuple[Issue, ...]:
    """Decisions about a CRS beyond its name."""
    if not name:
        return ()
    named = _crs(name)
    if source is None:
        what = f"'{name}' is not a coordinate reference system that matches the coordinates"
        done = "coordinates used unchanged"
    elif named is not None and source.name != named.name:
        what = f"'{name}' has coordinates in degrees, but the coordinates of the file are lengths"
        done = f"read as {source.name} (EPSG:{source.to_epsg()})"
    elif swapped != _declared_swapped(source, name):
        what = f"with the axis order of '{name}' the file lies outside its area of use"
        done = "read as northing first" if swapped else "read as easting first"
    else:
        return ()
    return (Issue("city.srs_name", Severity.WARNING, "srsName", what, done),)


def _declared_swapped(crs: pyproj.CRS, name: str) -> bool:
    """True if the authority puts northing first; names like ``EPSG:25832`` mean easting first."""
    by_authority = bool(crs.axis_info[0].direction.lower() == "north")
    return by_authority and not name.upper().startswith("EPSG:")


def _is_swapped(crs: pyproj.CRS, name: str, corner: FloatArray) -> bool:
    declared = _declared_swapped(crs, name)
    fits = {
        order: _in_area(crs, corner[[1, 0]] if order else corner[:2]) for order in (True, False)
    }
    return declared if fits[declared] or not fits[not declared] else not declared


def _in_area(crs: pyproj.CRS, place: FloatArray) -> bool:
    """True if easting and northing (2) lie within a degree of the area of use of a CRS."""
    area = crs.area_of_use
    geographic = crs.geodetic_crs
    if area is None or geographic is None:
        return True
    to_degrees = pyproj.Transformer.from_crs(crs, geographic, always_xy=True)
    east, north = to_degrees.transform(place[0], place[1])
    inside_east = area.west - 1 <= east <= area.east + 1 or area.west > area.east
    return bool(inside_east and area.south - 1 <= north <= area.north + 1)


def _metric(crs: pyproj.CRS | None, name: str, place: FloatArray) -> str:
    """Name of a metric CRS at easting and northing (2): the CRS itself, or a zone of UTM."""
    if crs is None:
        return ""
    if crs.is_projected and all(axis.unit_conversion_factor == 1 for axis in crs.axis_info[:2]):
        code = crs.to_epsg()
        return f"EPSG:{code}" if code else name
    to_degrees = pyproj.Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    east, north = to_degrees.transform(place[0], place[1])
    return _utm_zone(float(east), float(north))


def _utm_zone(east: float, north: float) -> str:
    """EPSG name of the UTM zone at a point in degrees; on borders the northern, eastern zone."""
    place = AreaOfInterest(east, north, east, north) if np.isfinite((east, north)).all() else None
    codes = [int(zone.code) for zone in query_utm_crs_info("WGS 84", place)] if place else []
    if not codes:
        raise EnvgenError(
            f"no zone of UTM contains {east:g} degrees east, {north:g} degrees north; correct "
            "the coordinates or their srsName"
        )
    northern = [code for code in codes if code < 32700]
    return f"EPSG:{max(northern or codes)}"


def _small_offset(place: FloatArray) -> tuple[float, float, float]:
    if np.abs(place[:2]).max() < _NEAR_ORIGIN:
        return 0.0, 0.0, 0.0
    x, y = (np.floor(place[:2] / _OFFSET_STEP) * _OFFSET_STEP).tolist()
    return x, y, 0.0

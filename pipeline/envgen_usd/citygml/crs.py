"""Coordinate reference systems of CityGML files, and the way from them to the road frame."""

import math
import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pyproj
from pyproj.exceptions import CRSError, ProjError

from envgen_usd.errors import EnvgenError
from envgen_usd.models.arrays import FloatArray

_NEAR_ORIGIN = 1e5
_OFFSET_STEP = 100.0
# Names of the German surveys: ETRS89 / UTM, and DHDN / 3-degree Gauss-Krüger.
_ADV_UTM = re.compile(r"ETRS89_UTM(\d\d)")
_ADV_GAUSS_KRUGER = re.compile(r"DE_DHDN_3GK(\d)")
_EPSG = re.compile(r"EPSG(?::[^:]*:|:|/[^/]*/)(\d+)", re.IGNORECASE)


@dataclass(frozen=True)
class Frame:
    """How coordinates of a file become those of the road frame.

    Attributes:
        source: CRS of the file, or none where it is unknown.
        swapped: Whether the file gives northing (or latitude) before easting (or longitude).
        crs: CRS of the result, as in `City`; metric.
        offset: 3, what is subtracted from coordinates in `crs`.
    """

    source: pyproj.CRS | None
    swapped: bool
    crs: str
    offset: FloatArray

    @cached_property
    def _transformer(self) -> pyproj.Transformer | None:
        if self.source is None or not self.crs or pyproj.CRS(self.crs) == self.source:
            return None
        try:
            return pyproj.Transformer.from_crs(self.source, self.crs, always_xy=True)
        except ProjError as error:
            # A geoid grid that is not installed concerns heights, which are not transformed.
            if self.source.is_projected:
                return None
            raise EnvgenError(f"no way leads from {self.source.name} to {self.crs}") from error

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

    The order of axes is that of the CRS's authority, or easting first for a name of the form
    ``EPSG:25832``; where the file then lies outside the area of use of its CRS, and with the other
    order inside, it is the other. Geographic coordinates are projected to UTM.

    Args:
        name: The file's srsName, or a PROJ string or WKT, or empty.
        corner: 3, any place in the file, in its own coordinates.
        crs: CRS that is wanted; empty for the file's own or, where that is not metric, for UTM.
        offset: Offset that is wanted; none for one that leaves small numbers.

    Raises:
        EnvgenError: The wanted CRS is none.
    """
    source = _crs(name)
    swapped = source is not None and _is_swapped(source, name, corner)
    wanted = crs or _metric(source, name, corner[[1, 0]] if swapped else corner[:2])
    try:
        if wanted:
            pyproj.CRS(wanted)
    except CRSError as error:
        raise EnvgenError(f"'{crs}' is no coordinate reference system: {error}") from error
    start = Frame(source, swapped, wanted, np.zeros(3))
    if offset is None:
        offset = _small_offset(start.place(corner.reshape(1, 3))[0])
    return Frame(source, swapped, wanted, np.array(offset, dtype=np.float64))


def _crs(name: str) -> pyproj.CRS | None:
    """Horizontal CRS that an srsName stands for, or none."""
    if found := _ADV_UTM.search(name):
        code = 25800 + int(found[1])
    elif found := _ADV_GAUSS_KRUGER.search(name):
        code = 31464 + int(found[1])
    elif found := _EPSG.search(name):
        code = int(found[1])
    else:
        code = 0
    try:
        crs = pyproj.CRS.from_epsg(code) if code else pyproj.CRS.from_user_input(name)
    except CRSError:
        return None
    return crs.sub_crs_list[0] if crs.is_compound else crs


def _is_swapped(crs: pyproj.CRS, name: str, corner: FloatArray) -> bool:
    by_authority = crs.axis_info[0].direction.lower() == "north"
    declared = by_authority and not name.upper().startswith("EPSG:")
    fits = {
        order: _in_area(crs, corner[[1, 0]] if order else corner[:2]) for order in (True, False)
    }
    return declared if fits[declared] or not fits[not declared] else not declared


def _in_area(crs: pyproj.CRS, place: FloatArray) -> bool:
    """Whether easting and northing (2) lie within a degree of the area of use of a CRS."""
    area = crs.area_of_use
    geographic = crs.geodetic_crs
    if area is None or geographic is None:
        return True
    to_degrees = pyproj.Transformer.from_crs(crs, geographic, always_xy=True)
    east, north = to_degrees.transform(place[0], place[1])
    inside_east = area.west - 1 <= east <= area.east + 1 or area.west > area.east
    return bool(inside_east and area.south - 1 <= north <= area.north + 1)


def _metric(crs: pyproj.CRS | None, name: str, place: FloatArray) -> str:
    """Name of a metric CRS for a place (2) in easting and northing: itself, or a zone of UTM."""
    if crs is None:
        return ""
    if crs.is_projected and all(axis.unit_conversion_factor == 1 for axis in crs.axis_info[:2]):
        code = crs.to_epsg()
        return f"EPSG:{code}" if code else name
    to_degrees = pyproj.Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    east, north = to_degrees.transform(place[0], place[1])
    zone = math.floor((east + 180) / 6) % 60 + 1
    return f"EPSG:{(32600 if north >= 0 else 32700) + zone}"


def _small_offset(place: FloatArray) -> tuple[float, float, float]:
    if np.abs(place[:2]).max() < _NEAR_ORIGIN:
        return 0.0, 0.0, 0.0
    x, y = (np.floor(place[:2] / _OFFSET_STEP) * _OFFSET_STEP).tolist()
    return x, y, 0.0

"""Coordinate reference systems of CityGML files, and their transformation to the road frame."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import pyproj
from pyproj.aoi import AreaOfInterest
from pyproj.crs import GeographicCRS, ProjectedCRS
from pyproj.crs.coordinate_operation import TransverseMercatorConversion
from pyproj.database import query_crs_info, query_utm_crs_info
from pyproj.enums import PJType

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.geometry.georeference import (
    WGS_84,
    horizontal,
    is_metric,
    known_crs,
    plan_crs,
    transformation,
)
from envgen_usd.models.array_types import FloatArray

_NEAR_ORIGIN = 1e5
_OFFSET_STEP = 100.0
_LARGEST_DEGREES = 1000.0
"""Largest magnitude of degrees; larger coordinates are lengths.

A larger value reads more lengths as wrong degrees.
"""
_RIGHT_ANGLE = 90.0
# Names used by German surveying offices: ETRS89 / UTM, and DHDN / 3-degree Gauss-Krüger.
_ADV_UTM = re.compile(r"ETRS89_UTM(\d\d)")
_ADV_GAUSS_KRUGER = re.compile(r"DE_DHDN_3GK(\d)")
_EPSG = re.compile(r"EPSG(?::[^:]*:|:|/[^/]*/)(\d+)", re.IGNORECASE)


_NEAR_ROAD = (200.0, 1000.0, 5000.0)
"""Distances from the road, metres, at which the axis order is judged; the least one decides first.

Larger values let places far from the road decide.
"""


@dataclass(frozen=True)
class Clues:
    """What tells the axis order of a file apart from its srsName.

    Attributes:
        facing: Number of solids and roofs that face outwards with easting first, less the number
            of those that face inwards.
        road: 2 x 3, lowest and highest corner of the road in the target CRS; `None` without a road.
    """

    facing: int = 0
    road: FloatArray | None = None


@dataclass(frozen=True)
class Frame:
    """Transformation of a file's coordinates to the road frame.

    Attributes:
        source: CRS of the file; `None` if unknown.
        swapped: True if northing (or latitude) precedes easting (or longitude) in the file.
        crs: Metric CRS of the result, as in `City`.
        offset: 3, metres, subtracted from coordinates in `crs`.
        height_unit: Metres of the unit of heights; negative for depths.
        issues: Decisions beyond the srsName.
    """

    source: pyproj.CRS | None
    swapped: bool
    crs: str
    offset: FloatArray
    height_unit: float = 1.0
    issues: tuple[Issue, ...] = ()

    @cached_property
    def _transformer(self) -> pyproj.Transformer | None:
        if self.source is None or not self.crs or pyproj.CRS(self.crs) == self.source:
            return None
        return transformation(_on_ellipsoid(self.source), pyproj.CRS(self.crs))

    def place(self, points: FloatArray) -> FloatArray:
        """Returns points (N x 3) of the file in the road frame, metres."""
        moved = points[:, [1, 0, 2]] if self.swapped else points * [1.0, 1.0, 1.0]
        if self.source is not None and self.source.is_geocentric:
            to_degrees = transformation(self.source, _on_ellipsoid(self.source))
            moved = np.column_stack(to_degrees.transform(*moved.T))
        elif self.height_unit != 1.0:
            moved[:, 2] *= self.height_unit
        if self._transformer is not None:
            x, y = self._transformer.transform(moved[:, 0], moved[:, 1])
            moved = np.column_stack([x, y, moved[:, 2]])
        placed: FloatArray = moved - self.offset
        return placed


def frame_of(
    name: str,
    places: FloatArray,
    crs: str = "",
    offset: tuple[float, float, float] | None = None,
    clues: Clues = Clues(),
) -> Frame:
    """Returns the frame of a file.

    The CRS's authority defines the axis order; names like ``EPSG:25832`` mean easting first. The
    other order is taken if only with it the places lie in the area of use, then if only with it
    they lie at the road. Where the authority puts northing first, solids decide next: with the
    wrong order they face inwards. Coordinates that are not metric are projected: to the target,
    or to UTM, or to a map around the place where there is no UTM.

    Args:
        name: The file's srsName, or a PROJ string or WKT, or empty.
        places: 3 or N x 3, points of the file, in the file's coordinates.
        crs: Target CRS; empty for that of the file, or for UTM if that is not metric.
        offset: Target offset, 3, metres; `None` chooses an offset that gives small coordinates.
        clues: What else tells the axis order.

    Raises:
        EnvgenError: The target CRS is unknown, or no transformation leads to it.
    """
    places = np.array(places, dtype=np.float64).reshape(-1, 3)
    corner = places[0]
    source = _projected(plan_of_name(name), corner)
    if source is None and crs and name and known_crs(_code_name(name)) is None:
        raise EnvgenError(
            f"PROJ does not know the reference system '{name}' of the file; correct it, or "
            "remove it where the coordinates are those of the road"
        )
    if crs and plan_crs(crs) is None:
        raise EnvgenError(f"'{crs}' is not a coordinate reference system of places")
    start = Frame(source, False, horizontal(crs), np.zeros(3), _height_unit(name))
    frames = {order: replace(start, swapped=order) for order in (True, False)}
    swapped, reason = _order(source, name, places, frames, clues)
    frame = frames[swapped]
    if not crs:
        frame = replace(frame, crs=_metric(source, name, frame.place(corner.reshape(1, 3))[0]))
    if offset is None:
        offset = _small_offset(frame.place(corner.reshape(1, 3))[0])
    issues = _issues(name, source, swapped, reason)
    return replace(frame, offset=np.array(offset, dtype=np.float64), issues=issues)


def _order(
    source: pyproj.CRS | None,
    name: str,
    places: FloatArray,
    frames: Mapping[bool, Frame],
    clues: Clues,
) -> tuple[bool, str]:
    """True if northing is first, and what speaks for that order."""
    declared = source is not None and _declared_swapped(source, name)
    if source is None or source.is_geocentric:
        return (declared, "") if source is not None else _order_at_road(places, frames, clues)
    corner = places[0]
    fits = {
        order: _in_area(source, corner[[1, 0]] if order else corner[:2]) for order in (True, False)
    }
    if fits[True] != fits[False]:
        return fits[True], "only with it the file lies in the area of use"
    at_road, reason = _order_at_road(places, frames, clues)
    if reason:
        return at_road, reason
    if clues.facing and _by_authority(source):
        return clues.facing < 0, "only with it solids and roofs face outwards"
    return declared, ""


def _order_at_road(
    places: FloatArray, frames: Mapping[bool, Frame], clues: Clues
) -> tuple[bool, str]:
    if clues.road is None:
        return False, ""
    low, high = clues.road[:, :2]
    distance = {}
    for order, frame in frames.items():
        x, y = frame.place(places)[:, :2].T
        away = np.hypot(
            np.maximum(np.maximum(low[0] - x, x - high[0]), 0),
            np.maximum(np.maximum(low[1] - y, y - high[1]), 0),
        )
        distance[order] = float(np.nan_to_num(away, nan=np.inf).min())
    for limit in _NEAR_ROAD:
        if (distance[True] <= limit) != (distance[False] <= limit):
            return distance[True] <= limit, "only with it the file lies at the road"
    return False, ""


def _on_ellipsoid(source: pyproj.CRS) -> pyproj.CRS:
    """The CRS; for a geocentric one the longitudes, latitudes and heights of its datum."""
    if not source.is_geocentric:
        return source
    return GeographicCRS(datum=source.datum).to_3d()


def _height_unit(name: str) -> float:
    """Metres of the unit of heights that an srsName gives; negative for depths."""
    crs = known_crs(name)
    axes = crs.axis_info[2:] if crs is not None else []
    vertical = [axis for axis in axes if axis.direction in ("up", "down")]
    sign = -1.0 if vertical and vertical[0].direction == "down" else 1.0
    return sign * vertical[0].unit_conversion_factor if vertical else 1.0


def is_in_metres(name: str) -> bool:
    """True if coordinates of a reference system need no conversion; also without a known system."""
    crs = plan_of_name(name)
    return crs is None or (is_metric(crs) and _height_unit(name) == 1.0)


def plan_of_name(name: str) -> pyproj.CRS | None:
    """Returns the horizontal CRS of an srsName, or `None`."""
    return plan_crs(_code_name(name))


@lru_cache(maxsize=16)
def has_two_orders(name: str) -> bool:
    """True if the authority puts northing first, which files follow or not."""
    crs = plan_of_name(name)
    return crs is not None and _by_authority(crs)


def _code_name(name: str) -> str:
    """The EPSG name in an srsName, or the name itself."""
    if match := _ADV_UTM.search(name):
        return f"EPSG:{25800 + int(match[1])}"
    if match := _ADV_GAUSS_KRUGER.search(name):
        return f"EPSG:{31464 + int(match[1])}"
    match = _EPSG.search(name)
    return f"EPSG:{match[1]}" if match else name


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


def _issues(name: str, source: pyproj.CRS | None, swapped: bool, reason: str) -> tuple[Issue, ...]:
    """Decisions about a CRS beyond its name, and the axis order where it is a question."""
    order = f"read as {'northing' if swapped else 'easting'} first"
    named = plan_of_name(name)
    kind, where, severity = "city.srs_name", "srsName", Severity.WARNING
    issues = []
    if source is None and name:
        what = f"'{name}' is not a coordinate reference system that matches the coordinates"
        issues.append(Issue(kind, severity, where, what, "coordinates used unchanged"))
    elif source is not None and named is not None and source.name != named.name:
        what = f"'{name}' has coordinates in degrees, but the coordinates of the file are lengths"
        done = f"read as {source.name} (EPSG:{source.to_epsg()})"
        issues.append(Issue(kind, severity, where, what, done))
    declared = source is not None and _declared_swapped(source, name)
    if swapped != declared:
        what = f"the axes do not have the order of '{name}': {reason}"
        issues.append(Issue("city.axis_order", severity, where, what, order))
    elif source is not None and _by_authority(source) and not issues:
        what = f"the axes have the order of '{name}': {reason or 'nothing speaks against it'}"
        issues.append(Issue("city.axis_order", Severity.INFO, where, what, order))
    return tuple(issues)


def _by_authority(crs: pyproj.CRS) -> bool:
    """True if the authority puts northing first."""
    return bool(crs.axis_info[0].direction.lower() == "north")


def _declared_swapped(crs: pyproj.CRS, name: str) -> bool:
    """True if the name means northing first; names like ``EPSG:25832`` mean easting first."""
    return _by_authority(crs) and not name.upper().startswith("EPSG:")


def _in_area(crs: pyproj.CRS, place: FloatArray) -> bool:
    """True if easting and northing (2) lie within a degree of the area of use of a CRS."""
    area = crs.area_of_use
    geographic = crs.geodetic_crs
    if area is None or geographic is None:
        return True
    east, north = transformation(crs, geographic).transform(place[0], place[1])
    inside_east = area.west - 1 <= east <= area.east + 1 or area.west > area.east
    return bool(inside_east and area.south - 1 <= north <= area.north + 1)


def _metric(crs: pyproj.CRS | None, name: str, place: FloatArray) -> str:
    """Name of a metric CRS at a place (2 or 3, easting first): the CRS, UTM, or a map around it."""
    if crs is None:
        return ""
    if is_metric(crs):
        code = crs.to_epsg()
        return f"EPSG:{code}" if code else horizontal(name)
    geodetic = _on_ellipsoid(crs) if crs.is_geocentric else crs.geodetic_crs
    if geodetic is None:
        raise EnvgenError(f"{crs.name} has no datum; give coordinates in another system")
    degrees = transformation(_on_ellipsoid(crs), geodetic).transform(place[0], place[1])
    try:
        east, north = transformation(geodetic, WGS_84).transform(*degrees)
    except EnvgenError:
        return _local_map(geodetic, *degrees)
    return _utm_zone(float(east), float(north)) or _local_map(geodetic, *degrees)


def _utm_zone(east: float, north: float) -> str:
    """EPSG name of the UTM zone at a point in degrees; on borders the northern, eastern zone."""
    place = AreaOfInterest(east, north, east, north) if np.isfinite((east, north)).all() else None
    codes = [int(zone.code) for zone in query_utm_crs_info("WGS 84", place)] if place else []
    northern = [code for code in codes if code < 32700]
    return f"EPSG:{max(northern or codes)}" if codes else ""


def _local_map(geodetic: pyproj.CRS, east: float, north: float) -> str:
    """WKT of a transverse Mercator map around a place in whole degrees, of any planet."""
    if not (np.isfinite((east, north)).all() and abs(north) <= _RIGHT_ANGLE):
        raise EnvgenError(
            f"{east:g} degrees east, {north:g} degrees north lie on no map; correct the "
            "coordinates or their srsName"
        )
    about = TransverseMercatorConversion(
        latitude_natural_origin=round(north), longitude_natural_origin=round(east)
    )
    wkt: str = ProjectedCRS(about, geodetic_crs=geodetic.to_2d()).to_wkt()
    return wkt


def _small_offset(place: FloatArray) -> tuple[float, float, float]:
    if np.abs(place[:2]).max() < _NEAR_ORIGIN:
        return 0.0, 0.0, 0.0
    x, y = (np.floor(place[:2] / _OFFSET_STEP) * _OFFSET_STEP).tolist()
    return x, y, 0.0

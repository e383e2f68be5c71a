"""Coordinate reference systems of road files and rasters, and the position of rasters."""

import re
import warnings
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pyproj
from pyproj.exceptions import CRSError, ProjError
from rasterio.crs import CRS
from rasterio.transform import Affine

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, Chunk
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.array_types import FloatArray

_VERTICAL = re.compile(r"\+(?:geoidgrids|geoid_crs|vunits|vto_meter)=\S*\s*")

Offset = tuple[float, float, float]
WGS_84 = pyproj.CRS("EPSG:4326")


def horizontal(text: str) -> str:
    """A PROJ string without its vertical parameters; any other text as it is.

    Products use plan coordinates only, and PROJ refuses transformations by geoid grids that are
    not installed.
    """
    return _VERTICAL.sub("", text).strip()


def known_crs(text: str) -> pyproj.CRS | None:
    """Returns the reference system of a PROJ string, WKT or name; `None` if PROJ knows none."""
    try:
        # A warning about an old form of a PROJ string would not help the user.
        with warnings.catch_warnings(action="ignore"):
            return pyproj.CRS.from_user_input(horizontal(text)) if text.strip() else None
    except CRSError:
        return None


def plan_crs(text: str) -> pyproj.CRS | None:
    """Returns the horizontal part of a coordinate reference system (PROJ string, WKT, a name).

    Returns:
        A geographic, projected or geocentric system; `None` for an empty text, a text unknown to
        PROJ, and systems of heights, times, or local engineering.
    """
    crs = known_crs(text)
    plan = crs.sub_crs_list[0] if crs is not None and crs.is_compound else crs
    if plan is None or not (plan.is_geographic or plan.is_projected or plan.is_geocentric):
        return None
    return plan


def is_metric(crs: pyproj.CRS) -> bool:
    """True for a projected system in metres."""
    metres = all(axis.unit_conversion_factor == 1 for axis in crs.axis_info[:2])
    return crs.is_projected and metres


def transformation(source: pyproj.CRS, target: pyproj.CRS) -> pyproj.Transformer:
    """Returns the transformation between two systems, easting before northing.

    Raises:
        EnvgenError: There is none, because the systems lie on different bodies or one of them only
            names a group of systems.
    """
    try:
        return pyproj.Transformer.from_crs(source, target, always_xy=True)
    except ProjError as error:
        raise EnvgenError(
            f"no transformation leads from {source.name} to {target.name}; give both in reference "
            "systems of the same planet"
        ) from error


@lru_cache(maxsize=16)
def parse_crs(text: str) -> CRS | None:
    """Parses the coordinate reference system of a geoReference (PROJ string, WKT, EPSG name).

    Returns:
        `None` for an empty text, a text unknown to PROJ, a system without metres, the unit of road
        files, and a name that only stands for a group of systems.
    """
    crs = plan_crs(text)
    if crs is None or not is_metric(crs) or crs.geodetic_crs is None:
        return None
    try:
        transformation(crs, crs.geodetic_crs)
    except EnvgenError:
        return None
    # GDAL prints a message for an unknown text, so that pyproj parses it first.
    return CRS.from_wkt(crs.to_wkt())


def origin_degrees(text: str, offset: Offset) -> tuple[float, float] | None:
    """WGS 84 latitude and longitude of a road frame's origin, degrees.

    Args:
        text: Its geoReference.
        offset: Metres added to road-frame coordinates.

    Returns:
        `None` without a usable geoReference, and for places outside of its projection.
    """
    crs = parse_crs(text)
    if crs is None:
        return None
    try:
        to_degrees = transformation(pyproj.CRS(crs.to_wkt()), WGS_84)
        longitude, latitude = to_degrees.transform(float(offset[0]), float(offset[1]))
    except (EnvgenError, ProjError):
        return None
    known = bool(np.isfinite(latitude) and np.isfinite(longitude))
    return (float(latitude), float(longitude)) if known else None


def check_crs(text: str) -> tuple[Issue, ...]:
    """Returns an issue for an unusable geoReference of a road file."""
    if not text.strip() or parse_crs(text) is not None:
        return ()
    shown = " ".join(text.split())[:80]
    return (
        Issue(
            "header.geo_reference",
            Severity.WARNING,
            "header/geoReference",
            f"'{shown}' is not a coordinate reference system in metres that PROJ understands",
            "products have the road's coordinates and name no reference system",
        ),
    )


def raster_transform(chunk: Chunk, offset: Offset, samples: int) -> Affine:
    """Returns the transform of a chunk's raster: rows from north to south, pixels of cell size.

    Args:
        chunk: Chunk.
        offset: Metres added to road-frame coordinates.
        samples: Pixels along a side: 255 lie between the corners, 256 are centred on them.
    """
    x, y = np.array(chunk.origin) + offset[:2]
    beyond = (samples * CELL_SIZE - CHUNK_SIZE) / 2
    return Affine(CELL_SIZE, 0.0, x - beyond, 0.0, -CELL_SIZE, y + CHUNK_SIZE + beyond)


@dataclass(frozen=True)
class RasterPlace:
    """Position of a raster relative to the road frame.

    Attributes:
        transform: From pixel (column, row) to the raster's coordinates.
        to_raster: From the road's coordinate reference system to the raster's; `None` if both are
            the same.
        offset: Metres added to road-frame coordinates.
    """

    transform: Affine
    to_raster: pyproj.Transformer | None
    offset: Offset

    def pixels(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns column and row of points (N x 2, road frame); pixel 0 extends from 0 to 1."""
        x, y = (points[:, :2] + self.offset[:2]).T
        if self.to_raster is not None:
            x, y = self.to_raster.transform(x, y)
        a, b, c, d, e, f = (~self.transform)[:6]
        return a * x + b * y + c, d * x + e * y + f


def place_raster(
    path: Path, transform: Affine, crs: CRS | None, road_crs: str, offset: Offset
) -> RasterPlace:
    """Determines a raster's position from its coordinate reference system and the road's.

    Args:
        path: The raster's file, for the message.
        transform: From pixel (column, row) to the raster's coordinates.
        crs: The raster's coordinate reference system; `None` assumes that of the road.
        road_crs: The road's geoReference.
        offset: The road's header offset, metres.

    Raises:
        EnvgenError: Pixels have no size, the road's coordinate reference system is required but
            missing or unknown, or no transformation leads to that of the raster.
    """
    if transform.is_degenerate or not np.isfinite(transform[:6]).all():
        raise EnvgenError(f"{path}: pixels without a size; check its transformation")
    road = parse_crs(road_crs)
    if crs is None or crs == road:
        return RasterPlace(transform, None, offset)
    if road is None:
        raise EnvgenError(
            f"{path}: cannot be georeferenced, because the road file's geoReference is missing or "
            "unknown; give a raster without a reference system, in the road's coordinates"
        )
    try:
        to_raster = transformation(pyproj.CRS(road.to_wkt()), pyproj.CRS(crs.to_wkt()))
    except EnvgenError as error:
        raise EnvgenError(f"{path}: cannot be placed: {error}") from error
    return RasterPlace(transform, to_raster, offset)

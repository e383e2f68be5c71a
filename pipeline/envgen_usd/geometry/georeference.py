"""Coordinate reference systems of road files and rasters, and the position of rasters."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyproj
from pyproj.exceptions import CRSError
from rasterio.crs import CRS
from rasterio.transform import Affine

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, Chunk
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.array_types import FloatArray

_VERTICAL = re.compile(r"\+(?:geoidgrids|geoid_crs|vunits|vto_meter)=\S*\s*")

Offset = tuple[float, float, float]


def horizontal(text: str) -> str:
    """A PROJ string without its vertical parameters; any other text as it is.

    Products use plan coordinates only, and PROJ refuses transformations by geoid grids that are
    not installed.
    """
    return _VERTICAL.sub("", text).strip()


def parse_crs(text: str) -> CRS | None:
    """Parses the coordinate reference system of a geoReference (PROJ string, WKT, EPSG name).

    Returns:
        `None` for an empty text, a text unknown to PROJ, and a system without metres, the unit of
        road files.
    """
    try:
        # GDAL prints a message for an unknown text; pyproj raises an exception.
        crs = pyproj.CRS.from_user_input(horizontal(text))
    except CRSError:
        return None
    if any(axis.unit_conversion_factor != 1 for axis in crs.axis_info[:2]) or crs.is_geographic:
        return None
    return CRS.from_wkt(crs.to_wkt())


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
        EnvgenError: The road's coordinate reference system is required but missing or unknown.
    """
    road = parse_crs(road_crs)
    if crs is None or crs == road:
        return RasterPlace(transform, None, offset)
    if road is None:
        raise EnvgenError(
            f"{path}: cannot be georeferenced, because the road file's geoReference is missing or "
            "unknown; give a raster without a reference system, in the road's coordinates"
        )
    to_raster = pyproj.Transformer.from_crs(road.to_wkt(), crs.to_wkt(), always_xy=True)
    return RasterPlace(transform, to_raster, offset)

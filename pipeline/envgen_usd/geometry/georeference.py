"""Where rasters lie: coordinate reference systems of road files and of other people's maps."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyproj
from pyproj.exceptions import CRSError
from rasterio.crs import CRS
from rasterio.transform import Affine

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, Chunk
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.arrays import FloatArray

Offset = tuple[float, float, float]


def parse_crs(text: str) -> CRS | None:
    """The coordinate reference system of a geoReference (PROJ string, WKT or EPSG name).

    Returns:
        None where the text is empty, cannot be understood, or is no system in metres: those of
        a road file are metres.
    """
    try:
        # GDAL prints what it cannot understand; pyproj raises.
        crs = pyproj.CRS.from_user_input(text.strip())
    except CRSError:
        return None
    if any(axis.unit_conversion_factor != 1 for axis in crs.axis_info[:2]) or crs.is_geographic:
        return None
    return CRS.from_wkt(crs.to_wkt())


def check_crs(text: str) -> tuple[Issue, ...]:
    """An issue where a road file has a geoReference that cannot be used."""
    if not text.strip() or parse_crs(text) is not None:
        return ()
    shown = " ".join(text.split())[:80]
    return (
        Issue(
            "header.geo_reference",
            Severity.WARNING,
            "header/geoReference",
            f"'{shown}' is no coordinate reference system in metres that PROJ understands",
            "products are in the road's coordinates and name no reference system",
        ),
    )


def raster_transform(chunk: Chunk, offset: Offset, samples: int) -> Affine:
    """Place of a chunk's raster, rows from north to south, pixels of one cell's size.

    Args:
        chunk: Tile.
        offset: What has to be added to road-frame coordinates.
        samples: Pixels along a side: 255 lie between the corners, 256 have them as centres.
    """
    x, y = np.array(chunk.origin) + offset[:2]
    beyond = (samples * CELL_SIZE - CHUNK_SIZE) / 2
    return Affine(CELL_SIZE, 0.0, x - beyond, 0.0, -CELL_SIZE, y + CHUNK_SIZE + beyond)


@dataclass(frozen=True)
class RasterPlace:
    """Where a raster of any origin lies, seen from the road frame.

    Attributes:
        transform: From pixel (column, row) to the raster's coordinates.
        to_raster: From the road's reference system to the raster's; none where both are the same.
        offset: What has to be added to road-frame coordinates.
    """

    transform: Affine
    to_raster: pyproj.Transformer | None
    offset: Offset

    def pixels(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Column and row of places (N x 2) in the road frame; pixel 0 reaches from 0 to 1."""
        x, y = (points[:, :2] + self.offset[:2]).T
        if self.to_raster is not None:
            x, y = self.to_raster.transform(x, y)
        a, b, c, d, e, f = (~self.transform)[:6]
        return a * x + b * y + c, d * x + e * y + f


def place_raster(
    path: Path, transform: Affine, crs: CRS | None, road_crs: str, offset: Offset
) -> RasterPlace:
    """Places a raster by its reference system and the road's.

    Args:
        path: The raster's file, for the message.
        transform: From pixel (column, row) to the raster's coordinates.
        crs: The raster's reference system; none: it is taken to be in the road's.
        road_crs: The road's geoReference.
        offset: The road's header offset.

    Raises:
        EnvgenError: The road's reference system is needed and cannot be understood.
    """
    road = parse_crs(road_crs)
    if crs is None or crs == road:
        return RasterPlace(transform, None, offset)
    if road is None:
        raise EnvgenError(
            f"{path}: cannot be placed, because the road file's geoReference is missing or "
            "unknown; give the raster without a reference system, in the road's coordinates"
        )
    to_raster = pyproj.Transformer.from_crs(road.to_wkt(), crs.to_wkt(), always_xy=True)
    return RasterPlace(transform, to_raster, offset)

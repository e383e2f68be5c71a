"""Coordinate reference systems of road files, and where a chunk's raster lies in them."""

import numpy as np
from rasterio.crs import CRS
from rasterio.errors import CRSError
from rasterio.transform import Affine

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, Chunk

Offset = tuple[float, float, float]


def parse_crs(text: str) -> CRS | None:
    """The coordinate reference system of a geoReference (PROJ string, WKT or EPSG name).

    Returns:
        None where the text is empty or cannot be understood.
    """
    if not text.strip():
        return None
    try:
        return CRS.from_user_input(text.strip())
    except CRSError:
        return None


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

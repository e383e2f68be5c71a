"""Writes and reads height maps as GeoTIFF files."""

from pathlib import Path

import numpy as np
import rasterio
from rasterio.errors import RasterioError
from rasterio.io import MemoryFile

from envgen_usd.chunks import HEIGHT_SAMPLES, Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.georeference import Offset, parse_crs, raster_transform
from envgen_usd.models.ground import HeightMap
from envgen_usd.whole_files import write_whole


def write_heightmap(
    heightmap: HeightMap, path: Path, crs: str = "", offset: Offset = (0.0, 0.0, 0.0)
) -> None:
    """Writes a height map as float32, atomically.

    Pixel centres are the grid's corners. Coordinates and heights are in the road's coordinate
    reference system. Tags with chunk and offset enable `read_heightmap` to restore the road frame.

    Args:
        heightmap: The height map.
        path: Output file.
        crs: The road's geoReference; left out if PROJ does not understand it.
        offset: The road's header offset, metres, added to road-frame coordinates.

    Raises:
        EnvgenError: The file cannot be written.
    """
    heights = heightmap.heights[::-1] + offset[2]
    # GDAL reports no full disk on closing a file; `write_whole` does.
    with MemoryFile() as memory:
        with memory.open(
            driver="GTiff",
            width=HEIGHT_SAMPLES,
            height=HEIGHT_SAMPLES,
            count=1,
            dtype="float32",
            crs=parse_crs(crs),
            transform=raster_transform(heightmap.chunk, offset, HEIGHT_SAMPLES),
            compress="deflate",
            predictor=3,
        ) as file:
            file.write(heights.astype(np.float32), 1)
            file.set_band_unit(1, "metre")
            file.update_tags(
                AREA_OR_POINT="Point",
                ENVGEN_CHUNK=heightmap.chunk.name,
                ENVGEN_OFFSET=" ".join(map(repr, map(float, offset))),
            )
        write_whole(path, memory.read())


def read_heightmap(path: Path) -> HeightMap:
    """Reads a file of `write_heightmap`.

    Raises:
        EnvgenError: The file cannot be read, or is not a height map of a chunk.
    """
    try:
        with rasterio.open(path) as file:
            tags, heights = file.tags(), file.read(1).astype(np.float64)
    except RasterioError as error:
        raise EnvgenError(f"{path}: cannot be read as GeoTIFF: {error}") from error
    if "ENVGEN_CHUNK" not in tags or heights.shape != (HEIGHT_SAMPLES, HEIGHT_SAMPLES):
        raise EnvgenError(
            f"{path}: is not a height map of a chunk; use --heightmap for an elevation model"
        )
    x, y = tags["ENVGEN_CHUNK"].split("_")
    offset = float(tags["ENVGEN_OFFSET"].split()[2])
    return HeightMap(Chunk(int(x), int(y)), heights[::-1] - offset)

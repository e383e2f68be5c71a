"""Reads height maps of chunks, and real terrain from GeoTIFF files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import rasterio
from rasterio.errors import RasterioError
from rasterio.transform import Affine
from rasterio.windows import Window

from envgen_usd.chunks import HEIGHT_SAMPLES, Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.georeference import RasterPlace, place_raster
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.surface import RoadSurface
from envgen_usd.terrain.dem import Dem
from envgen_usd.terrain.membrane import fill_membrane

DATUM_SHIFT = 10.0
"""Metres of median difference between road and terrain from which on their vertical datums are
taken to differ."""
AROUND = 500.0
"""Metres of terrain around the road that are read."""


def read_heightmap(path: Path) -> HeightMap:
    """Reads what `write_heightmap` wrote.

    Raises:
        EnvgenError: The file cannot be read, or is no height map of a chunk.
    """
    try:
        with rasterio.open(path) as file:
            tags, heights = file.tags(), file.read(1).astype(np.float64)
    except RasterioError as error:
        raise EnvgenError(f"{path}: cannot be read as GeoTIFF: {error}") from error
    if "ENVGEN_CHUNK" not in tags or heights.shape != (HEIGHT_SAMPLES, HEIGHT_SAMPLES):
        raise EnvgenError(f"{path}: is no height map of a chunk; use --heightmap for real terrain")
    x, y = tags["ENVGEN_CHUNK"].split("_")
    offset = float(tags["ENVGEN_OFFSET"].split()[2])
    return HeightMap(Chunk(int(x), int(y)), heights[::-1] - offset)


def read_dem(path: Path, surface: RoadSurface) -> Dem:
    """Reads the part of a digital elevation model that lies around a road.

    Args:
        path: GeoTIFF (or any raster that GDAL reads); heights in its first band. Without a
            reference system of its own it is taken to be in the road's.
        surface: The road, with its reference system and offset.

    Raises:
        EnvgenError: The file cannot be read, does not cover the road, or the road's reference
            system, which is needed to place it, is missing.
    """
    try:
        with rasterio.open(path) as file:
            return _read_around(file, path, surface)
    except RasterioError as error:
        raise EnvgenError(f"{path}: cannot be read as a raster: {error}") from error


def _read_around(file: rasterio.DatasetReader, path: Path, surface: RoadSurface) -> Dem:
    place = place_raster(path, file.transform, file.crs, surface.crs, surface.offset)
    window = _window(file, path, place, surface.vertices[:, :2])
    heights = file.read(1, window=window, masked=True).astype(np.float64).filled(np.nan)
    if np.isnan(heights).all():
        raise EnvgenError(f"{path}: has no heights around the road")
    part = Dem(fill_membrane(heights), replace(place, transform=_moved(file.transform, window)))
    difference = float(np.median(surface.vertices[:, 2] - part(surface.vertices)))
    return replace(part, shift=difference if abs(difference) > DATUM_SHIFT else 0.0)


def _moved(transform: Affine, window: Window) -> Affine:
    """The transform of a window's pixels."""
    a, b, c, d, e, f = transform[:6]
    column, row = window.col_off, window.row_off
    return Affine(a, b, c + a * column + b * row, d, e, f + d * column + e * row)


def _window(
    file: rasterio.DatasetReader, path: Path, place: RasterPlace, plan: FloatArray
) -> Window:
    """Pixels around the road, within the raster."""
    low, high = plan.min(axis=0) - AROUND, plan.max(axis=0) + AROUND
    steps = np.linspace(low, high, 9)
    column, row = place.pixels(np.stack(np.meshgrid(*steps.T), axis=-1).reshape(-1, 2))
    first = np.maximum(np.floor([column.min(), row.min()]), 0).astype(int)
    last = np.minimum(np.ceil([column.max(), row.max()]) + 1, [file.width, file.height]).astype(int)
    road_column, road_row = place.pixels(plan)
    on_it = (road_column >= 0) & (road_column <= file.width)
    on_it &= (road_row >= 0) & (road_row <= file.height)
    if not on_it.any():
        raise EnvgenError(f"{path}: does not cover the road; is its reference system right?")
    return Window(*first, *(last - first))

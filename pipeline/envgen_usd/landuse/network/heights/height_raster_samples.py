"""Training samples of heights from real elevation models."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rasterio
from rasterio.enums import Resampling
from rasterio.windows import Window
from scipy import ndimage

from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.raster_part import clear_implausible, opened_raster
from envgen_usd.input_paths import check_input_folder
from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL, HeightSample
from envgen_usd.landuse.network.data.road_layouts import AREA
from envgen_usd.landuse.network.heights.drawn_land import land_of_raster
from envgen_usd.landuse.network.heights.height_scenes import (
    SQUARE,
    drape_layout,
    make_height_sample,
)
from envgen_usd.models.array_types import FloatArray
from envgen_usd.seeds import generator

SUFFIXES = frozenset({".tif", ".tiff"})
"""Supported file suffixes."""
AROUND = 12
"""Margin around a sample's square, cells of heights, as far as the raster reaches.

A larger value uses more context.
"""
VOID = 0.2
"""Largest share of a window without heights; a larger value accepts more gaps."""
TRIES = 20
"""Number of windows that are tried for valid heights; a larger value accepts sparser rasters."""


def read_height_samples(folder: Path, count: int, seed: int) -> Iterator[HeightSample]:
    """Drapes roads over windows of all elevation models of a folder, in turn.

    Args:
        folder: Folder of GeoTIFF files with heights in metres in a single band. The pixel size
            comes from the file; without a transform, pixels count as cells.
        count: Number of samples.
        seed: Random seed of windows and roads.

    Raises:
        EnvgenError: A file is unusable, or there is no file.
    """
    check_input_folder(folder, "name a folder of elevation models", "--data")
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise EnvgenError(f"{folder}: holds no elevation model ({', '.join(sorted(SUFFIXES))})")
    for number in range(count):
        rng = generator(seed, "heights", "raster", number)
        heights = read_piece(paths[number % len(paths)], rng)
        land = land_of_raster(heights, np.full(2, AREA / 2))
        yield make_height_sample(drape_layout(land, rng))


def read_piece(path: Path, rng: np.random.Generator) -> FloatArray:
    """Reads a square window at a random position, resampled to cells; row 0 is the south.

    Raises:
        EnvgenError: The file cannot be read, has several bands, is in degrees or too small, or has
            no heights.
    """
    with opened_raster(path) as file:
        return _piece(file, path, rng)


def _piece(file: rasterio.DatasetReader, path: Path, rng: np.random.Generator) -> FloatArray:
    if file.count != 1:
        raise EnvgenError(f"{path}: has {file.count} bands instead of a single band of heights")
    pixel = _pixel(file, path)
    have = np.array([file.width, file.height]) * pixel / HEIGHT_CELL
    cells = int(min(have.min(), SQUARE + 2 * AROUND))
    if cells < SQUARE:
        raise EnvgenError(
            f"{path}: covers {have[0]:.0f} x {have[1]:.0f} cells of {HEIGHT_CELL:.2f} m; at least "
            f"{SQUARE} per side are needed"
        )
    size = cells * HEIGHT_CELL / pixel
    for _ in range(TRIES):
        first = rng.uniform(0.0, np.maximum(have - cells, 0.0)) * HEIGHT_CELL / pixel
        window = Window(*first, *size)
        read = file.read(
            1, window=window, out_shape=(cells, cells), resampling=Resampling.cubic, masked=True
        )
        heights = np.ma.filled(read.astype(np.float64), np.nan)
        clear_implausible(heights)
        if np.mean(np.isnan(heights)) < VOID:
            return _filled(heights)[::-1]
    raise EnvgenError(f"{path}: has hardly any heights")


def _pixel(file: rasterio.DatasetReader, path: Path) -> FloatArray:
    """Width and height of a pixel, metres."""
    if file.crs and not file.crs.is_projected:
        raise EnvgenError(
            f"{path}: is in degrees; reproject it to a reference system in metres first"
        )
    if file.transform.is_identity:
        return np.full(2, HEIGHT_CELL)
    unit = file.crs.linear_units_factor[1] if file.crs else 1.0
    a, b, _, d, e, _ = file.transform[:6]
    return np.array([np.hypot(a, d), np.hypot(b, e)]) * unit


def _filled(heights: FloatArray) -> FloatArray:
    """Fills gaps with the nearest height."""
    void = np.isnan(heights)
    row, column = ndimage.distance_transform_edt(void, return_distances=False, return_indices=True)
    filled: FloatArray = heights[row, column]
    return filled

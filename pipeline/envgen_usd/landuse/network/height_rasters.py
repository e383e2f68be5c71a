"""Training samples of heights from real elevation models."""

import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rasterio
from rasterio.enums import Resampling
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.windows import Window
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.height_land import land_of_raster
from envgen_usd.landuse.network.height_sample import HeightSample
from envgen_usd.landuse.network.height_samples import Terrain, drape_layout, make_height_sample
from envgen_usd.landuse.network.layouts import AREA
from envgen_usd.landuse.network.rasters import LEAST
from envgen_usd.models.arrays import FloatArray
from envgen_usd.seeds import generator

SUFFIXES = frozenset({".tif", ".tiff"})
"""Kinds of files that are read."""
AROUND = 200
"""Cells around a sample's square whose heights count too, where the raster has them."""
VOID = 0.2
"""Share of a piece without heights from which on it is not used."""
TRIES = 20
"""Pieces that are looked at for one with heights."""


def read_height_samples(
    folder: Path, terrain: Terrain, count: int, seed: int
) -> Iterator[HeightSample]:
    """Draws roads over pieces of all elevation models of a folder, in turn.

    Args:
        folder: With GeoTIFF files; heights in metres in their only band. Pixels are as large as
            the file says, or as cells where it has no transform.
        terrain: What lays the ground.
        count: Samples to draw.
        seed: Of pieces and roads.

    Raises:
        EnvgenError: A file cannot be used, or there is none.
    """
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise EnvgenError(f"{folder}: holds no elevation model ({', '.join(sorted(SUFFIXES))})")
    for number in range(count):
        rng = generator(seed, "heights", "raster", number)
        heights = read_piece(paths[number % len(paths)], rng)
        side = min(2 * LANDUSE_CELLS, min(heights.shape) // 2 * 2)
        land = land_of_raster(heights, np.full(2, AREA / 2), rng)
        yield make_height_sample(drape_layout(land, rng), terrain, side)


def read_piece(path: Path, rng: np.random.Generator) -> FloatArray:
    """Reads a square piece at a random place, resampled to cells; row 0 is the south.

    Raises:
        EnvgenError: The file cannot be read, has several bands, is in degrees or too small, or
            has no heights.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)  # pixels are cells then
            with rasterio.open(path) as file:
                return _piece(file, path, rng)
    except RasterioError as error:
        raise EnvgenError(f"{path}: cannot be read as a raster: {error}") from error


def _piece(file: rasterio.DatasetReader, path: Path, rng: np.random.Generator) -> FloatArray:
    if file.count != 1:
        raise EnvgenError(f"{path}: has {file.count} bands; an elevation model has one")
    pixel = _pixel(file, path)
    have = np.array([file.width, file.height]) * pixel / CELL_SIZE
    cells = int(min(have.min(), 2 * (LANDUSE_CELLS + AROUND)))
    if cells < LEAST:
        raise EnvgenError(
            f"{path}: is {have[0]:.0f} x {have[1]:.0f} cells of {CELL_SIZE:.2f} m large; "
            f"at least {LEAST} a side are needed"
        )
    size = cells * CELL_SIZE / pixel
    for _ in range(TRIES):
        first = rng.uniform(0.0, np.maximum(have - cells, 0.0)) * CELL_SIZE / pixel
        window = Window(*first, *size)
        read = file.read(
            1, window=window, out_shape=(cells, cells), resampling=Resampling.cubic, masked=True
        )
        heights = read.astype(np.float64).filled(np.nan)
        if np.mean(np.isnan(heights)) < VOID:
            return _filled(heights)[::-1]
    raise EnvgenError(f"{path}: has hardly any heights")


def _pixel(file: rasterio.DatasetReader, path: Path) -> FloatArray:
    """Width and height of a pixel, metres."""
    if file.crs and not file.crs.is_projected:
        raise EnvgenError(f"{path}: is in degrees; bring it to a reference system in metres first")
    if file.transform.is_identity:
        return np.full(2, CELL_SIZE)
    unit = file.crs.linear_units_factor[1] if file.crs else 1.0
    a, b, _, d, e, _ = file.transform[:6]
    return np.array([np.hypot(a, d), np.hypot(b, e)]) * unit


def _filled(heights: FloatArray) -> FloatArray:
    """Gaps take the nearest height."""
    void = np.isnan(heights)
    row, column = ndimage.distance_transform_edt(void, return_distances=False, return_indices=True)
    filled: FloatArray = heights[row, column]
    return filled

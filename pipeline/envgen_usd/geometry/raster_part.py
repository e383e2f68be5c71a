"""Reads the part of a raster that a map needs, whatever the size of the raster."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
import rasterio
from rasterio.errors import RasterioError
from rasterio.transform import Affine
from rasterio.windows import Window

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.errors import EnvgenError, Issue, Severity, one_line
from envgen_usd.geometry.georeference import RasterPlace, place_raster
from envgen_usd.geometry.raster_files import WITHOUT_NETWORK, unplaced_accepted
from envgen_usd.models.array_types import FloatArray

FINEST = CELL_SIZE / 3
"""Finest pixel that is read, metres; a smaller value reads pixels that no cell shows."""
MOST_PIXELS = 2**24
"""Largest number of pixels that are read of a band; a larger value needs more memory."""
LARGEST_BLOCK = 2**28
"""Largest block of a file, bytes, as a reader has to decode whole blocks.

A larger value needs more memory.
"""
CACHE = 2**26
"""Bytes of decoded blocks that GDAL keeps; a larger value needs more memory."""

LOWEST, HIGHEST = -1000.0, 10000.0
"""Range of plausible heights of land, metres; land on Earth lies between -430 m and 8849 m.

Numbers beyond mark gaps in files that declare no such number: -9999, -32768, 1e30.
"""


class Placed(Protocol):
    """Points in the road frame that have a place on Earth, e.g. a `RoadSurface`."""

    @property
    def vertices(self) -> FloatArray:
        """N x 2 or more, metres."""

    @property
    def crs(self) -> str:
        """Coordinate reference system; empty where none is known."""

    @property
    def offset(self) -> tuple[float, float, float]:
        """Metres; coordinates in `crs` are vertices plus this offset."""


@dataclass(frozen=True, eq=False)
class PlacedPoints:
    """Points that are no road yet.

    Attributes:
        vertices: N x 2, metres.
        crs: Their coordinate reference system.
        offset: Metres; coordinates in `crs` are vertices plus this offset.
    """

    vertices: FloatArray
    crs: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class RasterPart:
    """Pixels of a raster around a map.

    Attributes:
        place: Position of the pixels that are read.
        issues: A decision beyond the input.
    """

    place: RasterPlace
    issues: tuple[Issue, ...]
    _window: Window
    _shape: tuple[int, int]

    def covers(self, points: FloatArray) -> bool:
        """True if a point (N x 2, road frame) lies on these pixels."""
        column, row = self.place.pixels(points)
        inside = (column >= 0) & (column <= self._shape[1]) & (row >= 0) & (row <= self._shape[0])
        return bool(inside.any())

    def read(self, file: rasterio.DatasetReader, gap: float, band: int = 1) -> np.ndarray:
        """Reads these pixels of a band, rows x columns; `gap` stands where the file has no data."""
        pixels = file.read(band, window=self._window, out_shape=self._shape, masked=True)
        return np.ma.filled(
            pixels.astype(np.result_type(pixels.dtype, np.min_scalar_type(gap))), gap
        )


@contextmanager
def opened_raster(path: Path | str) -> Iterator[rasterio.DatasetReader]:
    """Opens a raster for reading with a bounded cache and without the network.

    Raises:
        EnvgenError: The file cannot be read as a raster, or its blocks exceed `LARGEST_BLOCK`.
    """
    settings = {"GDAL_CACHEMAX": CACHE, **WITHOUT_NETWORK}
    try:
        with rasterio.Env(**settings):
            with unplaced_accepted():
                file = rasterio.open(path)
            with file:
                _check_blocks(file, path)
                yield file
    except RasterioError as error:
        raise EnvgenError(f"{path}: cannot be read as a raster: {one_line(error)}") from error


def _check_blocks(file: rasterio.DatasetReader, path: Path | str) -> None:
    for (rows, columns), kind in zip(file.block_shapes, file.dtypes, strict=True):
        size = rows * columns * np.dtype(kind).itemsize
        if size > LARGEST_BLOCK:
            raise EnvgenError(
                f"{path}: consists of blocks of {rows} x {columns} pixels, too large to read in "
                "parts; rewrite it in tiles: gdal_translate -co TILED=YES"
            )


def find_part(
    file: rasterio.DatasetReader,
    path: Path,
    surface: Placed,
    low: FloatArray,
    high: FloatArray,
) -> RasterPart:
    """Finds the pixels of a raster within a rectangle of the road frame.

    A raster without a place has pixels of 1 m from the origin of the road's coordinates, rows to
    the north, as GDAL takes it; then an issue says so.

    Pixels finer than `FINEST` are thinned to it, and more so where the rectangle has more than
    `MOST_PIXELS`; then an issue says so.

    Args:
        file: The raster.
        path: Its file, for messages.
        surface: The road, or other points, with the coordinate reference system and offset.
        low: Least x, y of the rectangle, metres.
        high: Largest x, y of the rectangle, metres.

    Raises:
        EnvgenError: The raster has no place, or does not cover the road.
    """
    place = place_raster(path, file.transform, file.crs, surface.crs, surface.offset)
    steps = np.linspace(low, high, 9)
    column, row = place.pixels(np.stack(np.meshgrid(*steps.T), axis=-1).reshape(-1, 2))
    elsewhere = _elsewhere(path, placed=not file.transform.is_identity)
    if not (np.isfinite(column).all() and np.isfinite(row).all()):
        raise elsewhere
    size = [file.width, file.height]
    first = np.maximum(np.floor([column.min(), row.min()]), 0)
    last = np.minimum(np.ceil([column.max(), row.max()]) + 1, size)
    if (last <= first).any():
        raise elsewhere
    pixel = _pixel_size(place, (low + high) / 2, path)
    factor = np.maximum(FINEST / pixel, 1.0)
    factor *= max(np.sqrt(np.prod((last - first) / factor) / MOST_PIXELS), 1.0)
    counts = np.maximum(((last - first) / factor).astype(int), 1)
    read = pixel * (last - first) / counts
    moved = _moved(place.transform, first, (last - first) / counts)
    window = Window(*first.astype(int).tolist(), *(last - first).astype(int).tolist())
    shape = (int(counts[1]), int(counts[0]))
    issues = (*_unplaced(path, file), *_thinned(path, pixel, read))
    part = RasterPart(replace(place, transform=moved), issues, window, shape)
    if not part.covers(surface.vertices[:, :2]):
        raise elsewhere
    return part


def _elsewhere(path: Path, *, placed: bool) -> EnvgenError:
    if placed:
        what = "does not cover the road; check its coordinate reference system"
    else:
        what = (
            "has no georeferencing, and does not cover the road as pixels of 1 m from (0, 0); give"
            " it a place: gdal_translate -a_ullr"
        )
    return EnvgenError(f"{path}: {what}")


def _unplaced(path: Path, file: rasterio.DatasetReader) -> Iterator[Issue]:
    """An issue of a raster that does not say where it lies."""
    if file.transform.is_identity:
        yield Issue(
            "raster.unplaced",
            Severity.WARNING,
            str(path),
            "has no georeferencing",
            f"taken as pixels of 1 m, from (0, 0) to ({file.width}, {file.height}) of the road's"
            " coordinates, the first row in the south",
        )


def _pixel_size(place: RasterPlace, point: FloatArray, path: Path) -> FloatArray:
    """Width and height of a pixel at a point of the road frame, metres."""
    column, row = place.pixels(point + np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]))
    pixels_per_metre = np.stack([column[1:] - column[0], row[1:] - row[0]])
    try:
        size: FloatArray = np.linalg.norm(np.linalg.inv(pixels_per_metre), axis=0)
    except np.linalg.LinAlgError as error:
        raise EnvgenError(f"{path}: pixels without a size; check its transformation") from error
    return size


def _moved(transform: Affine, first: FloatArray, scale: FloatArray) -> Affine:
    """Transform of a window's pixels, each as large as `scale` of the raster's."""
    a, b, c, d, e, f = transform[:6]
    column, row = first
    x, y = scale
    return Affine(a * x, b * y, c + a * column + b * row, d * x, e * y, f + d * column + e * row)


def _thinned(path: Path, pixel: FloatArray, read: FloatArray) -> Iterator[Issue]:
    """An issue where thinning costs detail that the products would show."""
    if (read > np.maximum(pixel, FINEST) * 1.01).any():
        yield Issue(
            "raster.thinned",
            Severity.WARNING,
            str(path),
            f"the map needs more than {MOST_PIXELS:,} pixels of {pixel.min():.2g} m",
            f"read with pixels of {read.max():.2g} m",
        )


def clear_implausible(heights: FloatArray) -> FloatArray:
    """Replaces heights that no land has by NaN, in place, and returns them."""
    wrong = ~np.isnan(heights) & ~((heights >= LOWEST) & (heights <= HIGHEST))
    removed: FloatArray = heights[wrong]
    heights[wrong] = np.nan
    return removed

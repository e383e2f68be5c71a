"""Reads a digital elevation model and evaluates it in the road frame."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import rasterio
from rasterio.errors import RasterioError
from rasterio.transform import Affine
from rasterio.windows import Window
from scipy.ndimage import map_coordinates

from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.georeference import RasterPlace, place_raster
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.terrain.membrane import fill_membrane

DATUM_SHIFT = 10.0
"""Median height difference of road and model in metres; above it their vertical datums are
considered different."""
AROUND = 500.0
"""Metres of elevation model around the road; a larger value reads more of the file."""


@dataclass(frozen=True)
class Dem:
    """Digital elevation model.

    Attributes:
        heights: H x W, metres, without gaps.
        place: Position of the pixels.
        shift: Metres added to the model's heights; compensates a different vertical datum.
    """

    heights: FloatArray
    place: RasterPlace
    shift: float = 0.0

    def __call__(self, points: FloatArray) -> FloatArray:
        """Interpolates heights at points (N x 2, road frame) bilinearly; constant past the edge."""
        column, row = self.place.pixels(points)
        centres = np.stack([row, column]) - 0.5
        heights: FloatArray = map_coordinates(self.heights, centres, order=1, mode="nearest")
        return heights + self.shift - self.place.offset[2]


def read_dem(path: Path, surface: RoadSurface) -> Dem:
    """Reads the part of a digital elevation model around a road.

    Args:
        path: GeoTIFF (or any other GDAL raster) with heights in its first band. A file without a
            coordinate reference system is assumed to have that of the road.
        surface: The road with its coordinate reference system and offset.

    Raises:
        EnvgenError: The file cannot be read, does not cover the road, or requires a missing
            coordinate reference system of the road.
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
    """Returns the transform of a window's pixels."""
    a, b, c, d, e, f = transform[:6]
    column, row = window.col_off, window.row_off
    return Affine(a, b, c + a * column + b * row, d, e, f + d * column + e * row)


def _window(
    file: rasterio.DatasetReader, path: Path, place: RasterPlace, plan: FloatArray
) -> Window:
    """Returns the window of pixels around the road, within the raster."""
    low, high = plan.min(axis=0) - AROUND, plan.max(axis=0) + AROUND
    steps = np.linspace(low, high, 9)
    column, row = place.pixels(np.stack(np.meshgrid(*steps.T), axis=-1).reshape(-1, 2))
    first = np.maximum(np.floor([column.min(), row.min()]), 0).astype(int)
    last = np.minimum(np.ceil([column.max(), row.max()]) + 1, [file.width, file.height]).astype(int)
    road_column, road_row = place.pixels(plan)
    on_it = (road_column >= 0) & (road_column <= file.width)
    on_it &= (road_row >= 0) & (road_row <= file.height)
    if not on_it.any():
        raise EnvgenError(f"{path}: does not cover the road; check its coordinate reference system")
    return Window(*first, *(last - first))

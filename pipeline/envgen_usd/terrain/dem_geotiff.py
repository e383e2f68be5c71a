"""Reads a digital elevation model and evaluates it in the road frame."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.geometry.georeference import RasterPlace
from envgen_usd.geometry.raster_part import (
    HIGHEST,
    LOWEST,
    Placed,
    clear_implausible,
    find_part,
    opened_raster,
)
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
        issues: Decisions beyond the file.
    """

    heights: FloatArray
    place: RasterPlace
    shift: float = 0.0
    issues: tuple[Issue, ...] = ()

    def __call__(self, points: FloatArray) -> FloatArray:
        """Interpolates heights at points (N x 2, road frame) bilinearly; constant past the edge."""
        column, row = self.place.pixels(points)
        centres = np.stack([row, column]) - 0.5
        heights: FloatArray = map_coordinates(self.heights, centres, order=1, mode="nearest")
        return heights + self.shift - self.place.offset[2]


def read_dem(path: Path, surface: RoadSurface) -> Dem:
    """Reads the part of a digital elevation model around a road, and moves it to its datum.

    Args and errors are those of `read_model`.
    """
    dem = read_model(path, surface)
    difference = float(np.median(surface.vertices[:, 2] - dem(surface.vertices)))
    if abs(difference) <= DATUM_SHIFT:
        return dem
    side = "below" if difference > 0 else "above"
    text = f"the model lies {abs(difference):.1f} m {side} the road (median)"
    done = f"{'raised' if difference > 0 else 'lowered'} by {abs(difference):.1f} m"
    level = Issue("terrain.ground_level", Severity.WARNING, str(path), text, done)
    return replace(dem, shift=difference, issues=(*dem.issues, level))


def read_model(path: Path, surface: Placed) -> Dem:
    """Reads the part of a digital elevation model around a road, as it is.

    Args:
        path: GeoTIFF (or any other GDAL raster) with heights in its first band. A file without a
            coordinate reference system is assumed to have that of the road.
        surface: The road, or other points, with the coordinate reference system and offset.

    Raises:
        EnvgenError: The file cannot be read, does not cover the road, or requires a missing
            coordinate reference system of the road.
    """
    plan = surface.vertices[:, :2]
    with opened_raster(path) as file:
        part = find_part(file, path, surface, plan.min(axis=0) - AROUND, plan.max(axis=0) + AROUND)
        heights = part.read(file, np.nan).astype(np.float64)
    gaps = tuple(_clear_implausible(heights, path))
    if np.isnan(heights).all():
        raise EnvgenError(f"{path}: has no heights around the road")
    return Dem(fill_membrane(heights), part.place, issues=(*part.issues, *gaps))


def _clear_implausible(heights: FloatArray, path: Path) -> Iterator[Issue]:
    """Replaces heights that no land has by gaps, in place; an issue counts them."""
    wrong = clear_implausible(heights)
    if len(wrong):
        text = f"{len(wrong)} of {heights.size} heights, such as {wrong[0]:g}, "
        text += f"are not between {LOWEST:g} m and {HIGHEST:g} m"
        yield Issue("terrain.implausible", Severity.WARNING, str(path), text, "treated as gaps")

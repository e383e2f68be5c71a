"""Landuse from the user's map."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.geometry.georeference import RasterPlace
from envgen_usd.geometry.raster_part import find_part, opened_raster
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.landuse_geotiff import PLOT_BAND, plot_image
from envgen_usd.landuse.landuse_rules import draw_landuse
from envgen_usd.landuse.plot_sites import draw_sites
from envgen_usd.landuse.road_cells import road_cells
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.landuse.site_fitting import is_reached
from envgen_usd.landuse.specks import remove_specks
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray, IntArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.road_surface import RoadSurface

PLOT_CLASSES = (LanduseClass.LAWN, LanduseClass.RUBBLE)
"""Classes whose connected areas are plots."""
SPECK = 8.0
"""Largest area of a speck of the raster, m²; a larger value removes larger areas."""
LARGEST = 4.0
"""Largest area of a single plot, relative to the largest plot of the environment.

A larger value divides fewer areas into plots.
"""
AROUND = 50.0
"""Metres of the raster around the map; a larger value repairs specks at its edge more exactly."""
INSIDE = 0.75
"""Least share of a plot inside such an area; a larger value keeps fewer plots."""


@dataclass(frozen=True)
class GivenLanduse:
    """Landuse with classes from a raster and the road from the road file.

    Attributes:
        classes: H x W, `LanduseClass` values.
        place: Georeference of its pixels.
        plots: H x W, plot numbers, 0 without a plot; `None` if the raster does not separate plots.
        issues: Decisions beyond the file.
    """

    classes: ByteArray
    place: RasterPlace
    plots: IntArray | None = None
    issues: tuple[Issue, ...] = ()

    def generate(
        self, surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
    ) -> dict[Chunk, LanduseMap]:
        """See `LanduseProvider.generate`.

        1. Specks and small holes are repaired; unknown cells and cells outside the raster become
           grass.
        2. If the raster does not separate plots, each connected area of a plot class is a plot.
        3. Too large areas are divided into plots along the road by the rules.
        """
        outline = Outline.of(surface)
        pixels = self._pixels_per_area(surface)
        classes = remove_specks(self.classes, int(np.ceil(SPECK * pixels)))
        numbers = _areas(classes) if self.plots is None else self.plots
        most = LARGEST * profile.plots.frontage[1] * profile.plots.depth[1] * pixels
        large = (np.bincount(numbers.ravel()) > most)[numbers] & (numbers > 0)
        large &= self.plots is None
        clean = GivenLanduse(classes, self.place, np.where(large, 0, numbers))
        maps = {chunk: clean.chunk(chunk, outline) for chunk in chunks}
        if not large.any():
            return maps
        plots = self._lay_plots(large, surface, chunks, profile, seed)
        last = int(numbers.max())
        return {chunk: _with_plots(made, plots[chunk], last) for chunk, made in maps.items()}

    def classes_at(self, points: FloatArray) -> ByteArray:
        """Classes at points in the road frame (N x 2); `UNKNOWN` outside the raster."""
        values: ByteArray = self._values_at(points, self.classes)
        return values

    def chunk(self, chunk: Chunk, outline: Outline) -> LanduseMap:
        """Landuse of a chunk from the raster, with the road burnt in; no water touches it."""
        centres = np.stack(np.meshgrid(*chunk.cell_centres()), axis=-1).reshape(-1, 2)
        shape = (LANDUSE_CELLS, LANDUSE_CELLS)
        classes = self.classes_at(centres).reshape(shape)
        plots = np.zeros(shape, dtype=np.int64)
        if self.plots is not None:
            plots = self._values_at(centres, self.plots).reshape(shape)
        road, near = road_cells(chunk, outline)
        nothing = (classes == LanduseClass.UNKNOWN) | (classes == LanduseClass.ROAD)
        classes = np.where(nothing, np.uint8(LanduseClass.GRASS), classes)
        shore = near & (classes == LanduseClass.WATER)
        classes = np.where(shore, np.uint8(LanduseClass.VERGE), classes)
        classes = np.where(road, np.uint8(LanduseClass.ROAD), classes)
        return LanduseMap(chunk, classes.astype(np.uint8), np.where(road, 0, plots))

    def _lay_plots(
        self,
        large: BoolArray,
        surface: RoadSurface,
        chunks: Sequence[Chunk],
        profile: Profile,
        seed: int,
    ) -> dict[Chunk, LanduseMap]:
        """Landuse by rules with plots in the large areas only."""
        roadsides = find_roadsides(surface, profile.plots, seed)
        sites = draw_sites(roadsides, profile.plots, seed)
        corners = sites.polygons()
        across, back = np.meshgrid(*[np.linspace(0.1, 0.9, 5)] * 2)
        u, v = across.ravel()[:, None], back.ravel()[:, None]
        front, rear = (
            corners[:, None, first] * (1 - u) + corners[:, None, second] * u
            for first, second in ((0, 1), (3, 2))
        )
        inside = self._values_at((front * (1 - v) + rear * v).reshape(-1, 2), large)
        share = inside.reshape(len(sites), -1).mean(axis=1)
        within = share >= INSIDE
        kept = np.flatnonzero(within & is_reached(sites, within))
        sites = sites.take(kept, np.ones(len(kept)))
        return draw_landuse(surface, chunks, profile, seed, (roadsides, sites))

    def _pixels_per_area(self, surface: RoadSurface) -> float:
        """Pixels of the raster per square metre at the road."""
        middle = surface.vertices[:, :2].mean(axis=0)
        steps = middle + np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
        column, row = (values - values[0] for values in self.place.pixels(steps))
        return float(abs(column[1] * row[2] - column[2] * row[1]))

    def _values_at(self, points: FloatArray, raster: np.ndarray) -> np.ndarray:
        column, row = (np.floor(v).astype(np.int64) for v in self.place.pixels(points))
        height, width = raster.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        values = raster[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
        return np.where(inside, values, 0)


def _areas(classes: ByteArray) -> IntArray:
    """Labels of connected areas of each plot class; 0 elsewhere."""
    numbers = np.zeros(classes.shape, dtype=np.int64)
    for kind in PLOT_CLASSES:
        labels, _ = ndimage.label(classes == kind)
        numbers = np.where(labels > 0, labels + numbers.max(), numbers)
    return numbers


def _with_plots(given: LanduseMap, rules: LanduseMap, last: int) -> LanduseMap:
    """Adds plots by rules with their entrances, numbered after the last plot of the raster."""
    free = (given.plots == 0) & (given.classes != LanduseClass.ROAD)
    paved = free & np.isin(rules.classes, (LanduseClass.ACCESS, LanduseClass.ROAD_END))
    classes = np.where(paved, rules.classes, given.classes)
    numbers = np.where(free & (rules.plots > 0), rules.plots + last, given.plots)
    return LanduseMap(given.chunk, classes.astype(np.uint8), numbers)


def read_given_landuse(path: Path, surface: RoadSurface, chunks: Sequence[Chunk]) -> GivenLanduse:
    """Reads the part of the user's landuse map that replaces generated landuse.

    Args:
        path: GeoTIFF (or any raster that GDAL reads) with `LanduseClass` values in its first band.
            Without a CRS, the road's CRS is assumed. A band with the description ``plot`` holds
            plot numbers, 0 without a plot.
        surface: Road surface with its CRS and offset.
        chunks: Tiles of the map.

    Raises:
        EnvgenError: The file cannot be read, holds other values, does not cover the road, or has no
            usable georeference.
    """
    corners = np.array([chunk.bounds for chunk in chunks]).reshape(-1, 2)
    points = np.concatenate([corners, surface.vertices[:, :2]])
    low, high = points.min(axis=0) - AROUND, points.max(axis=0) + AROUND
    with opened_raster(path) as file:
        part = find_part(file, path, surface, low, high)
        classes = part.read(file, 0)
        ours = "ENVGEN_CHUNK" in file.tags()
        plots = None
        if PLOT_BAND in file.descriptions:
            plots = part.read(file, 0, file.descriptions.index(PLOT_BAND) + 1)
    if ours:
        with opened_raster(plot_image(path)) as file:
            plots = part.read(file, 0)
    _check_classes(classes, path)
    numbers = None if plots is None else plots.astype(np.int64)
    given = GivenLanduse(classes.astype(np.uint8), part.place, numbers, part.issues)
    if not np.any(given.classes_at(surface.vertices[:, :2])):
        raise EnvgenError(f"{path}: does not cover the road; is its reference system right?")
    return given


def _check_classes(classes: np.ndarray, path: Path) -> None:
    known = [int(kind) for kind in LanduseClass]
    if unknown := sorted(set(np.unique(classes).tolist()) - set(known)):
        raise EnvgenError(
            f"{path}: holds values {unknown[:5]} that are not landuse classes; known: "
            + ", ".join(f"{int(kind)} {kind.name.lower()}" for kind in LanduseClass)
        )

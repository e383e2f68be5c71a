"""Landuse from a map that somebody else made."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.geometry.georeference import RasterPlace
from envgen_usd.geometry.outline import Outline
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.landuse.rules import draw_landuse
from envgen_usd.landuse.sites import draw_sites
from envgen_usd.landuse.specks import remove_specks
from envgen_usd.models.arrays import BoolArray, ByteArray, FloatArray, IntArray
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface

PLOT_CLASSES = (LanduseClass.LAWN, LanduseClass.RUBBLE)
"""Classes whose connected areas are plots."""
SPECK = 8.0
"""Square metres below which an area is a speck of the raster."""
LARGEST = 4.0
"""Areas of the largest plot of the environment beyond which an area holds many plots."""
INSIDE = 0.75
"""Share of a plot that has to lie in such an area."""


@dataclass(frozen=True)
class GivenLanduse:
    """A provider that takes classes from a raster and the road from the road.

    Attributes:
        classes: H x W, `LanduseClass` values.
        place: Where its pixels lie.
        plots: H x W, numbers of plots, 0 for none; none where the raster does not tell plots
            apart.
    """

    classes: ByteArray
    place: RasterPlace
    plots: IntArray | None = None

    def generate(
        self, surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
    ) -> dict[Chunk, LanduseMap]:
        """See `LanduseProvider.generate`.

        1. Specks and small holes are repaired; where the raster is unknown or ends there is grass.
        2. Where the raster does not tell plots apart, a connected area of a plot class is a plot.
        3. If it is too large for that, the rules lay plots into it along the road.
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
        """Classes at places in the road frame (N x 2); unknown outside the raster."""
        found: ByteArray = self._values_at(points, self.classes)
        return found

    def chunk(self, chunk: Chunk, outline: Outline) -> LanduseMap:
        """Landuse of one chunk as the raster has it, with the road in it."""
        centres = np.stack(np.meshgrid(*chunk.cell_centres()), axis=-1).reshape(-1, 2)
        shape = (LANDUSE_CELLS, LANDUSE_CELLS)
        classes = self.classes_at(centres).reshape(shape)
        plots = np.zeros(shape, dtype=np.int64)
        if self.plots is not None:
            plots = self._values_at(centres, self.plots).reshape(shape)
        road = outline.encloses_grid(*chunk.cell_centres())
        nothing = (classes == LanduseClass.UNKNOWN) | (classes == LanduseClass.ROAD)
        classes = np.where(nothing, np.uint8(LanduseClass.GRASS), classes)
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
        """Landuse by rules whose plots lie in large areas."""
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
        kept = np.flatnonzero(share >= INSIDE)
        sites = sites.take(kept, np.ones(len(kept)))
        return draw_landuse(surface, chunks, profile, seed, (roadsides, sites))

    def _pixels_per_area(self, surface: RoadSurface) -> float:
        """Pixels of the raster on a square metre at the road."""
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
    """Numbers of connected areas of each plot class; 0 elsewhere."""
    numbers = np.zeros(classes.shape, dtype=np.int64)
    for kind in PLOT_CLASSES:
        labels, _ = ndimage.label(classes == kind)
        numbers = np.where(labels > 0, labels + numbers.max(), numbers)
    return numbers


def _with_plots(made: LanduseMap, rules: LanduseMap, last: int) -> LanduseMap:
    """Adds plots by rules, with their entrances, numbered after the last of the raster's."""
    free = (made.plots == 0) & (made.classes != LanduseClass.ROAD)
    paved = free & (rules.classes == LanduseClass.ACCESS)
    classes = np.where(paved, np.uint8(LanduseClass.ACCESS), made.classes)
    numbers = np.where(free & (rules.plots > 0), rules.plots + last, made.plots)
    return LanduseMap(made.chunk, classes.astype(np.uint8), numbers)

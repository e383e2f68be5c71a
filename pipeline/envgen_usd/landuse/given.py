"""Landuse from a map that somebody else made."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.geometry.georeference import RasterPlace
from envgen_usd.geometry.outline import Outline
from envgen_usd.models.arrays import ByteArray, FloatArray, IntArray
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface

PLOT_CLASSES = (LanduseClass.LAWN, LanduseClass.RUBBLE)
"""Classes whose connected areas are plots."""


@dataclass(frozen=True)
class GivenLanduse:
    """A provider that takes classes from a raster and the road from the road.

    Attributes:
        classes: H x W, `LanduseClass` values.
        place: Where its pixels lie.
    """

    classes: ByteArray
    place: RasterPlace

    def generate(
        self,
        surface: RoadSurface,
        chunks: Sequence[Chunk],
        profile: Profile,  # noqa: ARG002 - part of the provider's interface
        seed: int,  # noqa: ARG002
    ) -> dict[Chunk, LanduseMap]:
        """See `LanduseProvider.generate`; the profile and the seed change nothing.

        Where the raster is unknown or ends there is grass. Connected areas of plot classes are
        plots.
        """
        outline = Outline.of(surface)
        numbers = self._plots()
        return {chunk: self._chunk(chunk, outline, numbers) for chunk in chunks}

    def classes_at(self, points: FloatArray) -> ByteArray:
        """Classes at places in the road frame (N x 2); unknown outside the raster."""
        found: ByteArray = self._values_at(points, self.classes)
        return found

    def _chunk(self, chunk: Chunk, outline: Outline, numbers: IntArray) -> LanduseMap:
        centres = np.stack(np.meshgrid(*chunk.cell_centres()), axis=-1).reshape(-1, 2)
        shape = (LANDUSE_CELLS, LANDUSE_CELLS)
        classes = self.classes_at(centres).reshape(shape)
        plots = self._values_at(centres, numbers).reshape(shape)
        road = outline.encloses_grid(*chunk.cell_centres())
        nothing = (classes == LanduseClass.UNKNOWN) | (classes == LanduseClass.ROAD)
        classes = np.where(nothing, np.uint8(LanduseClass.GRASS), classes)
        classes = np.where(road, np.uint8(LanduseClass.ROAD), classes)
        return LanduseMap(chunk, classes.astype(np.uint8), np.where(road, 0, plots))

    def _plots(self) -> IntArray:
        """Numbers of connected areas of each plot class."""
        numbers = np.zeros(self.classes.shape, dtype=np.int64)
        for kind in PLOT_CLASSES:
            labels, _ = ndimage.label(self.classes == kind)
            numbers = np.where(labels > 0, labels + numbers.max(), numbers)
        return numbers

    def _values_at(self, points: FloatArray, raster: np.ndarray) -> np.ndarray:
        column, row = (np.floor(v).astype(np.int64) for v in self.place.pixels(points))
        height, width = raster.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        values = raster[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
        return np.where(inside, values, 0)

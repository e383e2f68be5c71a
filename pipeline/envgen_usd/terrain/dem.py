"""A real terrain, asked for heights in the road frame."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from envgen_usd.geometry.georeference import RasterPlace
from envgen_usd.models.arrays import FloatArray


@dataclass(frozen=True)
class Dem:
    """Digital elevation model.

    Attributes:
        heights: H x W, metres, no gaps.
        place: Where its pixels lie.
        shift: Metres added to the model's heights: where road and model use different vertical
            datums, the model is moved to the road.
    """

    heights: FloatArray
    place: RasterPlace
    shift: float = 0.0

    def __call__(self, points: FloatArray) -> FloatArray:
        """Heights in the road frame at places (N x 2), bilinear; past the model's edge its edge."""
        column, row = self.place.pixels(points)
        centres = np.stack([row, column]) - 0.5
        heights: FloatArray = map_coordinates(self.heights, centres, order=1, mode="nearest")
        return heights + self.shift - self.place.offset[2]

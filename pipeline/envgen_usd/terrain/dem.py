"""A real terrain, asked for heights in the road frame."""

from dataclasses import dataclass

import numpy as np
from pyproj import Transformer
from rasterio.transform import Affine
from scipy.ndimage import map_coordinates

from envgen_usd.geometry.georeference import Offset
from envgen_usd.models.arrays import FloatArray


@dataclass(frozen=True)
class Dem:
    """Digital elevation model.

    Attributes:
        heights: H x W, metres, no gaps.
        transform: From pixel (column, row) to the model's coordinates.
        to_model: From the road's reference system to the model's; none where both are the same.
        offset: What has to be added to road-frame coordinates.
        shift: Metres added to the model's heights: where road and model use different vertical
            datums, the model is moved to the road.
    """

    heights: FloatArray
    transform: Affine
    to_model: Transformer | None
    offset: Offset
    shift: float = 0.0

    def __call__(self, points: FloatArray) -> FloatArray:
        """Heights in the road frame at places (N x 2), bilinear; past the model's edge its edge."""
        column, row = self.pixels(points)
        place = np.stack([row, column]) - 0.5
        heights: FloatArray = map_coordinates(self.heights, place, order=1, mode="nearest")
        return heights + self.shift - self.offset[2]

    def pixels(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Column and row of places in the road frame; the first pixel reaches from 0 to 1."""
        x, y = (points[:, :2] + self.offset[:2]).T
        if self.to_model is not None:
            x, y = self.to_model.transform(x, y)
        a, b, c, d, e, f = (~self.transform)[:6]
        return a * x + b * y + c, d * x + e * y + f

"""Ground truth for networks of heights."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from envgen_usd.chunks import CHUNK_SIZE
from envgen_usd.landuse.network.data.training_sample import Sample
from envgen_usd.models.array_types import BoolArray

HEIGHT_CELLS = 16
"""Cells of heights along a side of a chunk, fewer than of landuse: ground is smoother, and streets
farther away tell of it."""
HEIGHT_CELL = CHUNK_SIZE / HEIGHT_CELLS
"""Side of a cell of heights, metres."""
HEIGHT_CONDITIONS = 1
"""Length of the condition: how much the heights of the roads differ."""
HEIGHT_RAW = ("distance", "normal_x", "normal_y", "above")
"""Stored fields: distance and unit vector from the road's outline, and height of the nearest road.

Distance in metres; height in metres above the reference.

"""


@dataclass(frozen=True)
class HeightSample(Sample):
    """Heights of a square.

    Attributes:
        reference: S x S, metres: the ground interpolated from the road alone.
        rise: S x S, metres: true ground minus reference; 0 on the road.
        road: S x S, cells of the road.
    """

    reference: NDArray[np.float32]
    rise: NDArray[np.float32]
    road: BoolArray
    CELLS: ClassVar[tuple[str, ...]] = ("reference", "rise", "road")
    VECTOR: ClassVar[tuple[int, int]] = (
        HEIGHT_RAW.index("normal_x"),
        HEIGHT_RAW.index("normal_y"),
    )

    @property
    def heights(self) -> NDArray[np.float32]:
        """True heights, S x S, metres."""
        return self.reference + self.rise

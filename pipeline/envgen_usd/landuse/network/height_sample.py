"""Ground truth for networks that make heights."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from envgen_usd.landuse.network.sample import Sample
from envgen_usd.models.arrays import BoolArray

HEIGHT_RAW = ("distance", "normal_x", "normal_y", "above")
"""Fields as they are stored: metres to the road's outline, unit vector from there to the cell,
metres from the reference up to the nearest height of the road."""


@dataclass(frozen=True)
class HeightSample(Sample):
    """Heights of a square.

    Attributes:
        reference: S x S, metres: the ground that the road alone tells.
        rise: S x S, metres from the reference up to the true ground; 0 on the road.
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

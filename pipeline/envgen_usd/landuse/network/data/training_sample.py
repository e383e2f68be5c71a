"""Common base of all ground truth: cell maps, stored fields, a condition."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

Move = Callable[[NDArray[Any]], NDArray[Any]]
"""Crops or rotates maps (... x H x W) in their plane."""


@dataclass(frozen=True)
class Sample:
    """Ground truth of a square.

    Attributes:
        raw: Stored fields x S / 2 x S / 2: blocks of 2 x 2 cells share a position; row 0 is the
            south.
        condition: Numbers of the environment.
        CELLS: Names of the cell maps, S x S.
        VECTOR: Stored fields that are the x and the y of a direction.
    """

    raw: NDArray[np.float16]
    condition: NDArray[np.float32]
    CELLS: ClassVar[tuple[str, ...]] = ()
    VECTOR: ClassVar[tuple[int, int]]

    @property
    def side(self) -> int:
        """Side length, cells."""
        return 2 * int(self.raw.shape[-1])

    def moved(self, cells: Move, places: Move) -> Self:
        """The sample with transformed cell maps and stored fields."""
        maps: dict[str, Any] = {name: cells(getattr(self, name)) for name in self.CELLS}
        return replace(self, raw=places(self.raw), **maps)

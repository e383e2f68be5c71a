"""The order in which cells of a hole are sampled: far apart at first.

Cells that are sampled at once do not see each other, so they should be as independent as possible.
A low-discrepancy order keeps them apart at each share, while random cells may be neighbours
(Besnier et al. 2025, Halton scheduler; here the ordered-dither matrix of Bayer 1973).
"""

import numpy as np
from numpy.typing import NDArray

_BITS = 9
"""The order repeats every 2^9 cells."""


def dispersed_order(
    shape: tuple[int, int], rng: np.random.Generator, corner: tuple[int, int] = (0, 0)
) -> NDArray[np.float32]:
    """Numbers in [0, 1) for cells, H x W: those below a share of 4^-k lie 2^k cells apart.

    Args:
        shape: Rows and columns.
        rng: Draws the shift of the order over the map.
        corner: Row and column of the first cell: windows of one map with one shift agree.
    """
    shift = rng.integers(2**_BITS, size=2) + corner
    row, column = (np.arange(size) + start for size, start in zip(shape, shift, strict=True))
    order = np.zeros(shape, dtype=np.int64)
    for bit in range(_BITS):
        upper, right = (row >> bit & 1)[:, None], (column >> bit & 1)[None, :]
        order = order * 4 + 2 * (upper ^ right) + upper
    numbers: NDArray[np.float32] = (order / 4**_BITS).astype(np.float32)
    return numbers

"""Interpolates scattered heights on a grid by a membrane (Laplace's equation)."""

import numpy as np

from envgen_usd.models.array_types import FloatArray

SWEEPS = 16
"""Gauss-Seidel sweeps on each level except the coarsest; a larger value reduces the error."""
COARSEST_SWEEPS = 200
"""Gauss-Seidel sweeps on the coarsest level; a larger value reduces the error."""
COARSEST_NODES = 64
"""Largest number of nodes of the coarsest level."""


def fill_membrane(known: FloatArray) -> FloatArray:
    """Fills free nodes of a grid so that each is the mean of its neighbours.

    Cascadic multigrid (Bornemann and Deuflhard, 1996) solves on a coarse grid and refines level by
    level, with natural (reflecting) borders. By the maximum principle, values stay in the range of
    the known heights.

    Args:
        known: H x W, metres; NaN at free nodes.

    Returns:
        H x W, metres; known nodes unchanged; zeros without any known node.
    """
    fixed = ~np.isnan(known)
    if fixed.all():
        return known.copy()
    if not fixed.any():
        return np.zeros_like(known)
    if known.size <= COARSEST_NODES or min(known.shape) < 3:
        return _relax(known, known[fixed].mean(), COARSEST_SWEEPS)
    return _relax(known, _refine(fill_membrane(_coarsen(known)), known.shape), SWEEPS)


def _coarsen(known: FloatArray) -> FloatArray:
    """Returns every second node: the mean of the known nodes among its 3 x 3, otherwise NaN."""
    height, width = known.shape
    rows, columns = (height + 2) // 2, (width + 2) // 2
    padded = np.full((2 * rows + 1, 2 * columns + 1), np.nan)
    padded[1 : height + 1, 1 : width + 1] = known
    fixed = ~np.isnan(padded)
    filled = np.where(fixed, padded, 0.0)
    total, count = np.zeros((rows, columns)), np.zeros((rows, columns))
    for j in range(3):
        for i in range(3):
            window = np.s_[j : j + 2 * rows - 1 : 2, i : i + 2 * columns - 1 : 2]
            total += filled[window]
            count += fixed[window]
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _refine(coarse: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Interpolates bilinearly onto the grid of twice the density."""
    rows, columns = coarse.shape
    fine = np.empty((2 * rows - 1, 2 * columns - 1))
    fine[::2, ::2] = coarse
    fine[1::2, ::2] = (coarse[:-1] + coarse[1:]) / 2
    fine[:, 1::2] = (fine[:, :-1:2] + fine[:, 2::2]) / 2
    return fine[: shape[0], : shape[1]]


def _relax(known: FloatArray, start: FloatArray | np.float64, sweeps: int) -> FloatArray:
    """Performs red-black Gauss-Seidel sweeps at free nodes, NaN, from their start."""
    fixed = ~np.isnan(known)
    padded = np.pad(np.where(fixed, known, start), 1, mode="edge")
    del start  # as large as the grid
    # Every second node of every second row: two such lattices have a colour.
    lattices = [
        (np.s_[1 + row : -1 : 2, 1 + column : -1 : 2], ~fixed[row::2, column::2], row, column)
        for colour in (1, 0)
        for row, column in ((0, colour), (1, 1 - colour))
    ]
    for _ in range(sweeps):
        for number, (nodes, free, row, column) in enumerate(lattices):
            mean = padded[row:-2:2, 1 + column : -1 : 2] + padded[2 + row :: 2, 1 + column : -1 : 2]
            mean += padded[1 + row : -1 : 2, column:-2:2]
            mean += padded[1 + row : -1 : 2, 2 + column :: 2]
            mean *= 0.25
            np.copyto(padded[nodes], mean, where=free)
            if number % 2:
                padded[0], padded[-1] = padded[1], padded[-2]
                padded[:, 0], padded[:, -1] = padded[:, 1], padded[:, -2]
    return padded[1:-1, 1:-1].copy()

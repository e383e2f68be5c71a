"""Ground between roads on a grid: a plane, and a membrane above it."""

from functools import cache

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from envgen_usd.models.array_types import BoolArray, FloatArray

_TILT = 0.5
"""Weight of a level plane beside the cells of the road; a larger value trusts few of them less."""
_SCALE = 8.0
"""Cells in which slopes are measured for that, so that both are of order one."""


def ground_of_roads(heights: FloatArray, road: BoolArray) -> FloatArray:
    """Interpolates the ground from the cells of roads.

    A plane is fitted to them, and each other cell is the mean of its neighbours above it, with
    natural borders. It is solved to the end: `fill_membrane` of the terrain, made for millions of
    nodes, is 0.4 m off where roads are few.

    Args:
        heights: H x W, metres; those of cells without road do not count.
        road: H x W.

    Returns:
        H x W, metres; the heights on roads, 0 without any road.
    """
    if not road.any():
        return np.zeros(heights.shape)
    rows, columns = np.indices(heights.shape) - (np.array(heights.shape) - 1)[:, None, None] / 2.0
    terms = np.stack([np.ones(heights.shape), rows / _SCALE, columns / _SCALE])
    known = terms[:, road]
    mean = heights[road].mean()
    normal = known @ known.T + np.diag([0.0, _TILT, _TILT])
    plane = mean + np.tensordot(np.linalg.solve(normal, known @ (heights[road] - mean)), terms, 1)
    above = np.where(road, heights - plane, 0.0).ravel()
    laplace, fixed = _laplace(*heights.shape), road.ravel()
    free = ~fixed
    if free.any():
        pull = -laplace[free][:, fixed] @ above[fixed]
        above[free] = splu(laplace[free][:, free].tocsc()).solve(pull)
    ground: FloatArray = plane + above.reshape(heights.shape)
    return ground


@cache
def _laplace(height: int, width: int) -> sparse.csr_matrix:
    """Each cell's number of neighbours times its value, less theirs."""
    number = np.arange(height * width).reshape(height, width)
    first = np.concatenate([number[:, :-1].ravel(), number[:-1].ravel()])
    second = np.concatenate([number[:, 1:].ravel(), number[1:].ravel()])
    links = sparse.coo_matrix((np.ones(len(first)), (first, second)), (number.size,) * 2)
    both = (links + links.T).tocsr()
    return sparse.diags(np.asarray(both.sum(axis=1)).ravel()).tocsr() - both

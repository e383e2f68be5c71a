"""Solves symmetric positive definite systems with a band of entries beside the diagonal."""

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray

_TILE = 32
"""Unknowns of a tile; products of larger tiles would wake the threads of a linear algebra library,
which costs more than it saves."""


def solve_banded(
    rows: IntArray, columns: IntArray, values: FloatArray, right: FloatArray
) -> FloatArray:
    """Solves a system by elimination of tiles of unknowns, in their order.

    Time grows with the number of unknowns and with the square of the width of the band. Golub and
    Van Loan (2013), Matrix Computations, 4.3 and 4.5.

    Args:
        rows: E, row of each entry of the matrix, which has both halves.
        columns: E, its column.
        values: E; values at one place add up.
        right: N, the right side.

    Returns:
        N, the solution.
    """
    tiles, band = _tiles(rows, columns, values, len(right))
    load = np.zeros((len(band), _TILE))
    load.ravel()[: len(right)] = right
    above, below = np.triu_indices(band.shape[1] - 1)
    inverses = []
    for k in range(tiles):
        # Squares of triangular factors keep what is left positive, as inverses of tiles do not.
        inverse = np.linalg.inv(np.linalg.cholesky(band[k, 0]))
        inverses.append(inverse)
        share = inverse @ band[k, 1:]
        load[k] = inverse @ load[k]
        turned = share.transpose(0, 2, 1)
        band[k + 1 + above, below - above] -= turned[above] @ share[below]
        load[k + 1 : k + 1 + len(share)] -= turned @ load[k]
        band[k, 1:] = share
    for k in range(tiles - 1, -1, -1):
        beyond = load[k + 1 : k + band.shape[1], :, None]
        load[k] = inverses[k].T @ (load[k] - (band[k, 1:] @ beyond).sum(axis=0)[:, 0])
    return load.ravel()[: len(right)]


def _tiles(
    rows: IntArray, columns: IntArray, values: FloatArray, count: int
) -> tuple[int, FloatArray]:
    """Returns the number of tiles, and the tiles on and right of the diagonal by row of tiles.

    Tiles behind the last unknowns are empty but for ones on the diagonal.
    """
    ahead = columns // _TILE - rows // _TILE
    chosen = np.flatnonzero(ahead >= 0)
    width = int(ahead.max(initial=0)) + 1
    tiles = -(-count // _TILE)
    shape = tiles + width - 1, width, _TILE, _TILE
    place: IntArray = np.ravel_multi_index(
        (rows[chosen] // _TILE, ahead[chosen], rows[chosen] % _TILE, columns[chosen] % _TILE), shape
    )
    band = np.zeros(shape)
    np.add.at(band.ravel(), place, values[chosen])
    spare = np.arange(count, tiles * _TILE)
    band[spare // _TILE, 0, spare % _TILE, spare % _TILE] = 1.0
    return tiles, band

"""Values of a chunk with a margin of those around it."""

from collections.abc import Callable

import numpy as np

from envgen_usd.chunks import LANDUSE_CELLS, Chunk

Values = np.ndarray


def with_surroundings(
    chunk: Chunk, values: Callable[[Chunk], Values | None], margin: int, empty: float
) -> Values:
    """Returns the values of a chunk and of a margin around it.

    Args:
        chunk: The chunk.
        values: Values of a chunk, 255 x 255 (of cells) or 256 x 256 (of the grid's corners), or
            `None` where there is no chunk.
        margin: Width of the margin, cells; at most 255.
        empty: Value where there is no chunk.
    """
    own = values(chunk)
    assert own is not None
    extra = len(own) - LANDUSE_CELLS
    joined = np.full((3 * LANDUSE_CELLS + extra,) * 2, empty, own.dtype)
    # The chunk itself comes last, so that its corners count on its border.
    for near in (*chunk.neighbours(), chunk):
        found = values(near)
        if found is not None:
            row, column = ((near.y - chunk.y + 1), (near.x - chunk.x + 1))
            joined[
                row * LANDUSE_CELLS : row * LANDUSE_CELLS + len(own),
                column * LANDUSE_CELLS : column * LANDUSE_CELLS + len(own),
            ] = found
    kept = slice(LANDUSE_CELLS - margin, 2 * LANDUSE_CELLS + extra + margin)
    return joined[kept, kept]

"""Blocks of rows of a grid that stay in the cache of a core."""

from collections.abc import Iterator

from envgen_usd.models.array_types import FloatArray

_VALUES = 1 << 16
"""Values of a block; what is done to a larger one many times waits for the memory each time."""


def cached_rows(grid: FloatArray) -> Iterator[slice]:
    """Yields slices of rows that follow one another and cover a grid, H x W."""
    height, width = grid.shape
    step = max(_VALUES // max(width, 1), 1)
    for first in range(0, height, step):
        yield slice(first, min(first + step, height))

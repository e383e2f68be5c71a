"""Ground faces over blocks of grid cells that are flat and alike, without T-junctions."""

from collections.abc import Iterator, Sequence

import numpy as np

from envgen_usd.chunks import LANDUSE_CELLS
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.terrain.grid_faces import Faces

SIZES = (16, 8, 4, 2)
"""Cells along the sides of the blocks that are tried; 16 are 12.5 m."""
FLATNESS = 0.0025
"""Largest distance in metres of a grid vertex from the plane of its block, half of the faces'
largest error; a larger value saves faces on slopes that bend."""


def joined_faces(
    kinds: IntArray, heights: FloatArray, codes: IntArray, used: BoolArray
) -> tuple[Faces, Faces]:
    """Joins cells of a kind into the largest blocks that are flat.

    A block is a quad, or a fan of triangles around its middle if other faces have vertices on its
    sides. All vertices of the chunk's border are kept, so neighbouring chunks match.

    Args:
        kinds: 255 x 255, kind of each cell; below 0 for cells without a face.
        heights: 256 x 256, metres, at the grid's corners.
        codes: 256 x 256, codes of the grid's corners.
        used: 256 x 256, True for the grid's corners that other faces have.

    Returns:
        Quads; triangles.
    """
    blocks = _blocks(kinds, heights)
    kept = used.copy()
    kept[[0, -1]] = kept[:, [0, -1]] = True
    for size, (row, column) in blocks.items():
        for up, right in ((0, 0), (0, size), (size, 0), (size, size)):
            kept[row + up, column + right] = True
    faces = [_faces(*block, size, codes, kept) for size, block in blocks.items()]
    return _joined([quads for quads, _ in faces]), _joined([fans for _, fans in faces])


def _blocks(kinds: IntArray, heights: FloatArray) -> dict[int, tuple[IntArray, IntArray]]:
    """Rows and columns of the south-west cells of all blocks, by their size in cells."""
    free = kinds >= 0
    blocks: dict[int, tuple[IntArray, IntArray]] = {}
    for size in SIZES:
        count = LANDUSE_CELLS // size
        shape, end = (count, size, count, size), count * size
        cells, open_cells = (each[:end, :end].reshape(shape) for each in (kinds, free))
        alike = cells.min(axis=(1, 3)) == cells.max(axis=(1, 3))
        found = alike & open_cells.all(axis=(1, 3)) & _is_flat(heights, size)
        free[:end, :end] &= ~found.repeat(size, axis=0).repeat(size, axis=1)
        row, column = np.nonzero(found)
        blocks[size] = row * size, column * size
    row, column = np.nonzero(free)
    return {**blocks, 1: (row, column)}


def _is_flat(heights: FloatArray, size: int) -> BoolArray:
    """Tells which blocks lie in the plane of three of their corners: B x B."""
    count, share = LANDUSE_CELLS // size, np.arange(size + 1) / size
    lines = size * np.arange(count)[:, None] + np.arange(size + 1)
    inside = heights[lines[:, None, :, None], lines[None, :, None, :]]  # B x B x corners
    first = inside[:, :, :1, :1]
    plane = first + (inside[:, :, -1:, :1] - first) * share[:, None]
    plane = plane + (inside[:, :, :1, -1:] - first) * share
    flat: BoolArray = (np.abs(inside - plane) <= FLATNESS).all(axis=(2, 3))
    return flat


def _faces(
    row: IntArray, column: IntArray, size: int, codes: IntArray, kept: BoolArray
) -> tuple[Faces, Faces]:
    """Quads and fans of the blocks of a size."""
    up, right = np.array(list(_perimeter(size))).T  # counter-clockwise from the south-west
    rows, columns = row[:, None] + up, column[:, None] + right
    shown = kept[rows, columns]
    whole = shown.sum(axis=1) == 4
    corners = codes[rows[whole][:, ::size], columns[whole][:, ::size]]
    middle = size // 2
    cells = (row[whole] + middle) * LANDUSE_CELLS + column[whole] + middle
    block, place = np.nonzero(shown[~whole])
    rows, columns, row, column = rows[~whole], columns[~whole], row[~whole], column[~whole]
    first = np.searchsorted(block, np.arange(len(row)))
    following = np.arange(1, len(block) + 1)
    following[np.append(first[1:], len(block))[: len(row)] - 1] = first
    sides = [(block, place), (block, place[following])]
    ring = [(rows[side], columns[side]) for side in sides]
    triangles = np.column_stack(
        [codes[row[block] + middle, column[block] + middle], *(codes[side] for side in ring)]
    )
    at = [
        (3 * start[block] + middle + sum(side[axis] - start[block] for side in ring)) // 3
        for axis, start in enumerate((row, column))
    ]
    return Faces(corners, cells), Faces(triangles, at[0] * LANDUSE_CELLS + at[1])


def _perimeter(size: int) -> Iterator[tuple[int, int]]:
    """Steps north and east from the south-west corner of a block to the corners on its sides."""
    steps = range(size)
    yield from ((0, step) for step in steps)
    yield from ((step, size) for step in steps)
    yield from ((size, size - step) for step in steps)
    yield from ((size - step, 0) for step in steps)


def _joined(faces: Sequence[Faces]) -> Faces:
    corners = np.concatenate([each.corners for each in faces])
    return Faces(corners, np.concatenate([each.cells for each in faces]))

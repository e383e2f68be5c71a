"""Rows of the land, along which trees of orchards and containers of harbours stand."""

from typing import TypeVar

import numpy as np

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, Chunk
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.landuse import ROW_UNIT, LanduseMap

Values = TypeVar("Values", FloatArray, IntArray)


def directions_of(landuse: LanduseMap) -> IntArray:
    """Direction of the rows of each cell, 255 x 255, as in `LanduseMap.rows`; 0 without any."""
    return np.zeros_like(landuse.plots) if landuse.rows is None else landuse.rows


def row_axes(direction: int) -> FloatArray:
    """Unit vectors along and across rows of a direction, 2 x 2."""
    angle = direction * ROW_UNIT
    along = np.array([np.cos(angle), np.sin(angle)])
    return np.stack([along, [-along[1], along[0]]])


def span_of(chunk: Chunk, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and largest coordinates of a chunk along axes (2 x 2), metres."""
    corners = chunk.origin + CHUNK_SIZE * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    along = corners @ axes.T
    return along.min(axis=0), along.max(axis=0)


def at_points(values: Values, points: FloatArray, chunk: Chunk) -> Values:
    """Values (255 x 255) of the cells of points (... x 2); beyond the chunk, of its border."""
    cells = ((points - chunk.origin) / CELL_SIZE).astype(np.int64)
    column, row = np.moveaxis(np.clip(cells, 0, len(values) - 1), -1, 0)
    found: Values = values[row, column]
    return found

"""The ground where parts of a map meet, whose corrections fade into one another."""

from collections.abc import Iterable

import numpy as np

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.geometry.square_index import Bounds
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.terrain.height_lattice import Extent, Lattice
from envgen_usd.terrain.terrain_field import TerrainField

FADING = 100.0
"""Distance beyond its part over which a correction fades, metres.

A larger value joins parts more smoothly, and has to stay below `SURROUNDINGS`.
"""
SURROUNDINGS = 160.0
"""Width of the land around a part that is fitted with it, metres; a larger value costs time."""


def joined_terrain(
    outline: Outline,
    land: Heights,
    parts: Iterable[tuple[Bounds, Lattice | None]],
    bounds: Bounds,
) -> TerrainField:
    """Joins the corrections of parts, each weighted by how far a place lies in it.

    A height follows from the place and from the parts around it, and not from the rectangle. So
    chunks of different parts share the samples of their border.

    Args:
        outline: Outline of the road in the rectangle and around it.
        land: The land of the map without its roads.
        parts: Rectangle of each part, metres, and its correction; all that reach the rectangle.
        bounds: The rectangle that heights are asked in, metres.
    """
    first, last = (np.round(np.array(side) / CELL_SIZE).astype(np.int64) for side in _sides(bounds))
    columns, rows = (last - first + 3).tolist()
    extent = Extent(first - 1, CELL_SIZE, (rows, columns))
    x, y = extent.axes()
    total, weights = np.zeros(extent.shape), np.zeros(extent.shape)
    is_corrected = False
    for rectangle, lattice in parts:
        weight = np.outer(*(_weight(*side) for side in zip((y, x), _ends(rectangle), strict=True)))
        weights += weight
        if lattice is not None and weight.any():
            is_corrected = True
            # Row by row, since a lattice needs many arrays of the size of the places.
            for row in np.flatnonzero(weight.any(axis=1)).tolist():
                column = np.flatnonzero(weight[row])
                places = np.stack([x[column], np.full(len(column), y[row])], axis=1)
                total[row, column] += weight[row, column] * lattice(places)
    if not is_corrected:
        return TerrainField(outline, land, None)
    return TerrainField(outline, land, Lattice(extent, total / np.maximum(weights, 1e-12)))


def _sides(bounds: Bounds) -> tuple[tuple[float, float], tuple[float, float]]:
    return bounds[:2], bounds[2:]


def _ends(bounds: Bounds) -> tuple[tuple[float, float], tuple[float, float]]:
    """First and last y, first and last x."""
    return (bounds[1], bounds[3]), (bounds[0], bounds[2])


def _weight(places: FloatArray, ends: tuple[float, float]) -> FloatArray:
    """1 between two ends, and falling smoothly to 0 at the distance `FADING` beyond them."""
    beyond = np.maximum(ends[0] - places, places - ends[1])
    share = np.clip(1.0 - np.maximum(beyond, 0.0) / FADING, 0.0, 1.0)
    weight: FloatArray = share * share * (3.0 - 2.0 * share)
    return weight

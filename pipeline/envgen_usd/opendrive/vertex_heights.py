"""One base height for each vertex of the arrangement, and the lanes' own heights above it."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.junctions import Junction
from envgen_usd.opendrive.cells import Cells, Hits
from envgen_usd.opendrive.junction_heights import grid_heights
from envgen_usd.opendrive.junction_smoothing import smooth_junctions
from envgen_usd.opendrive.strips import Strip

_RESTING = frozenset(("transition", "island"))
"""Kinds that rest on what else is there."""
_OUTSIDE_WEIGHT = 1e9
_LEAST_WEIGHT = 1e-3
_CLOSING_WEIGHT = 1e-6
"""Weights of roads outside junctions, of a connecting road at its border, and of transitions."""


class VertexHeights:
    """Heights at the vertices of an arrangement.

    The base height is shared by everything that meets at a vertex, so lanes of different roads
    join without steps: that of the roads outside junctions, else the mean of the connecting roads
    weighted by how far inside each the vertex lies, which fades every road out at its border.
    Where connecting roads disagree, a smooth surface between them counts; a junction's elevation
    grid replaces them.
    """

    def __init__(
        self, points: FloatArray, strips: Sequence[Strip], junctions: Sequence[Junction]
    ) -> None:
        """Evaluates lane strips at points (P x 2); junctions may have grids of their own."""
        cells = Cells(strips)
        hits = cells.at(points)
        self.base = _base(len(points), hits, strips)
        smooth_junctions(self.base, points, hits, strips, cells)
        for junction in junctions:
            _use_grid(self.base, points, hits, (strips, junction))
        key = hits.place * len(strips) + hits.strip
        self._count = len(strips)
        self._keys, inverse = np.unique(key, return_inverse=True)
        total = np.bincount(inverse, hits.height)
        self._height: FloatArray = total / np.bincount(inverse)
        self._usual = np.array([strip.height.mean() for strip in strips])

    def of_lane(self, vertex: IntArray, strip: IntArray) -> FloatArray:
        """Lane height of a strip at a vertex of its border or inside it, each N."""
        key = vertex * self._count + strip
        found = np.minimum(np.searchsorted(self._keys, key), len(self._keys) - 1)
        hit = self._keys[found] == key
        height: FloatArray = np.where(hit, self._height[found], self._usual[strip])
        return height


def _base(count: int, hits: Hits, strips: Sequence[Strip]) -> FloatArray:
    outside = np.array([not strip.patch.junction for strip in strips])[hits.strip]
    weight = np.maximum(hits.depth, 0.0) + _LEAST_WEIGHT
    weight = np.where(outside, _OUTSIDE_WEIGHT * weight, weight)
    closing = np.array([strip.patch.kind in _RESTING for strip in strips])[hits.strip]
    weight = np.where(closing, _CLOSING_WEIGHT, weight)
    total = np.bincount(hits.place, weight * hits.base, minlength=count)
    base: FloatArray = total / np.bincount(hits.place, weight, minlength=count)
    return base


def _use_grid(
    base: FloatArray, points: FloatArray, hits: Hits, both: tuple[Sequence[Strip], Junction]
) -> None:
    """Writes the heights of a junction's grid over those of its own vertices, in place."""
    strips, junction = both
    own = np.array([strip.patch.junction == junction.id for strip in strips])[hits.strip]
    place = np.setdiff1d(hits.place[own], hits.place[~own])
    height = grid_heights(junction, points[place])
    known = np.isfinite(height)
    base[place[known]] = height[known]

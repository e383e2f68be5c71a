"""Base height of each vertex of the arrangement, and lane heights above it."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.junctions import Junction
from envgen_usd.opendrive.geometry.elevation_grid import grid_heights
from envgen_usd.opendrive.mesh.junction_smoothing import smooth_junctions
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.strip_index import Cells, Hits

_RESTING = frozenset(("transition", "island"))
"""Kinds of patches that take the height of other surfaces."""
_OUTSIDE_WEIGHT = 1e9
"""Factor on the weight of roads outside junctions; large, so that they determine the height."""
_LEAST_WEIGHT = 1e-3
"""Weight in metres of a connecting road at its border."""
_CLOSING_WEIGHT = 1e-6
"""Weight of transitions and islands; small, so that any other surface determines the height."""


class VertexHeights:
    """Heights at the vertices of an arrangement.

    All surfaces at a vertex share the base height, so lanes of different roads join without steps.
    Roads outside junctions determine it. Inside, it is the mean of the connecting roads, weighted
    by the vertex's depth in each road. Each road therefore fades out at its border. A smooth
    surface replaces disagreeing heights; a junction's elevation grid replaces all of them.
    """

    def __init__(
        self,
        points: FloatArray,
        strips: Sequence[Strip],
        cells: Cells,
        junctions: Sequence[Junction],
    ) -> None:
        """Evaluates lane strips at points (P x 2, metres); junctions may have elevation grids."""
        hits = cells.at(points)
        self.base = _base(len(points), hits, strips)
        self.smoothed = smooth_junctions(self.base, points, hits, strips, cells)
        for junction in junctions:
            _use_grid(self.base, points, hits, (strips, junction))
        key = hits.place * len(strips) + hits.strip
        self._count = len(strips)
        self._keys, inverse = np.unique(key, return_inverse=True)
        total = np.bincount(inverse, hits.height)
        self._height: FloatArray = total / np.bincount(inverse)
        self._usual = np.array([strip.height.mean() for strip in strips])

    def of_lane(self, vertex: IntArray, strip: IntArray) -> FloatArray:
        """Returns the lane height of strips at vertices on or inside their border, N, metres."""
        key = vertex * self._count + strip
        index = np.minimum(np.searchsorted(self._keys, key), len(self._keys) - 1)
        hit = self._keys[index] == key
        height: FloatArray = np.where(hit, self._height[index], self._usual[strip])
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
    """Writes the heights of a junction's grid over those of the junction's vertices, in place."""
    strips, junction = both
    inside = np.array([strip.patch.junction == junction.id for strip in strips])[hits.strip]
    place = np.setdiff1d(hits.place[inside], hits.place[~inside])
    height = grid_heights(junction, points[place])
    known = np.isfinite(height)
    base[place[known]] = height[known]

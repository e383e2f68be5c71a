"""Converts polygons in 2D to shapely geometries."""

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.geometry.flat_arrays import spans
from envgen_usd.geometry.polygon_planes import polygon_of_ring
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons


def flat_shapes(polygons: Polygons, flat: FloatArray, chosen: IntArray) -> NDArray[np.object_]:
    """Converts selected polygons to shapely polygons, C, valid or not.

    Holes with fewer than three points are left out.

    Args:
        polygons: P polygons.
        flat: N x 2, points of the polygons in 2D, metres.
        chosen: C ascending indices of polygons with an exterior of at least three points.
    """
    sizes = np.diff(polygons.ring_offsets)
    place = np.full(len(polygons), -1)
    place[chosen] = np.arange(len(chosen))
    target = place[polygon_of_ring(polygons)]
    rings = np.flatnonzero((target >= 0) & (sizes >= 3))
    points = spans(polygons.ring_offsets[rings], sizes[rings])
    shapes = shapely.linearrings(
        flat[points], indices=np.repeat(np.arange(len(rings)), sizes[rings])
    )
    selected: NDArray[np.object_] = shapely.polygons(shapes, indices=target[rings])
    return selected

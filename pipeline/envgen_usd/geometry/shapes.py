"""Polygons in 2D as shapely geometries."""

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.geometry.collections import spans
from envgen_usd.geometry.planes import polygon_of_ring
from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.polygons import Polygons


def flat_shapes(polygons: Polygons, flat: FloatArray, chosen: IntArray) -> NDArray[np.object_]:
    """Returns some of the polygons as shapely polygons, C, whether they are valid or not.

    Holes of less than three points are left out.

    Args:
        polygons: P polygons.
        flat: N x 2, their points in 2D.
        chosen: C indices, ascending, of polygons whose exterior has at least three points.
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
    found: NDArray[np.object_] = shapely.polygons(shapes, indices=target[rings])
    return found

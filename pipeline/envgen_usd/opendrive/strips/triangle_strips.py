"""Strips that are triangles: areas of paint, parking bays, islands and junctions."""

from collections.abc import Iterator

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.strips.lane_strips import Strip


def triangle_strips(
    corners: FloatArray, patch: Patch, heights: FloatArray | None = None
) -> Iterator[Strip]:
    """Yields a strip for each triangle, as two rows that share their first corner.

    Args:
        corners: T x 3 x 3, metres.
        patch: Semantics of all triangles.
        heights: T x 3, metres above the road; `None` for 0.
    """
    above = np.zeros(corners.shape[:2]) if heights is None else heights
    x, y = np.moveaxis(corners[:, 1:, :2] - corners[:, :1, :2], 2, 0)
    clockwise = x[:, 0] * y[:, 1] - y[:, 0] * x[:, 1] < 0
    corners = np.where(clockwise[:, None, None], corners[:, ::-1], corners)
    above = np.where(clockwise[:, None], above[:, ::-1], above)
    left, right = corners[:, [0, 2]], corners[:, [0, 1]]
    rows = np.stack([above[:, [0, 2]], above[:, [0, 1]]], axis=2)
    depth = np.zeros((2, 2))
    for place in range(len(corners)):
        yield Strip(left[place], right[place], rows[place], depth, patch)


def ring_strips(
    ring: FloatArray, least: float, patch: Patch, heights: FloatArray | None = None
) -> Iterator[Strip]:
    """Yields the triangles of the area within a ring, at the heights of its corners.

    Args:
        ring: N x 3, metres.
        least: Area in square metres below which nothing is yielded, as for a ring that crosses
            itself.
        patch: Semantics of the area.
        heights: N, metres above the road at the corners; `None` for 0.
    """
    # A triangulation keeps the z of corners, which tells their places in the ring.
    area = shapely.Polygon(np.column_stack([ring[:, :2], np.arange(len(ring))]))
    if not area.is_valid or area.area < least:
        return
    triangles = shapely.constrained_delaunay_triangles(area)
    places = shapely.get_coordinates(triangles, include_z=True)[:, 2].astype(np.int64)
    corner = places.reshape(-1, 4)[:, :3]
    yield from triangle_strips(ring[corner], patch, None if heights is None else heights[corner])

"""Closed bodies along a line on the ground: hedges, walls, rails, and posts."""

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.polygon_arrays import Polygons


def strip_body(
    line: FloatArray,
    width: float,
    low: FloatArray,
    high: FloatArray,
    across: FloatArray | None = None,
) -> list[FloatArray]:
    """Returns the faces of a vertical body along a polyline.

    Args:
        line: N x 2, N >= 2, metres.
        width: Width, metres.
        low: N, height of the underside at each point, metres.
        high: N, height of the top at each point, metres.
        across: N x 2, from the line at each point to 1 m left of it; `None` for `mitres`.

    Returns:
        Outward-facing quads, 4 x 3 each, that form a closed 2-manifold.
    """
    side = (mitres(line) if across is None else across) * (width / 2)
    corners = [
        np.column_stack([plan, z])
        for plan, z in (
            (line - side, low),
            (line + side, low),
            (line + side, high),
            (line - side, high),
        )
    ]
    # Right bottom, left bottom, left top, right top, seen along the line.
    ring = np.stack([snap(corner) for corner in corners], axis=1)
    faces = [
        np.stack([ring[i, a], ring[i + 1, a], ring[i + 1, b], ring[i, b]])
        for i in range(len(line) - 1)
        for a, b in ((0, 3), (3, 2), (2, 1), (1, 0))
    ]
    return [*faces, ring[0, [0, 3, 2, 1]], ring[-1, [0, 1, 2, 3]]]


def post_body(place: FloatArray, width: float, low: float, high: float) -> list[FloatArray]:
    """Returns the faces of a square post at a point (2)."""
    half = np.array([width / 2, 0.0])
    ends = np.array([place - half, place + half])
    return strip_body(ends, width, np.array([low, low]), np.array([high, high]))


def as_polygons(faces: list[FloatArray]) -> Polygons:
    """Returns the faces of several bodies as polygons."""
    return Polygons.of_rings(faces)


def mitres(line: FloatArray) -> FloatArray:
    """Returns mitre vectors to the left at each point, N x 2, that keep the width even."""
    step = np.diff(line, axis=0)
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    left = np.column_stack([-step[:, 1], step[:, 0]])
    both = np.vstack([left[:1], left]) + np.vstack([left, left[-1:]])
    # At a corner sharper than 60 degrees the mitre would extend too far.
    vectors: FloatArray = 2.0 * both / np.maximum((both**2).sum(axis=1), 1.0)[:, None]
    return vectors

"""Solids above traffic areas: the room that traffic takes."""

from itertools import chain

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.geometry.iso19107.check import Bodies, find_faults
from envgen_usd.geometry.triangulate import triangulate
from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.polygons import Polygons

VEHICLES = 4.5
"""Height of the space of a lane for vehicles, metres (as r:trân has it)."""
FEET_AND_CYCLES = 2.5
"""Height of the space of a lane for pedestrians and bicycles, metres."""
_NARROW = 0.05
"""Metres; a narrower strip has no room above it."""
_LEAST_HEIGHT = 0.02
"""Metres; less high triangles of a strip may cross others on the grid of coordinates."""
_LOW = frozenset(("sidewalk", "walking", "biking"))


def clearance(lane_type: str) -> float:
    """Returns the height of the space above a lane, metres."""
    return FEET_AND_CYCLES if lane_type in _LOW else VEHICLES


def lane_solid(line: FloatArray, width: FloatArray, height: float) -> Polygons | None:
    """Returns the closed shell of the room above a strip along a line.

    Args:
        line: N x 3, middle of the strip's ground, metres.
        width: N, metres; zero at an end where the strip ends in a point.
        height: Metres.

    Returns:
        The shell; none where the strip is too narrow or too short, or crosses itself.
    """
    along = np.gradient(line[:, :2], axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    half = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(line))]) * width[:, None] / 2
    left, right = snap(line + half), snap(line - half)
    length = np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1).sum()
    if (width[1:-1] < _NARROW).any() or width.max() < _NARROW or length < _NARROW:
        return None
    outline = np.concatenate([right, left[::-1]])[:, :2]
    keep = np.append(True, (np.diff(outline, axis=0) != 0.0).any(axis=1))
    keep[-1] &= bool((outline[0] != outline[-1]).any())
    if not shapely.Polygon(outline[keep]).is_valid:
        return None
    whole = _strip(right, left)
    if whole is not None:
        return raise_solid(whole, height)
    shape = Polygons.of_rings([np.concatenate([right, left[::-1]])[keep]])
    solid = raise_solid(Polygons.of_triangles(shape.points, triangulate(shape)[0]), height)
    return None if find_faults(Bodies.of_solid(solid)) else solid


def _strip(right: FloatArray, left: FloatArray) -> Polygons | None:
    """Triangles between two borders (N x 3).

    None where one looks down or is but a sliver, as in tight bends.
    """
    count = len(right)
    i = np.arange(count - 1)
    triangles = np.concatenate(
        [
            np.stack([i, i + 1, count + i + 1], axis=1),
            np.stack([i, count + i + 1, count + i], axis=1),
        ]
    )
    vertices = np.concatenate([right, left])
    corners = vertices[triangles]
    # Where the strip ends in a point, a triangle has lost a side.
    sides = corners - np.roll(corners, 1, axis=1)
    whole = (np.abs(sides).max(axis=2) > 0.0).all(axis=1)
    one, two = corners[whole, 1] - corners[whole, 0], corners[whole, 2] - corners[whole, 0]
    areas = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    longest = np.linalg.norm(np.stack([one, two, two - one]), axis=2).max(axis=0)
    if (areas < _LEAST_HEIGHT * longest).any():
        return None
    return Polygons.of_triangles(vertices, triangles[whole])


def raise_solid(areas: Polygons, height: float) -> Polygons:
    """Returns the closed shell between polygons and the same polygons further up.

    Args:
        areas: Polygons that look up; those that hang together share their vertices.
        height: Metres.
    """
    lift = np.array([0.0, 0.0, height])
    ends = _ends(areas.ring_offsets)
    one, two = areas.points, areas.points[ends]
    keys = np.unique(np.concatenate([one, two]), axis=0, return_inverse=True)[1].reshape(2, -1)
    outer = _without_twin(keys[0], keys[1])
    a, b = one[outer], two[outer]
    sides = np.stack([a, b, b + lift, a + lift], axis=1).reshape(-1, 3)
    points = np.concatenate([_reversed(areas), areas.points + lift, sides])
    rings = np.diff(areas.ring_offsets)
    holes = np.diff(areas.polygon_offsets)
    count = len(a)
    return Polygons(
        points,
        _offsets(chain(rings, rings, [4] * count)),
        _offsets(chain(holes, holes, [1] * count)),
    )


def _ends(ring_offsets: IntArray) -> IntArray:
    """Index of the point after each in its ring."""
    following: IntArray = np.arange(1, ring_offsets[-1] + 1)
    following[ring_offsets[1:] - 1] = ring_offsets[:-1]
    return following


def _without_twin(one: IntArray, two: IntArray) -> IntArray:
    """Indices of the directed edges that no other runs against."""
    edges = set(zip(one.tolist(), two.tolist(), strict=True))
    found = [i for i, (a, b) in enumerate(zip(one, two, strict=True)) if (b, a) not in edges]
    return np.array(found, dtype=np.int64)


def _reversed(areas: Polygons) -> FloatArray:
    """Points of all rings, each from its end to its start."""
    starts, ends = areas.ring_offsets[:-1], areas.ring_offsets[1:]
    order = np.repeat(starts + ends - 1, ends - starts) - np.arange(len(areas.points))
    turned: FloatArray = areas.points[order]
    return turned


def _offsets(sizes: "chain[int]") -> IntArray:
    return np.cumsum([0, *sizes], dtype=np.int64)

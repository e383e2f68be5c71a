"""Solids of the free space above traffic areas."""

from itertools import chain

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.geometry.unique_rows import unique_rows
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons

VEHICLES = 4.5
"""Height of the free space above lanes for vehicles, metres (as in r:trân)."""
FEET_AND_CYCLES = 2.5
"""Height of the free space above lanes for pedestrians and bicycles, metres."""
_NARROW = 0.05
"""Least width of a strip with a solid, metres; a larger value drops more solids."""
_LEAST_HEIGHT = 0.02
"""Height below which triangles of a strip may cross after snapping to the coordinate grid, metres.

"""
_LOW = frozenset(("sidewalk", "walking", "biking"))


def clearance(lane_type: str) -> float:
    """Returns the height of the free space above a lane, metres."""
    return FEET_AND_CYCLES if lane_type in _LOW else VEHICLES


def lane_solid(line: FloatArray, width: FloatArray, height: float) -> Polygons | None:
    """Returns the closed shell of the free space above a strip along a line.

    Args:
        line: N x 3, centre line of the strip on the ground, metres.
        width: N, metres; zero at a pointed end.
        height: Height of the space, metres.

    Returns:
        The shell; `None` if the strip is too narrow, too short, or crosses itself.
    """
    left, right = strip_borders(line, width)
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


def strip_borders(line: FloatArray, width: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns the left and right border of a strip along a line, N x 3 each.

    Args:
        line: N x 3, centre line, metres.
        width: N, metres.
    """
    along = np.gradient(line[:, :2], axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    half = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(line))]) * width[:, None] / 2
    return snap(line + half), snap(line - half)


def _strip(right: FloatArray, left: FloatArray) -> Polygons | None:
    """Triangles between two borders (N x 3).

    `None` if a triangle faces down or is a sliver, as in tight bends.
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
    # At a pointed end, a triangle has lost a side.
    sides = corners - np.roll(corners, 1, axis=1)
    whole = (np.abs(sides).max(axis=2) > 0.0).all(axis=1)
    first, second = corners[whole, 1] - corners[whole, 0], corners[whole, 2] - corners[whole, 0]
    areas = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    longest = np.linalg.norm(np.stack([first, second, second - first]), axis=2).max(axis=0)
    if (areas < _LEAST_HEIGHT * longest).any():
        return None
    return Polygons.of_triangles(vertices, triangles[whole])


def raise_solid(areas: Polygons, height: float) -> Polygons:
    """Returns the closed shell between polygons and their copies at a larger height.

    Args:
        areas: Upward-facing polygons; connected polygons share their vertices.
        height: Height of the space, metres.
    """
    lift = np.array([0.0, 0.0, height])
    ends = _ends(areas.ring_offsets)
    starts, stops = areas.points, areas.points[ends]
    keys = unique_rows(np.concatenate([starts, stops]))[1].reshape(2, -1)
    outer = _without_twin(keys[0], keys[1])
    a, b = starts[outer], stops[outer]
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
    """Index of the next point of each point in its ring."""
    following: IntArray = np.arange(1, ring_offsets[-1] + 1)
    following[ring_offsets[1:] - 1] = ring_offsets[:-1]
    return following


def _without_twin(starts: IntArray, stops: IntArray) -> IntArray:
    """Indices of the directed edges without an opposite edge."""
    edges = set(zip(starts.tolist(), stops.tolist(), strict=True))
    single = [i for i, (a, b) in enumerate(zip(starts, stops, strict=True)) if (b, a) not in edges]
    return np.array(single, dtype=np.int64)


def _reversed(areas: Polygons) -> FloatArray:
    """Points of all rings, each reversed."""
    starts, ends = areas.ring_offsets[:-1], areas.ring_offsets[1:]
    order = np.repeat(starts + ends - 1, ends - starts) - np.arange(len(areas.points))
    turned: FloatArray = areas.points[order]
    return turned


def _offsets(sizes: "chain[int]") -> IntArray:
    return np.cumsum([0, *sizes], dtype=np.int64)

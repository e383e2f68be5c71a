"""Places of the nodes of a Lanelet2 map in metres, and the reference system of these metres.

1. `local_x` and `local_y` count where nodes have them.
2. Otherwise, UTM in the zone of the middle of the map; the origin is moved near the map.
3. Heights are `ele`, repaired by `node_heights`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pyproj import Transformer

from envgen_usd.models.array_types import FloatArray
from envgen_usd.places.lanelets.node_heights import repaired_heights

_FARTHEST = 1e7
"""Largest coordinate, metres: a quarter of the way around the Earth."""
_HIGHEST = 12_000.0
"""Largest height, metres."""
_POLE = 84.0
"""Largest latitude of UTM, degrees."""
_SHARE = 0.5
"""Share of nodes that need local coordinates for these to count."""
_SAME = 0.5, 0.9
"""Largest spread of UTM from local coordinates that belong to it, metres, and share of nodes."""
_ROUND = 1000.0
"""The origin of a map lies on a multiple of this, metres."""
_PLACE = 0.005
"""Nodes nearer than about this are at one place, metres."""


@dataclass(frozen=True, eq=False)
class NodePlaces:
    """Places of the usable nodes.

    Attributes:
        index: Id of a node to its row.
        points: N x 3, metres.
        place: N, number of the place; nodes at one place have one number.
        crs: Reference system, empty where it is unknown.
        offset: x and y of the origin in it, metres.
        unusable: Number of nodes without a usable place.
        heights: True where nodes have different heights.
        without_height: Number of nodes of bounds without a height among others that have one.
        wrong_heights: Number of nodes of bounds whose height cannot be.
    """

    index: Mapping[int, int]
    points: FloatArray
    place: tuple[int, ...]
    crs: str
    offset: tuple[float, float]
    unusable: int
    heights: bool
    without_height: int
    wrong_heights: int


def node_places(
    nodes: Mapping[int, tuple[float, float, float, float, float]],
    bounds: Sequence[Sequence[int]] = (),
) -> NodePlaces:
    """Places of nodes.

    Args:
        nodes: Id to latitude, longitude, x, y and height; NaN where there is no number.
        bounds: Ids of the nodes of each way that bounds a lanelet.
    """
    ids = np.array(list(nodes), np.int64)
    values = np.array(list(nodes.values()), float).reshape(-1, 5)
    degrees, local, height = values[:, :2], values[:, 2:4], values[:, 4]
    on_earth = (np.abs(degrees[:, 0]) <= _POLE) & (np.abs(degrees[:, 1]) <= 180.0)
    has_local = (np.abs(local) <= _FARTHEST).all(1)
    is_local = bool(len(ids)) and bool(has_local.mean() >= _SHARE)
    kept = has_local if is_local else on_earth
    crs = _zone(degrees[on_earth & kept])
    utm = _projected(degrees, on_earth & kept, crs)
    offset = (0.0, 0.0)
    if is_local:
        move = (utm - local)[on_earth & kept]
        middle = np.median(move, axis=0) if len(move) else np.zeros(2)
        same = np.abs(move - middle).max(1) <= _SAME[0]
        known = len(move) > 0 and bool(same.mean() >= _SAME[1])
        crs = crs if known else ""
        if known:
            offset = (float(middle[0]), float(middle[1]))
        flat = local[kept]
    else:
        middle = np.round(np.median(utm[kept], axis=0) / _ROUND) * _ROUND if kept.any() else (0, 0)
        offset = (float(middle[0]), float(middle[1]))
        flat = utm[kept] - np.array(offset)
    index = {int(number): row for row, number in enumerate(ids[kept].tolist())}
    lines = [np.array([index[n] for n in bound if n in index], np.int64) for bound in bounds]
    height = np.where(np.abs(height[kept]) <= _HIGHEST, height[kept], np.nan)
    height, without, wrong = repaired_heights(np.column_stack([flat, height]), lines)
    known_heights = bool(len(height) and np.ptp(height) > 0.0)
    points = np.column_stack([flat, height])
    _, place = np.unique(np.round(points / _PLACE).astype(np.int64), axis=0, return_inverse=True)
    numbers = tuple(place.ravel().tolist())
    unusable = int(len(ids) - kept.sum())
    return NodePlaces(index, points, numbers, crs, offset, unusable, known_heights, without, wrong)


def _zone(degrees: FloatArray) -> str:
    """The UTM zone of the middle of a map as a PROJ string."""
    if not len(degrees):
        return ""
    lat, lon = np.median(degrees, axis=0)
    zone = int(np.clip((lon + 180.0) // 6.0 + 1.0, 1, 60))
    south = " +south" if lat < 0.0 else ""
    return f"+proj=utm +zone={zone}{south} +ellps=WGS84 +datum=WGS84 +units=m +no_defs"


def _projected(degrees: FloatArray, rows: FloatArray, crs: str) -> FloatArray:
    """UTM of rows, N x 2; NaN elsewhere."""
    found = np.full((len(degrees), 2), np.nan)
    if crs:
        project = Transformer.from_crs(4326, crs, always_xy=True)
        found[rows] = np.column_stack(project.transform(*degrees[rows][:, ::-1].T))
    found[~np.isfinite(found)] = np.nan
    return found

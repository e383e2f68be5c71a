"""What a building of a map stands beside: other buildings, streets, shops, the ground."""

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.spatial import cKDTree

from envgen_usd.city.buildings.footprint_walls import Surroundings
from envgen_usd.city.ground_heights import Ground
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.place import Houses, Shapes

_TOUCH = 0.3
"""Distance of a wall from another building below which it has no openings, metres."""
_FRONT = 16.0
"""Distance of a street up to which walls look at it, metres; a larger value gives more doors."""
_ROOMS = (3.0, 1.5, 0.8)
"""Depths before a wall that are tried, metres."""
_HIDDEN = 0.6
"""Share of a body's height from which another one beside it hides its walls."""
_STEP = 4.0
"""Distance of points on the road's edges, metres."""


class Neighbourhood:
    """The buildings of a map with the road between them."""

    def __init__(
        self,
        shapes: Sequence[shapely.Polygon],
        road: FloatArray,
        ground: Ground,
        shops: FloatArray | None,
        bodies: Houses | None = None,
    ) -> None:
        """Sorts them by place.

        Args:
            shapes: Footprints.
            road: Triangles of the road in plan, T x 3 x 2.
            ground: Heights of the ground.
            shops: S x 2, shops of the map, or `None`.
            bodies: Heights and groups of the footprints; `None`: each is a whole building.
        """
        self._shapes = np.array(shapes, object)
        self._tree = shapely.STRtree(self._shapes)
        triangles = shapely.polygons(road) if len(road) else np.empty(0, object)
        self._road = shapely.STRtree(triangles)
        edges = shapely.get_coordinates(shapely.segmentize(triangles, _STEP))
        self._edges = edges
        self._edge_tree = cKDTree(edges) if len(edges) else None
        self._ground, self._shops = ground, shops
        self._groups = np.full(len(shapes), -1) if bodies is None else bodies.groups
        self._ranges = None if bodies is None else bodies.vertical_range()
        self._owner = self._owners(shops)

    def _owners(self, shops: FloatArray | None) -> IntArray:
        """Number of the building of each shop; -1 without one."""
        owner = np.full(0 if shops is None else len(shops), -1)
        if shops is not None and len(shops) and len(self._shapes):
            points, shapes = self._tree.query_nearest(
                shapely.points(shops), max_distance=3.0, all_matches=False
            )
            owner[points] = shapes
        return owner

    def street(self, shape: shapely.Polygon) -> FloatArray:
        """The point of the road nearest to the middle of a footprint, or the middle itself."""
        middle = np.array(shape.centroid.coords[0])
        if self._edge_tree is None:
            return middle
        nearest: FloatArray = self._edges[int(self._edge_tree.query(middle)[1])]
        return nearest

    def around(self, number: int) -> Surroundings:
        """What one of the footprints stands beside."""
        shape = self._shapes[number]
        near = self._tree.query(shape, predicate="dwithin", distance=_FRONT)
        near = near[near != number]
        hiding = ~self._above_or_below(number, near)
        beside = _Beside(self._shapes[near[hiding]], self._road)
        # A lower body leaves windows above it, but no door and no balcony before it.
        low = _Beside(self._shapes[near[~hiding]], self._road)
        return Surroundings(
            self.street(shape),
            beside.touches,
            beside.looks_at_street,
            lambda a, b: 0.0 if low.touches(a, b) else beside.room(a, b),
            self._ground.heights,
            None if self._shops is None else self._shops[self._owner == number],
            lambda outline: not len(self._road.query(outline, predicate="intersects")),
            lambda a, b: not low.touches(a, b),
        )

    def _above_or_below(self, number: int, others: IntArray) -> BoolArray:
        """True for bodies of the same building that hide little of a body's walls."""
        group = self._groups[number]
        if self._ranges is None or group < 0:
            return np.zeros(len(others), bool)
        low, high = self._ranges[number]
        shared = np.minimum(self._ranges[others, 1], high) - np.maximum(
            self._ranges[others, 0], low
        )
        hides = shared >= _HIDDEN * (high - low) if np.isfinite(high) else shared > 0.0
        away: BoolArray = (self._groups[others] == group) & ~hides
        return away


class _Beside:
    """Tests of the walls of a building."""

    def __init__(self, others: Shapes, road: shapely.STRtree) -> None:
        self._others, self._road = others, road

    def touches(self, a: FloatArray, b: FloatArray) -> bool:
        """True if most of a wall lies beside another building."""
        if not len(self._others):
            return False
        step, out = _frame(a, b)
        places = a + np.linspace(0.1, 0.9, 5)[:, None] * step + 0.5 * _TOUCH * out
        distances = shapely.distance(shapely.points(places)[:, None], self._others[None])
        return bool((distances.min(axis=1) < _TOUCH).mean() > 0.35)

    def looks_at_street(self, a: FloatArray, b: FloatArray) -> bool:
        """True if the road lies before a wall, and no building between them."""
        step, out = _frame(a, b)
        middle = a + step / 2.0
        line = shapely.linestrings([middle + 0.1 * out, middle + _FRONT * out])
        hit = self._road.query(line, predicate="intersects")
        if not len(hit):
            return False
        start = shapely.points(middle)
        to_road = shapely.distance(start, self._road.geometries[hit]).min()
        crossed = shapely.intersection(self._others, line)
        crossed = crossed[~shapely.is_empty(crossed)]
        return not len(crossed) or bool(shapely.distance(start, crossed).min() > to_road)

    def room(self, a: FloatArray, b: FloatArray) -> float:
        """Free depth before a wall, metres."""
        step, out = _frame(a, b)
        for depth in _ROOMS:
            corners = [a + 0.1 * step + 0.1 * out, b - 0.1 * step + 0.1 * out]
            strip = shapely.polygons(
                [*corners, b - 0.1 * step + depth * out, a + 0.1 * step + depth * out]
            )
            taken = bool(shapely.intersects(self._others, strip).any())
            if not taken and not len(self._road.query(strip, predicate="intersects")):
                return depth
        return 0.0


def _frame(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The way along a wall, and the unit vector out of it."""
    step = b - a
    out = np.array([step[1], -step[0]]) / max(float(np.hypot(*step)), 1e-9)
    return step, out

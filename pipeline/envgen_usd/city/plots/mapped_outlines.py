"""Footprints of a map as rectangles and Ls whose front looks at the street."""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.city.buildings.building_design import Wing
from envgen_usd.models.array_types import FloatArray

_UNEVEN = 0.3
"""Largest distance of a footprint from the L that is built instead, metres."""
_RETURN = 0.25
"""Setback of a wing's side from that of the main part, metres; without it, roofs have slivers."""
_MOST_RETURN = 0.4
"""Largest setback, metres; a larger value moves walls farther from their footprint."""
_LEAST_WING = 2.0
"""Least width and depth of a wing, metres."""
_LOWER = 0.97
"""Largest width of a wing as a share of the main part's depth, so that its ridge is lower."""


@dataclass(frozen=True, eq=False)
class Outline:
    """A rectangle whose front looks at the street.

    Attributes:
        origin: 2, left end of the front as seen from the street, metres.
        along: 2, unit vector along the front, to the right.
        size: Width along the front and depth, metres.
    """

    origin: FloatArray
    along: FloatArray
    size: tuple[float, float]

    def side(self, number: int) -> tuple[FloatArray, FloatArray]:
        """Ends of the front (0), right, back or left side, with the rectangle to the left."""
        width, depth = self.size
        into = np.array([-self.along[1], self.along[0]])
        right = self.origin + width * self.along
        corners = [self.origin, right, right + depth * into, self.origin + depth * into]
        return corners[number], corners[(number + 1) % 4]

    def polygon(self) -> shapely.Polygon:
        """The rectangle."""
        return shapely.Polygon([self.side(number)[0] for number in range(4)])

    def local(self, points: FloatArray) -> FloatArray:
        """Points, N x 2, in the frame of the front: along it, and away from the street."""
        into = np.array([-self.along[1], self.along[0]])
        turned: FloatArray = (points - self.origin) @ np.stack([self.along, into], axis=1)
        return turned


@dataclass(frozen=True, eq=False)
class LShape:
    """An L: a main part along the front of its outline, and a wing before or behind it."""

    outline: Outline
    wing: Wing


def outline_of(box: shapely.Polygon, street: FloatArray, front: int | None = None) -> Outline:
    """The outline of a rectangle.

    Args:
        box: The rectangle.
        street: A point in plan, which the front looks at.
        front: Number of the side that is the front instead.
    """
    corners = shapely.get_coordinates(shapely.orient_polygons(box))[:4]
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(sides, axis=1)
    if front is None:
        out = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / lengths[:, None]
        way = street - (corners + sides / 2.0)
        facing = (out * way).sum(1) / np.maximum(np.linalg.norm(way, axis=1), 1e-9)
        front = int(np.argmax(facing))
    width, depth = float(lengths[front]), float(lengths[(front + 1) % 4])
    return Outline(corners[front], sides[front] / width, (round(width, 3), round(depth, 3)))


def l_shape(shape: shapely.Polygon, street: FloatArray) -> LShape | None:
    """The L of a footprint whose front looks at the street, or `None` for any other footprint."""
    box = shapely.minimum_rotated_rectangle(shape)
    if shape.interiors or box.geom_type != "Polygon" or len(shape.exterior.coords) != 7:
        return None
    best = outline_of(box, street)
    corners = shapely.get_coordinates(shapely.orient_polygons(box))[:4]
    order = np.argsort(np.linalg.norm(corners - best.origin, axis=1))
    # The front first, then the sides beside it, the back last.
    first = int(order[0])
    for turn in (0, 1, 3, 2):
        outline = outline_of(box, street, (first + turn) % 4)
        wing = _wing(outline.local(shapely.get_coordinates(shape)[:-1]), outline.size)
        if wing is not None:
            return LShape(outline, wing)
    return None


def _wing(points: FloatArray, size: tuple[float, float]) -> Wing | None:
    """The wing of an L with corners in the frame of its outline, 6 x 2."""
    width, depth = size
    inner = points[(np.minimum(points, np.array(size) - points) > _UNEVEN).all(axis=1)]
    if len(inner) != 1:
        return None
    x, y = inner[0].tolist()
    # The corner of the outline that the L lacks.
    ends = np.array([(0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)])
    away = np.linalg.norm(ends[:, None] - points[None], axis=2).min(axis=1)
    if (away > _UNEVEN).sum() != 1:
        return None
    lack_x, lack_y = ends[int(np.argmax(away))].tolist()
    wanted = np.array([(x, y), (x, lack_y), (lack_x, y), *ends[away <= _UNEVEN]])
    apart = np.linalg.norm(wanted[:, None] - points[None], axis=2).min(axis=1)
    front = lack_y == 0.0
    main = depth - y if front else y
    whole, out = width - x if lack_x == 0.0 else x, depth - main
    setback = max(_RETURN, whole - _LOWER * main)
    span = whole - setback
    if apart.max() > _UNEVEN or min(span, out) < _LEAST_WING or setback > _MOST_RETURN:
        return None
    left = x if lack_x == 0.0 else setback
    return Wing(round(left, 2), round(span, 2), round(out, 2), 1, front)

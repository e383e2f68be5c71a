"""Shapes of paint in a local frame: arrows, stripes, lines along corners."""

from collections.abc import Iterator

import numpy as np
import shapely
import shapely.ops

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.triangle_strips import triangle_strips

STRIPE = 0.5
"""Width in metres of a zebra crossing's stripes and gaps; a larger value gives fewer stripes."""
_MOST_STRIPES = 500
"""Largest number of stripes of an area; a longer area has wider gaps."""
_SHAFT = 0.15
"""Width of an arrow's shaft in metres."""


def arrow(kind: str, length: float, width: float) -> shapely.Geometry:
    """Returns an arrow along +x, centred at the origin.

    Args:
        kind: Name with the directions, e.g. ``arrowStraight``, ``arrowLeftRight``.
        length: Metres along x.
        width: Metres along y, of the whole arrow.
    """
    kind = kind.lower()
    turns = [sign for name, sign in (("left", 1.0), ("right", -1.0)) if name in kind]
    ahead = "straight" in kind or not turns
    foot, tip = -length / 2, length / 2
    front = 0.3 * length if turns else min(0.4 * length, 1.8)
    broad = width if not turns else 0.44 * width
    # The shaft lies opposite a single turn, so that the arrow fills its width.
    aside = (broad if ahead else _SHAFT) / 2 - width / 2 if len(turns) == 1 else 0.0
    middle = aside * turns[0] if turns else 0.0
    parts = []
    if ahead:
        parts.append(shapely.LineString([(foot, middle), (tip - front, middle)]))
        parts.append(_head((tip - front, middle), (tip, middle), broad))
    reach = (0.4 if len(turns) == 1 else 0.28) * width
    bend = tip - (front if ahead else 0.0) - 0.15 * length
    for sign in turns:
        end = sign * (width / 2 - reach)
        corner = min(abs(end - middle), 0.1 * length)
        bent = [(foot, middle), (bend - corner, middle), (bend, middle + sign * corner)]
        parts.append(shapely.LineString([*bent, (bend, end + sign * 0.02)]))
        parts.append(_head((bend, end), (bend, sign * width / 2), 0.3 * length))
    strokes = [
        part.buffer(_SHAFT / 2, cap_style="flat", join_style="mitre") if part.area == 0 else part
        for part in parts
    ]
    return shapely.union_all(strokes)


def _head(base: tuple[float, float], tip: tuple[float, float], width: float) -> shapely.Polygon:
    """Returns a triangle from the centre of its base to its tip."""
    along = np.subtract(tip, base)
    across = width / 2 * np.array([-along[1], along[0]]) / np.hypot(*along)
    return shapely.Polygon([np.add(base, across), tip, np.subtract(base, across)])


def zebra(area: shapely.Polygon, across: FloatArray, *, turned: bool = True) -> shapely.Geometry:
    """Returns the stripes of a crossing.

    Args:
        area: The crossing in plan.
        across: Unit vector across the road, the walking direction.
        turned: Whether the longer axis of an elongated area overrides the direction.
    """
    box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(area))
    sides = np.diff(box[:3], axis=0)
    lengths = np.hypot(*sides.T)
    if turned and lengths.max() > 1.5 * lengths.min():
        across = sides[int(np.argmax(lengths))] / lengths.max()
    return _stripes(area, across)


def hatched(area: shapely.Polygon, heading: float) -> shapely.Geometry:
    """Returns the oblique stripes of a closed area; a heading in radians is along the road."""
    across = np.array([np.cos(heading + np.pi / 4), np.sin(heading + np.pi / 4)])
    return _stripes(area, across)


def _stripes(area: shapely.Polygon, across: FloatArray) -> shapely.Geometry:
    """Returns stripes perpendicular to a direction, with gaps of equal width."""
    along = np.array([-across[1], across[0]])
    corners = shapely.get_coordinates(area)
    low, high = (corners @ across).min(), (corners @ across).max()
    reach = float(np.abs(corners @ along).max()) + 1.0
    count = min(max(round(float(high - low) / (2 * STRIPE)), 1), _MOST_STRIPES)
    starts = low + (high - low) / count * (np.arange(count) + 0.5) - STRIPE / 2
    near, far = starts[:, None] * across, (starts[:, None] + STRIPE) * across
    aside = reach * along
    stripes = shapely.polygons(np.stack([near - aside, far - aside, far + aside, near + aside], 1))
    return shapely.intersection(shapely.union_all(stripes), area)


def dashes(path: FloatArray, pattern: tuple[float, float], width: float) -> shapely.Geometry:
    """Returns rectangles along a path (N x 2) with (dash, gap) lengths in metres."""
    line = shapely.LineString(path)
    dash, gap = pattern
    if dash <= 0 or gap <= 0:
        return line.buffer(width / 2, cap_style="flat", join_style="mitre")
    starts = np.arange(0.0, line.length, max(dash + gap, 0.05))
    pieces = [
        shapely.ops.substring(line, start, min(start + dash, line.length))
        for start in starts.tolist()
    ]
    painted = [piece.buffer(width / 2, cap_style="flat") for piece in pieces if piece.length > 0.01]
    return shapely.union_all(painted)


def painted(shape: shapely.Geometry, patch: Patch) -> Iterator[Strip]:
    """Yields triangles of paint; their height is that of the lane below."""
    for part in shapely.get_parts(shape):
        if part.geom_type != "Polygon" or part.area < 1e-4:
            continue
        triangles = shapely.get_coordinates(shapely.constrained_delaunay_triangles(part))
        corners = np.zeros((len(triangles) // 4, 3, 3))
        corners[..., :2] = triangles.reshape(-1, 4, 2)[:, :3]
        yield from triangle_strips(corners, patch)

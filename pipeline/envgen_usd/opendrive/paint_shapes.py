"""Shapes of paint in their own frame: arrows, stripes, lines along corners."""

from collections.abc import Iterator

import numpy as np
import shapely
import shapely.ops
from shapely import affinity

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.surface import Patch
from envgen_usd.opendrive.strips import Strip, triangle_strip

STRIPE = 0.5
"""Width in metres of a zebra crossing's stripes and of the gaps between them."""
_SHAFT = 0.15


def arrow(kind: str, length: float, width: float) -> shapely.Geometry:
    """An arrow along +x around the origin.

    Args:
        kind: Words such as ``arrowStraight``, ``arrowLeftRight``, ``arrowStraightLeft``.
        length: Along x, metres.
        width: Of the whole arrow, metres.
    """
    kind = kind.lower()
    turns = [sign for name, sign in (("left", 1.0), ("right", -1.0)) if name in kind]
    ahead = "straight" in kind or not turns
    head = min(0.4 * length, 1.8)
    foot, tip = -length / 2, length / 2
    bend = tip - head / 2
    parts = [shapely.box(foot, -_SHAFT / 2, tip - head if ahead else bend, _SHAFT / 2)]
    if ahead:
        parts.append(_head(tip - head, tip, width if not turns else width / 2))
    for sign in turns:
        reach = max(width, 0.6) * sign
        branch = shapely.LineString([(bend - head / 2, 0), (bend, reach / 2)])
        parts.append(branch.buffer(_SHAFT / 2, cap_style="square"))
        side = _head(0.0, abs(reach) / 2 + 0.2, head / 2)
        turned = affinity.rotate(side, 90 * sign, origin=(0, 0))
        parts.append(affinity.translate(turned, bend, reach / 2 - 0.1 * sign))
    return shapely.union_all(parts)


def _head(base: float, tip: float, width: float) -> shapely.Polygon:
    return shapely.Polygon([(base, -width / 2), (tip, 0.0), (base, width / 2)])


def zebra(area: shapely.Polygon, across: FloatArray) -> shapely.Geometry:
    """Stripes of a crossing.

    Args:
        area: The crossing in plan.
        across: Unit vector across the road, along which people walk; an area that is clearly
            longer one way says better where they do.
    """
    box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(area))
    sides = np.diff(box[:3], axis=0)
    lengths = np.hypot(*sides.T)
    if lengths.max() > 1.5 * lengths.min():
        across = sides[int(np.argmax(lengths))] / lengths.max()
    along = np.array([-across[1], across[0]])
    corners = shapely.get_coordinates(area)
    low, high = (corners @ across).min(), (corners @ across).max()
    reach = float(np.abs(corners @ along).max()) + 1.0
    count = max(round(float(high - low) / (2 * STRIPE)), 1)
    starts = low + (high - low) / count * (np.arange(count) + 0.5) - STRIPE / 2
    stripes = [
        shapely.Polygon(
            [
                start * across - reach * along,
                (start + STRIPE) * across - reach * along,
                (start + STRIPE) * across + reach * along,
                start * across + reach * along,
            ]
        )
        for start in starts.tolist()
    ]
    return shapely.intersection(shapely.union_all(stripes), area)


def dashes(path: FloatArray, pattern: tuple[float, float], width: float) -> shapely.Geometry:
    """A line along a path (N x 2) as rectangles, with (dash, gap) lengths in metres."""
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
    """Triangles of paint; it takes the height of the lane below."""
    for part in shapely.get_parts(shape):
        if part.geom_type != "Polygon" or part.area < 1e-4:
            continue
        for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(part)):
            corner = shapely.get_coordinates(triangle)[:3]
            yield triangle_strip(np.column_stack([corner, np.zeros(3)]), patch)

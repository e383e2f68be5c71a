"""Footprints of a map: clean, off the road, and apart from one another."""

from collections import Counter

import numpy as np
import shapely

from envgen_usd.city.buildings.building_design import JOINT
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.place import Houses

_STRAIGHT = 0.15
"""Distance of a corner from a straight wall by which it is left out, metres."""
_LEAST_AREA = 6.0
"""Area of the smallest building, m²."""
_LEAST_BODY = 0.5
"""Area of the smallest body of a building of several, m²; masts are narrow."""
_ROAD_SHARE = 0.3
"""Share of a footprint on the road up to which it is cut; others are left out."""
_FROM_ROAD = 0.2
"""Distance of a cut footprint from the road, metres; more than `_STRAIGHT` moves its corners."""
OVER_ROAD = 2.5
"""Height above the ground from which a body may reach over a road, metres."""


def cleaned_footprints(
    houses: Houses, road: FloatArray, counts: Counter[str]
) -> tuple[list[shapely.Polygon], list[int]]:
    """Footprints free of the road and of one another, the largest first, with their numbers.

    Args:
        houses: Buildings of the map.
        road: Triangles of the road in plan, T x 3 x 2.
        counts: Counts what is cut and left out, by reason.
    """
    tree = shapely.STRtree(shapely.polygons(road)) if len(road) else None
    shapes: list[shapely.Polygon] = []
    numbers: list[int] = []
    taken: dict[int, shapely.Polygon] = {}
    low, high = houses.vertical_range().T
    wide = shapely.STRtree(houses.footprints)
    for number in np.argsort(-shapely.area(houses.footprints), kind="stable").tolist():
        least = _LEAST_AREA if houses.groups[number] < 0 else _LEAST_BODY
        shape = _largest(shapely.make_valid(houses.footprints[number]), least)
        if shape is None:
            counts["small"] += 1
            continue
        area = shape.area
        for other in wide.query(shape, predicate="intersects").tolist():
            meet = low[number] < high[other] and low[other] < high[number]
            if other in taken and other != number and meet:
                rest = shapely.difference(shape, taken[other]) if shape else None
                shape = _largest(rest, least) if rest else None
        if shape is None or shape.area < 0.5 * area:
            counts["inside"] += 1
            continue
        if tree is not None and low[number] < OVER_ROAD:
            hit = tree.query(shape, predicate="intersects")
            if len(hit):
                covered = shapely.union_all(tree.geometries[hit])
                if shapely.intersection(shape, covered).area > _ROAD_SHARE * shape.area:
                    counts["on_road"] += 1
                    continue
                shape = _largest(shapely.difference(shape, covered.buffer(_FROM_ROAD)), least)
                counts["cut"] += 1
        if shape is None:
            counts["small"] += 1
            continue
        taken[number] = shape
        shapes.append(shape if houses.groups[number] < 0 else _with_joint(shape))
        numbers.append(number)
    return shapes, numbers


def _with_joint(shape: shapely.Polygon) -> shapely.Polygon:
    """The footprint of a body a joint away from the others of its building.

    Rounding to the grid would let solids that touch at an angle overlap.
    """
    inner = shapely.buffer(shape, -JOINT / 2.0, join_style="mitre")
    return inner if inner.geom_type == "Polygon" and not inner.is_empty else shape


def _largest(shape: shapely.Geometry, least: float) -> shapely.Polygon | None:
    """The largest part of a shape with straight walls; `None` where it is smaller than `least`."""
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    if not parts:
        return None
    best = max(parts, key=shapely.area)
    plain = shapely.simplify(best, _STRAIGHT)
    # Grid of 1 mm: neighbours then share their walls exactly.
    plain = shapely.set_precision(plain, 1e-3)
    parts = [part for part in shapely.get_parts(plain) if part.geom_type == "Polygon"]
    best = max(parts, key=shapely.area, default=None)
    if best is None or best.area < least or not best.is_valid:
        return None
    courts = [ring for ring in best.interiors if shapely.Polygon(ring).area > _LEAST_AREA]
    return shapely.Polygon(best.exterior, courts)

"""Polygons that overlap neither the road nor each other."""

import numpy as np
import shapely

from envgen_usd.geometry.grid_overlay import on_grid
from envgen_usd.geometry.road_outline import Outline

OVERLAP = 1e-6
"""Overlap area attributed to rounding, m²; a larger value tolerates more overlap."""


def make_disjoint(polygons: list[shapely.Polygon], outline: Outline) -> list[shapely.Polygon]:
    """Subtracts the road and all earlier polygons from each polygon.

    Args:
        polygons: Valid polygons, metres, road frame.
        outline: Outline of the road. Of a polygon cut in two by the road, the larger part remains.

    Returns:
        As many polygons; a polygon may be empty.
    """
    result = _off_road(polygons, outline)
    for first, second in np.sort(shapely.STRtree(result).query(result, "intersects").T, axis=1):
        if first == second:
            continue
        one, other = result[first], result[second]
        if on_grid(shapely.intersection, one, other).area > OVERLAP:
            result[second] = _largest(on_grid(shapely.difference, other, one))
    return result


def _off_road(polygons: list[shapely.Polygon], outline: Outline) -> list[shapely.Polygon]:
    edges = shapely.linestrings(np.stack([outline.start[:, :2], outline.end[:, :2]], axis=1))
    result = list(polygons)
    hits, edge = shapely.STRtree(edges).query(result, "intersects")
    for number in np.unique(hits):
        cuts = [result[number].exterior, *edges[edge[hits == number]]]
        pieces = shapely.polygonize(shapely.get_parts(shapely.union_all(cuts)))
        inside = result[number].buffer(OVERLAP)
        result[number] = _largest(
            shapely.multipolygons([p for p in pieces.geoms if inside.contains(p)])
        )
    return result


def _largest(shape: shapely.Geometry) -> shapely.Polygon:
    """The largest polygon of a geometry without its holes; may be empty."""
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    if not parts:
        return shapely.Polygon()
    return shapely.Polygon(max(parts, key=lambda part: part.area).exterior)

"""Polygons that overlap neither the road nor one another."""

import numpy as np
import shapely

from envgen_usd.geometry.outline import Outline

OVERLAP = 1e-6
"""Square metres of overlap that rounding leaves."""


def make_disjoint(polygons: list[shapely.Polygon], outline: Outline) -> list[shapely.Polygon]:
    """Cuts the road off polygons, and off each what an earlier one covers.

    Args:
        polygons: Valid polygons, metres, road frame.
        outline: Where the road begins; both sides of it are told apart by the larger part, which
            is the polygon's.

    Returns:
        As many polygons; one may be empty.
    """
    result = _off_road(polygons, outline)
    for one, other in np.sort(shapely.STRtree(result).query(result, "intersects").T, axis=1):
        if one == other or result[one].intersection(result[other]).area <= OVERLAP:
            continue
        result[other] = _largest(result[other].difference(result[one]))
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
    """The largest polygon of a geometry without its holes; empty if there is none."""
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    if not parts:
        return shapely.Polygon()
    return shapely.Polygon(max(parts, key=lambda part: part.area).exterior)

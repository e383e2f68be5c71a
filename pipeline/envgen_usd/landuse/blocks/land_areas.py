"""Set operations on land, on the grid of coordinates.

Without a grid, GEOS 3.14 loses shapes that nearly touch.
"""

from collections.abc import Iterable

import numpy as np
import shapely

from envgen_usd.chunks import GRID
from envgen_usd.geometry.grid_overlay import mitred

NARROW = 5.0
"""Width in metres below which land becomes no plot; a larger value leaves more to neighbours."""


def areas_of(shape: shapely.Geometry) -> shapely.Geometry:
    """The polygons of a shape, without points and lines."""
    parts = shapely.get_parts(shapely.get_parts(shape))
    return shapely.multipolygons(parts[shapely.area(parts) > 0.0])


def valid_areas(shape: shapely.Geometry) -> shapely.Geometry:
    """The polygons of a shape, valid: mitres near a side may cross it by less than the grid."""
    return areas_of(shape if shapely.is_valid(shape) else shapely.make_valid(shape))


def union(shapes: Iterable[shapely.Geometry]) -> shapely.Geometry:
    """Union of areas."""
    return areas_of(shapely.union_all([areas_of(shape) for shape in shapes], grid_size=GRID))


def without(shape: shapely.Geometry, other: shapely.Geometry) -> shapely.Geometry:
    """What is in the first area alone."""
    return areas_of(shapely.difference(shape, other, grid_size=GRID))


def common(shape: shapely.Geometry, other: shapely.Geometry) -> shapely.Geometry:
    """What is in both areas."""
    return areas_of(shapely.intersection(shape, other, grid_size=GRID))


def opened(land: shapely.Geometry, width: float = NARROW) -> shapely.Geometry:
    """Land without what is narrower than a width in metres."""
    with np.errstate(divide="ignore", invalid="ignore"):  # mitres of sides in line
        core = shapely.buffer(land, -width / 2.0, join_style="mitre")
        whole = mitred(core, width / 2.0)
    return common(whole, valid_areas(land))


def largest(shape: shapely.Geometry) -> shapely.Polygon:
    """The largest polygon of a shape without its holes; may be empty."""
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    if not parts:
        return shapely.Polygon()
    return shapely.Polygon(max(parts, key=lambda part: part.area).exterior)

"""Land that no plot could use: it goes to the plots beside it, as corners of gardens."""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.landuse.blocks.land_areas import areas_of, largest, opened
from envgen_usd.models.array_types import IntArray

FARTHEST = 12.0
"""Distance in metres up to which land goes to a plot; a larger value leaves less open land."""
_TOUCH = 0.3
"""Distance between a plot and land that touch, metres."""
_LEAST_BORDER = 2.0
"""Least length in metres of the border between a plot and land that it gets."""
_EDGE = 2.0
"""Distance between points on borders from which land is divided, metres."""
_LATTICE = 0.25
"""Lattice of these points, metres: nearly coincident ones break GEOS."""
_WIDTH = 1.6
"""Least width of what a plot gets, metres: two cells of landuse.

A larger value leaves more slivers open, a smaller one gives plots tongues that cells lose.
"""
_LEAST = 1.0
"""Least area of a piece of land worth dividing, m²."""


def share_out(shapes: Sequence[shapely.Polygon], land: shapely.Geometry) -> list[shapely.Polygon]:
    """Gives land to the nearest of the plots that border on it.

    Args:
        shapes: Plots.
        land: Land without the plots and without lanes.

    Returns:
        As many plots, as simple polygons without holes.
    """
    result = list(shapes)
    plots = np.array(result, object)
    parts = shapely.get_parts(areas_of(opened(land, _WIDTH)))
    parts = parts[shapely.area(parts) > _LEAST]
    if not len(parts) or not len(plots):
        return result
    part, plot = shapely.STRtree(plots).query(parts, "dwithin", distance=_TOUCH)
    borders = shapely.intersection(
        shapely.boundary(plots[plot]), shapely.buffer(parts[part], _TOUCH)
    )
    long_enough = shapely.length(borders) >= _LEAST_BORDER
    part, plot, borders = part[long_enough], plot[long_enough], borders[long_enough]
    gained: defaultdict[int, list[shapely.Geometry]] = defaultdict(list)
    for number in np.unique(part).tolist():
        own = part == number
        for owner, piece in _divided(parts[number], plot[own], borders[own]):
            gained[owner].append(piece)
    for owner, pieces in gained.items():
        joined = shapely.union_all([result[owner], *pieces])
        # Closing the cracks between them moves no side towards a road.
        whole = shapely.buffer(
            shapely.buffer(joined, _TOUCH / 2.0, join_style="mitre"),
            -_TOUCH / 2.0,
            join_style="mitre",
        )
        grown = largest(opened(whole, _WIDTH))
        if grown.area >= result[owner].area:
            result[owner] = grown
    return result


def _divided(
    land: shapely.Polygon, owners: IntArray, borders: NDArray[np.object_]
) -> list[tuple[int, shapely.Geometry]]:
    """The piece of a polygon that is nearest to each owner's border."""
    near = areas_of(
        shapely.intersection(land, shapely.buffer(shapely.union_all(borders), FARTHEST))
    )
    if len(owners) == 1:
        return [(int(owners[0]), near)]
    points, of = shapely.get_coordinates(shapely.segmentize(borders, _EDGE), return_index=True)
    points, kept = np.unique(np.round(points / _LATTICE) * _LATTICE, axis=0, return_index=True)
    if len(points) < 2:
        return [(int(owners[0]), near)]
    cells = shapely.voronoi_polygons(shapely.multipoints(points), ordered=True, extend_to=near)
    pieces = shapely.intersection(shapely.get_parts(cells), near)
    owner = owners[of[kept]]
    return [
        (number, shapely.union_all([areas_of(piece) for piece in pieces[owner == number]]))
        for number in np.unique(owner).tolist()
    ]

"""Overlays of polygons on a grid, and what overlays can take."""

from collections.abc import Callable

import shapely

_GRIDS = (1e-9, 1e-6)
"""Grid spacings of intermediate results that are tried in turn, metres.

Overlays of polygons whose borders nearly coincide may be wrong by whole polygons unless they have a
grid (JTS issue 1000, GEOS issue 1344). Coordinates of millions of metres have no digits left for
the first one.
"""


def on_grid(work: Callable[..., shapely.Geometry], *shapes: object) -> shapely.Geometry:
    """Overlays shapes on the finest grid that GEOS can use.

    Args:
        work: An overlay of shapely, e.g. ``shapely.difference``.
        shapes: Its arguments.

    Raises:
        shapely.GEOSException: No grid helps.
    """
    for grid in _GRIDS[:-1]:
        try:
            return work(*shapes, grid_size=grid)
        except shapely.GEOSException:
            continue
    return work(*shapes, grid_size=_GRIDS[-1])


def mitred(shape: shapely.Geometry, distance: float) -> shapely.Geometry:
    """Polygons of a shape with sides that lie a distance outwards, valid.

    GEOS's mitres beside a hole that touches the outline may cross it; overlays refuse such shapes.
    """
    wide = shapely.buffer(shape, distance, join_style="mitre")
    if shapely.is_valid(wide):
        return wide
    return shapely.make_valid(wide, method="structure", keep_collapsed=False)

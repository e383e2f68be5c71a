"""Plots around the houses of a map that has no parcels: Voronoi cells within a block.

1. Streets, water, railways and paths that lead through separate blocks (`plot_territories`).
2. A plot is the land that is nearer to its house than to any other main building of the block. It
   lies within `REACH` of the rectangle around the house, along the house's sides: a lone house in
   the open has a rectangular plot.
3. Only land that is residential on the map, or that the map says nothing about, belongs to plots.
   Driveways and paths that end at a house are parts of its plot.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.landuse.plot_territories import BARRIERS, territories
from envgen_usd.landuse.shape_cells import cells_of_shapes
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray, IntArray
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.models.place import Shapes

REACH = 18.0
"""Farthest land of a plot from the rectangle around its house, metres."""
_CORNER = REACH * np.sqrt(2.0)
_TO_ROAD = 1
"""Cells between a road and plots: a verge."""


@dataclass(frozen=True)
class PlotHouses:
    """The main buildings of a map.

    Attributes:
        footprints: B polygons, metres, road frame.
        lived_in: B, true for those that get plots; the others keep land from their neighbours.
    """

    footprints: Shapes
    lived_in: BoolArray

    def near(self, bounds: Sequence[float]) -> IntArray:
        """Numbers of the houses whose boxes touch a rectangle."""
        boxes = shapely.bounds(self.footprints).reshape(-1, 4)
        touch = (boxes[:, :2] <= bounds[2:]) & (boxes[:, 2:] >= bounds[:2])
        return np.flatnonzero(touch.all(axis=1))


@dataclass(frozen=True)
class PlotLand:
    """Land of a chunk and a margin around it.

    Attributes:
        chunk: Tile.
        around: Width of the margin, cells; at least `plot_territories.MARGIN`.
        classes: H x W, classes of the map and its roads.
        through: H x W, true on paths that separate plots.
        own: H x W, true on driveways and paths that end at a house.
    """

    chunk: Chunk
    around: int
    classes: ByteArray
    through: BoolArray
    own: BoolArray


def house_plots(houses: PlotHouses, land: PlotLand, ground: LanduseClass) -> IntArray:
    """Number of the house that each cell of the land belongs to, from 1; 0 without.

    Args:
        houses: Main buildings.
        land: The land of a chunk.
        ground: Ground of residential plots.
    """
    chunk, around, classes = land.chunk, land.around, land.classes
    low = np.array(chunk.bounds[:2]) - around * CELL_SIZE
    high = np.array(chunk.bounds[2:]) + around * CELL_SIZE
    here = houses.near((*low, *high))
    if not len(here):
        return np.zeros(classes.shape, np.int64)
    numbers = (here + 1).tolist()
    built = cells_of_shapes(chunk, zip(houses.footprints[here], numbers, strict=True), around)
    blocks = np.where(land.through, np.uint8(LanduseClass.ROAD), classes)
    reach = np.full(len(houses.footprints) + 1, _CORNER)
    nearest = territories(built, blocks, reach)
    is_free = np.isin(classes, (LanduseClass.UNKNOWN, LanduseClass.LAWN, ground)) | land.own
    road = ndimage.binary_dilation(classes == LanduseClass.ROAD, iterations=_TO_ROAD)
    is_free &= ~np.isin(blocks, BARRIERS) & ~road
    wanted = np.append(False, houses.lived_in)[nearest]
    plots = np.where(wanted & (is_free | (built == nearest)), nearest, 0)
    row, column = np.nonzero(plots)
    places = low + (np.column_stack([column, row]) + 0.5) * CELL_SIZE
    inside = _within_reach(houses.footprints, plots[row, column] - 1, places)
    plots[row[~inside], column[~inside]] = 0
    return _with_houses(plots, built)


def _with_houses(plots: IntArray, built: IntArray) -> IntArray:
    """Plots without land that other land separates from their house."""
    for number, span in enumerate(ndimage.find_objects(plots), 1):
        if span is None:
            continue
        own = plots[span] == number
        parts, count = ndimage.label(own)
        if count > 1:
            kept = np.unique(parts[own & (built[span] == number)])
            plots[span][own & ~np.isin(parts, kept)] = 0
    return plots


def _within_reach(footprints: Shapes, house: IntArray, places: FloatArray) -> BoolArray:
    """True for places (N x 2) within `REACH` of the rectangle around their house (N)."""
    numbers, of = np.unique(house, return_inverse=True)
    if not len(numbers):
        return np.zeros(0, bool)
    boxes = shapely.oriented_envelope(footprints[numbers])
    corners = np.array([shapely.get_coordinates(box)[:4] for box in boxes])
    middle = corners.mean(axis=1)
    sides = corners[:, 1:3] - corners[:, :2]
    lengths = np.maximum(np.linalg.norm(sides, axis=2), 1e-9)
    axes = sides / lengths[:, :, None]
    away = np.abs(np.einsum("nac,nc->na", axes[of], places - middle[of]))
    inside: BoolArray = (away <= lengths[of] / 2.0 + REACH).all(axis=1)
    return inside

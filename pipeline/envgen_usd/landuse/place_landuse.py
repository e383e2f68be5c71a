"""Landuse of a real or generated place on the lattice of cells: classes, plots, houses.

1. The map's areas, railways, water, ways and roads are drawn in this order; streets are as wide as
   they are with their sidewalks.
2. Each main building gets a plot (`plot_territories`) on land that the map leaves to buildings.
   What remains of residential areas is grass.
3. Parks, car parks and allotments are whole plots.
"""

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.landuse.osm_landuse import VERGE, OsmMap
from envgen_usd.landuse.plot_territories import (
    BARRIERS,
    MARGIN,
    TERRITORY,
    YARD,
    separate,
    territories,
)
from envgen_usd.landuse.shape_cells import cells_of_box
from envgen_usd.models.array_types import BoolArray, ByteArray, IntArray
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.models.place import Houses, Shapes, Streets

LEAST_PLOT = 60
"""Least size of a plot, cells: about 37 m². A larger value leaves out more plots."""
WHOLE = (LanduseClass.PARK, LanduseClass.PARKING, LanduseClass.ALLOTMENT)
"""Classes whose areas are plots without houses."""
AROUND = 3
"""Cells around a house that belong to its plot on whatever land it stands."""
_FREE = (LanduseClass.UNKNOWN, LanduseClass.LAWN, LanduseClass.RUBBLE)
_OVER = (LanduseClass.VERGE, LanduseClass.ACCESS, LanduseClass.ROAD)
_SIDES = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]])


@dataclass(frozen=True, eq=False)
class PlaceLand:
    """Landuse of a box of cells; row 0 is the south.

    Attributes:
        classes: H x W `LanduseClass` values.
        plots: H x W plot numbers, unique in the box; 0 without a plot.
        built: H x W, true on main buildings; cells that touch another building are left out, so
            each connected part is one building.
    """

    classes: ByteArray
    plots: IntArray
    built: BoolArray


class PlaceMap:
    """A place, sorted for drawing boxes of it."""

    def __init__(self, extract: OsmMap, streets: Streets, houses: Houses, sidewalk: float) -> None:
        """Sorts what is drawn.

        Args:
            extract: Areas, ways and roads of the map.
            streets: Streets with houses, in the extract's metres.
            houses: Main buildings, in the extract's metres.
            sidewalk: Width of a sidewalk on either side of streets, metres.
        """
        paved = shapely.buffer(streets.lines, streets.widths / 2.0 + sidewalk)
        kinds, shapes = np.array(extract.classes), np.array(extract.shapes, dtype=object)
        verge, access, road = (kinds == kind for kind in _OVER)
        below = ~(verge | access | road)
        layers = (
            (shapes[below], kinds[below]),
            (shapes[verge], LanduseClass.VERGE),
            (shapely.buffer(paved, VERGE), LanduseClass.VERGE),
            (shapes[access], LanduseClass.ACCESS),
            (shapes[road], LanduseClass.ROAD),
            (paved, LanduseClass.ROAD),
        )
        self._shapes: Shapes = np.concatenate([drawn for drawn, _ in layers])
        self._kinds: ByteArray = np.concatenate(
            [np.broadcast_to(np.uint8(kind), len(drawn)) for drawn, kind in layers]
        )
        self._tree = shapely.STRtree(self._shapes)
        self._houses, self._house_tree = houses, shapely.STRtree(houses.footprints)

    def cells(self, corner: tuple[int, int], shape: tuple[int, int]) -> PlaceLand:
        """Landuse of a box.

        Args:
            corner: Column and row of its first cell on the map's lattice.
            shape: Rows and columns.
        """
        first = (corner[0] - MARGIN, corner[1] - MARGIN)
        wide = (shape[0] + 2 * MARGIN, shape[1] + 2 * MARGIN)
        box = shapely.box(
            first[0] * CELL_SIZE,
            first[1] * CELL_SIZE,
            (first[0] + wide[1]) * CELL_SIZE,
            (first[1] + wide[0]) * CELL_SIZE,
        )
        near = np.sort(self._tree.query(box))
        pairs = zip(self._shapes[near], self._kinds[near].tolist(), strict=True)
        base = cells_of_box(first, wide, pairs).astype(np.uint8)
        here = np.sort(self._house_tree.query(box))
        footprints = self._houses.footprints[here]
        numbers = range(1, len(here) + 1)
        houses = cells_of_box(first, wide, zip(footprints, numbers, strict=True))
        land = land_with_plots(base, houses, self._industrial(here, base, houses))
        cut = np.s_[MARGIN : MARGIN + shape[0], MARGIN : MARGIN + shape[1]]
        return PlaceLand(land.classes[cut], land.plots[cut], land.built[cut])

    def _industrial(self, chosen: IntArray, base: ByteArray, houses: IntArray) -> BoolArray:
        """True for houses that are industrial by the map; of unknown ones, by the ground."""
        said = self._houses.landuse[chosen]
        on = np.bincount(houses[base == LanduseClass.RUBBLE], minlength=len(chosen) + 1)[1:]
        all_of_it = np.bincount(houses.ravel(), minlength=len(chosen) + 1)[1:]
        is_industrial: BoolArray = (said == "industrial") | ((said == "") & (2 * on > all_of_it))
        return is_industrial


def land_with_plots(base: ByteArray, houses: IntArray, industrial: BoolArray) -> PlaceLand:
    """Lays plots around houses; see rules 2 and 3.

    Args:
        base: H x W, classes without plots; `UNKNOWN` and the grounds of plots are free for plots.
        houses: H x W, number of the house of each cell from 1, 0 without.
        industrial: For each house, true if its plot's ground is rubble.
    """
    houses = np.where(np.isin(base, BARRIERS), 0, houses)
    reach = np.concatenate([[0.0], np.where(industrial, YARD, TERRITORY)])
    plots = territories(houses, base, reach)
    beside = ndimage.maximum_filter(houses, 2 * AROUND + 1) > 0
    plots[~np.isin(base, _FREE) & ~beside] = 0
    plots = _kept(plots)
    grounds = np.where(industrial, LanduseClass.RUBBLE, LanduseClass.LAWN)
    ground = np.concatenate([[LanduseClass.GRASS], grounds])[plots]
    classes = np.where(np.isin(base, (LanduseClass.UNKNOWN, LanduseClass.LAWN)), ground, base)
    classes = np.where(plots > 0, ground, classes).astype(np.uint8)
    built = separate(houses) & (plots == houses)
    return PlaceLand(classes, with_whole_plots(plots, classes), built)


def _kept(plots: IntArray) -> IntArray:
    """Plots without those that are too small."""
    counts = np.bincount(plots.ravel())
    counts[0] = 0
    return np.where(counts[plots] >= LEAST_PLOT, plots, 0)


def with_whole_plots(plots: IntArray, classes: ByteArray) -> IntArray:
    """Numbers connected areas of whole plots after those of houses."""
    numbered, last = plots.copy(), int(plots.max(initial=0))
    for kind in WHOLE:
        labels, count = ndimage.label((classes == kind) & (plots == 0), _SIDES)
        parts = _kept(np.asarray(labels, np.int64))
        numbered = np.where(parts > 0, parts + last, numbered)
        last += count
    return numbered

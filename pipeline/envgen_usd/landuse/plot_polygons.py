"""Plots as polygons, from the landuse raster alone."""

from collections.abc import Mapping
from itertools import chain

import numpy as np
import shapely

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.cell_ring import CellRing, trace_ring
from envgen_usd.landuse.disjoint_polygons import make_disjoint
from envgen_usd.landuse.plot_cells import CellLookup, PlotCells
from envgen_usd.landuse.plot_corners import fit_polygon
from envgen_usd.landuse.plot_frontage import RoadBorders, crossing, street_side
from envgen_usd.models.array_types import ByteArray, FloatArray, IntArray
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.models.road_surface import RoadSurface

SMALLEST = 12
"""Least size of a plot, cells (about 7 m²); a larger value drops more plots."""
_NEIGHBOURS = 2
"""Plots between a wanted plot and the farthest plot that its shape may depend on."""
_WAYS = (LanduseClass.ACCESS, LanduseClass.ROAD_END)
"""Classes of paved ways."""
GROUNDS = tuple(
    kind for kind in LanduseClass if kind not in (LanduseClass.UNKNOWN, LanduseClass.ROAD, *_WAYS)
)
"""Possible ground classes of a plot."""


def find_plots(
    maps: Mapping[Chunk, LanduseMap],
    surface: RoadSurface,
    wanted: frozenset[int] | None = None,
) -> tuple[Plot, ...]:
    """Returns the plots of a map with straight sides, their class and their street side.

    Plots overlap neither each other nor the road. A paved access marks the street side; without
    access it is the side nearest to a road.

    Args:
        maps: Landuse of chunks; plots across chunk borders are joined.
        surface: The whole road.
        wanted: Numbers of the plots that are needed; `None` means all. Plots that touch them, and
            those that touch these, are found, too, as the shapes of neighbours depend on each
            other.

    Returns:
        Plots by ascending number; a plot's id contains its number.
    """
    cells, lookup = PlotCells(maps), CellLookup(maps)
    rings = _rings(cells, lookup, wanted)
    if not rings:
        return ()
    outline = Outline.of(surface)
    shapes = make_disjoint(_fit_all(rings, lookup), outline)
    borders = RoadBorders(surface)
    plots = []
    for (number, ring), shape in zip(rings.items(), shapes, strict=True):
        if shape.is_empty:
            continue
        polygon = shapely.get_coordinates(shapely.orient_polygons(shape, exterior_cw=False))[:-1]
        steps = _access_steps(ring, lookup)
        frontage = street_side(polygon, steps, outline)
        ground = _main_class(cells.classes(number))
        road, side = borders.side_at(frontage.mean(axis=0))
        access = crossing(steps, frontage)
        plots.append(Plot(f"plot_{number}", polygon, ground, frontage, road, access, side))
    return tuple(plots)


def _rings(
    cells: PlotCells, lookup: CellLookup, wanted: frozenset[int] | None
) -> dict[int, CellRing]:
    """Borders of the wanted plots, and of those around them."""
    large = cells.plots(SMALLEST)
    if wanted is None:
        return {number: trace_ring(cells.places(number)) for number in sorted(large)}
    rings: dict[int, CellRing] = {}
    following = wanted & large
    for _ in range(_NEIGHBOURS + 1):
        new = {number: trace_ring(cells.places(number)) for number in sorted(following)}
        rings |= new
        beside = (np.unique(lookup(ring.outer)[0]).tolist() for ring in new.values())
        following = frozenset(chain(*beside)) & large - rings.keys()
    return dict(sorted(rings.items()))


def _fit_all(rings: Mapping[int, CellRing], lookup: CellLookup) -> list[shapely.Polygon]:
    """Polygons of all plots, metres."""
    neighbours = {number: lookup(ring.outer)[0] for number, ring in rings.items()}
    shared = _shared_steps(rings, neighbours)
    fitted = (fit_polygon(ring, neighbours[n], shared[n]) for n, ring in rings.items())
    return [shapely.Polygon(polygon * CELL_SIZE).buffer(0) for polygon in fitted]


def _shared_steps(
    rings: Mapping[int, CellRing], neighbours: Mapping[int, IntArray]
) -> dict[int, dict[int, FloatArray]]:
    """The steps of each plot towards each neighbour, in the same order for both."""
    shared: dict[int, dict[int, FloatArray]] = {number: {} for number in rings}
    for number, ring in rings.items():
        beyond = neighbours[number]
        for other in np.unique(beyond[beyond > number]).tolist():
            if other in shared:
                steps = np.unique(ring.middles[beyond == other], axis=0)
                shared[number][other] = shared[other][number] = steps
    return shared


def _access_steps(ring: CellRing, lookup: CellLookup) -> FloatArray:
    """Border points of a plot's paved cells, N x 2, metres."""
    paved = lookup(ring.inner)[1] == LanduseClass.ACCESS
    steps: FloatArray = ring.middles[paved] * CELL_SIZE
    return steps


def _main_class(classes: ByteArray) -> LanduseClass:
    """The most frequent ground class."""
    counts = np.bincount(classes, minlength=len(LanduseClass))
    return max(GROUNDS, key=lambda kind: (counts[kind], -kind))

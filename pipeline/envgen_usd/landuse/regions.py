"""Landuse of a chunk as polygons without gaps: plots, road, and the land around them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from rasterio.features import shapes
from rasterio.transform import Affine
from scipy.ndimage import distance_transform_edt

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.models.arrays import ByteArray
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.models.surface import RoadSurface

TOLERANCE = 1.6 * CELL_SIZE
"""Metres; corners whose removal changes less than the square of this are left out."""
THINNEST = 5e-3
"""Metres of width below which land is a trace of rounding."""


@dataclass(frozen=True)
class Region:
    """Land of one use.

    Attributes:
        shape: A polygon with its holes, counter-clockwise, metres, road frame.
        landuse: Class of its ground.
        plot: The plot that it is, if it is one.
    """

    shape: shapely.Polygon
    landuse: LanduseClass
    plot: Plot | None = None


def find_regions(
    landuse: LanduseMap, plots: Sequence[Plot], surface: RoadSurface
) -> tuple[Region, ...]:
    """Divides a chunk into polygons.

    1. The road has its exact border, plots have their straight sides.
    2. The classes of all other cells are continued under both, vectorised, and simplified
       together, so that neighbours keep the same border.
    3. Road and plots are cut out of them.

    The regions of all chunks of a map together cover it: no gap, no overlap. A plot over the
    border of chunks is whole, in the chunk that holds its centroid.

    Args:
        landuse: Classes and plots of the chunk.
        plots: Of the whole map, or all near the chunk.
        surface: The whole road.
    """
    chunk = landuse.chunk
    box = shapely.box(*chunk.bounds)
    outlines = np.array([shapely.Polygon(plot.polygon) for plot in plots], dtype=object)
    near = shapely.intersects(outlines, box)
    road = _road_in(chunk, surface)
    taken = shapely.union_all([road, *outlines[near]])
    kinds, land = _vectorise(chunk, _around_plots(landuse))
    rest = [
        Region(part, LanduseClass(kind))
        for kind, piece in zip(kinds, shapely.difference(land, taken), strict=True)
        for part in _polygons(piece)
    ]
    within = shapely.intersects_xy(box, shapely.get_coordinates(shapely.centroid(outlines)))
    own = [
        Region(shapely.orient_polygons(outline), plot.landuse, plot)
        for outline, plot, is_own in zip(outlines, plots, within, strict=True)
        if is_own
    ]
    return (*own, *(Region(part, LanduseClass.ROAD) for part in _polygons(road)), *rest)


def _around_plots(landuse: LanduseMap) -> ByteArray:
    """Classes beside road and plots, continued under them, 255 x 255."""
    covered = (landuse.plots > 0) | (landuse.classes == LanduseClass.ROAD)
    if covered.all():
        return np.full(covered.shape, LanduseClass.GRASS, dtype=np.uint8)
    row, column = distance_transform_edt(covered, return_distances=False, return_indices=True)
    around: ByteArray = landuse.classes[row, column]
    return around


def _vectorise(chunk: Chunk, classes: ByteArray) -> tuple[list[int], np.ndarray]:
    """Class of each connected area, and its polygon."""
    x, y = chunk.origin
    transform = Affine(CELL_SIZE, 0.0, x, 0.0, CELL_SIZE, y)
    found = list(shapes(classes, transform=transform))
    areas = np.array([shapely.geometry.shape(area) for area, _ in found], dtype=object)
    simple = shapely.coverage_simplify(areas, TOLERANCE, simplify_boundary=False)
    return [int(kind) for _, kind in found], simple


def _road_in(chunk: Chunk, surface: RoadSurface) -> shapely.Geometry:
    """The road on the ground of a chunk."""
    loops = np.array(
        [shapely.Polygon(loop[:, :2]) for loop in surface.outline_loops() if len(loop) > 2],
        dtype=object,
    )
    box = shapely.box(*chunk.bounds)
    near = loops[shapely.intersects(shapely.envelope(loops), box)]
    outer = shapely.is_ccw(shapely.get_exterior_ring(near))
    parts = shapely.intersection(shapely.make_valid(near), box)
    return shapely.difference(shapely.union_all(parts[outer]), shapely.union_all(parts[~outer]))


def _polygons(shape: shapely.Geometry) -> list[shapely.Polygon]:
    """Polygons of a shape without its tongues between lines that almost meet."""
    core = shapely.buffer(shape, -THINNEST / 2, join_style="mitre")
    sound = shapely.intersection(shape, shapely.buffer(core, THINNEST, join_style="mitre"))
    return [
        shapely.orient_polygons(part)
        for part in shapely.get_parts(sound)
        if part.geom_type == "Polygon" and 2 * part.area > THINNEST * part.length
    ]

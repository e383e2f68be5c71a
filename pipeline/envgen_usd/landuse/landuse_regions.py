"""Landuse of a chunk as polygons without gaps: plots, road, and other land."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from rasterio.features import shapes
from rasterio.transform import Affine
from scipy.ndimage import distance_transform_edt

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.geometry.grid_overlay import mitred, on_grid
from envgen_usd.landuse.road_areas import RoadAreas
from envgen_usd.models.array_types import ByteArray
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot

TOLERANCE = 1.6 * CELL_SIZE
"""Simplification tolerance, metres; a larger value gives coarser polygons.

Corners whose removal changes an area below its square are dropped.
"""
THINNEST = 5e-3
"""Least width of land, metres; thinner land is a rounding artefact.

A larger value drops wider slivers.
"""


@dataclass(frozen=True)
class Region:
    """Land of a single use.

    Attributes:
        shape: A polygon with its holes, counter-clockwise, metres, road frame.
        landuse: Class of its ground.
        plot: Its plot, or `None`.
    """

    shape: shapely.Polygon
    landuse: LanduseClass
    plot: Plot | None = None


def find_regions(
    landuse: LanduseMap, plots: Sequence[Plot], areas: RoadAreas
) -> tuple[Region, ...]:
    """Divides a chunk into polygons.

    1. The road has its exact border, and plots have their straight sides.
    2. The classes of all other cells are extended under both, vectorised, and simplified together,
       so that neighbours share their border.
    3. Road and plots are subtracted from them.

    The regions of all chunks together cover the map without gaps or overlaps. A plot across chunk
    borders belongs as a whole to the chunk of its centroid.

    Args:
        landuse: Classes and plots of the chunk.
        plots: Plots of the whole map, or all near the chunk.
        areas: Ground of the whole road.
    """
    chunk = landuse.chunk
    box = shapely.box(*chunk.bounds)
    outlines = np.array([shapely.Polygon(plot.polygon) for plot in plots], dtype=object)
    near = shapely.intersects(outlines, box)
    road = areas.in_chunk(chunk)
    paved = shapely.get_parts(road)
    paved = paved[shapely.area(paved) > 0.0]  # cutting leaves lines, which no grid takes
    taken = on_grid(shapely.union_all, [*paved, *outlines[near]])
    kinds, land = _vectorise(chunk, _around_plots(landuse))
    free = on_grid(shapely.difference, land, taken)
    rest = [
        Region(part, LanduseClass(kind))
        for kind, piece in zip(kinds, free, strict=True)
        for part in _polygons(piece)
    ]
    within = shapely.intersects_xy(box, shapely.get_coordinates(shapely.centroid(outlines)))
    inside = [
        Region(shapely.orient_polygons(outline), plot.landuse, plot)
        for outline, plot, is_own in zip(outlines, plots, within, strict=True)
        if is_own
    ]
    return (*inside, *(Region(part, LanduseClass.ROAD) for part in _polygons(road)), *rest)


def _around_plots(landuse: LanduseMap) -> ByteArray:
    """Classes beside road and plots, extended under them, 255 x 255."""
    covered = (landuse.plots > 0) | (landuse.classes == LanduseClass.ROAD)
    if covered.all():
        return np.full(covered.shape, LanduseClass.GRASS, dtype=np.uint8)
    row, column = distance_transform_edt(covered, return_distances=False, return_indices=True)
    around: ByteArray = landuse.classes[row, column]
    return around


def _vectorise(chunk: Chunk, classes: ByteArray) -> tuple[list[int], np.ndarray]:
    """Class and polygon of each connected area."""
    x, y = chunk.origin
    transform = Affine(CELL_SIZE, 0.0, x, 0.0, CELL_SIZE, y)
    regions = list(shapes(classes, transform=transform))
    areas = np.array([shapely.geometry.shape(area) for area, _ in regions], dtype=object)
    simple = shapely.coverage_simplify(areas, TOLERANCE, simplify_boundary=False)
    return [int(kind) for _, kind in regions], simple


def _polygons(shape: shapely.Geometry) -> list[shapely.Polygon]:
    """Polygons of a shape without tongues between almost touching lines."""
    if shape.geom_type == "GeometryCollection":  # overlays may refuse lines beside polygons
        parts = shapely.get_parts(shape)
        shape = shapely.multipolygons(parts[shapely.area(parts) > 0.0])
    core = shapely.buffer(shape, -THINNEST / 2, join_style="mitre")
    sound = shapely.intersection(shape, mitred(core, THINNEST))
    return [
        shapely.orient_polygons(part)
        for part in shapely.get_parts(sound)
        if part.geom_type == "Polygon" and 2 * part.area > THINNEST * part.length
    ]

"""Measures the blocks of a place: the faces between streets, what stands on them, open fronts.

Real and generated places are measured alike, from footprints and streets alone. What a figure
means:

1. A block is a face that carriageways enclose, of at least `LEAST_BLOCK`.
2. Its built share is the share of its land under buildings, sheds and garages included.
3. Its core is the land farther than `ROW` from all carriageways; the core's built share tells back
   buildings and second rows from gardens.
4. Every `STEP` along both sides of every street, a view goes out at right angles. The front is open
   there if it meets no main building within `VIEW` of the carriageway. Views that meet another
   carriageway first do not count: they look along a corner or over a median strip.
"""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.place import Place, Shapes
from envgen_usd.places.building_figures import main_buildings, street_edges

LEAST_BLOCK = 1500.0
"""Least area of a block, m²; a larger value leaves out more small blocks."""
ROW = 25.0
"""Depth of the land at a carriageway, metres; a larger value leaves smaller cores."""
LEAST_CORE = 400.0
"""Least area of a core, m²; a larger value leaves out more blocks without a second row."""
STEP = 2.0
"""Distance between views along a street, metres."""
VIEW = 25.0
"""Length of a view from the carriageway, metres; a larger value finds fewer open fronts."""
_OUTSIDE = 0.05
"""Distance of a view's start from its carriageway, metres."""


@dataclass(frozen=True)
class BlockFigures:
    """Figures of the blocks and street fronts of a place.

    Attributes:
        blocks: B polygons, without the carriageways.
        built: B, share of each block under buildings.
        core_built: B, share of each block's core under buildings; NaN without a core.
        is_open: V, true for views from a carriageway that meet no main building.
    """

    blocks: Shapes
    built: FloatArray
    core_built: FloatArray
    is_open: BoolArray


def measure_blocks(place: Place) -> BlockFigures:
    """Measures the blocks and street fronts of a place."""
    edges, widths = street_edges(place.streets)
    paved = shapely.buffer(edges, widths / 2.0)
    blocks = _blocks(paved)
    houses = place.houses
    cores = _without(blocks, shapely.buffer(edges, widths / 2.0 + ROW))
    core_built = _built(cores, houses.footprints)
    core_built[shapely.area(cores) < LEAST_CORE] = np.nan
    return BlockFigures(
        blocks,
        _built(blocks, houses.footprints),
        core_built,
        _open_views(edges, widths, paved, main_buildings(houses).footprints),
    )


def _blocks(paved: Shapes) -> Shapes:
    """Holes of the carriageways' union."""
    roads = shapely.get_parts(shapely.union_all(paved))
    rings = [ring for road in roads for ring in shapely.get_rings(road)[1:]]
    faces = np.array([shapely.Polygon(ring) for ring in rings], object)
    blocks: Shapes = faces[shapely.area(faces) >= LEAST_BLOCK]
    return blocks


def _without(blocks: Shapes, margins: Shapes) -> Shapes:
    """Each block without the margins that reach into it."""
    cores = blocks.copy()
    block, margin = shapely.STRtree(margins).query(blocks, "intersects")
    for number in np.unique(block).tolist():
        taken = shapely.union_all(margins[margin[block == number]])
        cores[number] = shapely.difference(blocks[number], taken)
    return cores


def _built(areas: Shapes, footprints: Shapes) -> FloatArray:
    """Share of each area under footprints, which do not overlap but for errors of a map."""
    covered = np.zeros(len(areas))
    area, house = shapely.STRtree(footprints).query(areas, "intersects")
    for number in np.unique(area).tolist():
        on = shapely.union_all(shapely.make_valid(footprints[house[area == number]]))
        covered[number] = shapely.area(shapely.intersection(areas[number], on))
    shares: FloatArray = covered / np.maximum(shapely.area(areas), 1e-9)
    return shares


def _open_views(edges: Shapes, widths: FloatArray, paved: Shapes, houses: Shapes) -> BoolArray:
    """See rule 4."""
    starts, outwards, street = _views(edges, widths)
    ends = starts + VIEW * outwards
    views = shapely.linestrings(np.stack([starts, ends], axis=1))
    to_house = _first_hits(views, starts, houses, np.full(len(street), -1))
    to_street = _first_hits(views, starts, paved, street)
    counts = (to_street > to_house) | ~np.isfinite(to_street)
    is_open: BoolArray = ~np.isfinite(to_house[counts])
    return is_open


def _views(edges: Shapes, widths: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Starts (V x 2), unit directions (V x 2) and streets (V) of all views."""
    places, directions, streets = [np.empty((0, 2))], [np.empty((0, 2))], [np.empty(0, np.int64)]
    for number, (edge, width) in enumerate(zip(edges, widths.tolist(), strict=True)):
        at = np.arange(STEP / 2.0, shapely.length(edge), STEP)
        here, before, after = (
            shapely.get_coordinates(shapely.line_interpolate_point(edge, at + shift))
            for shift in (0.0, -0.25, 0.25)
        )
        along = after - before
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
        left = np.stack([-along[:, 1], along[:, 0]], axis=1)
        for normal in (left, -left):
            places.append(here + (width / 2.0 + _OUTSIDE) * normal)
            directions.append(normal)
            streets.append(np.full(len(at), number))
    return np.concatenate(places), np.concatenate(directions), np.concatenate(streets)


def _first_hits(views: Shapes, starts: FloatArray, shapes: Shapes, own: FloatArray) -> FloatArray:
    """Distance from the start of each view to the first shape on it but its own; else infinite."""
    away = np.full(len(views), np.inf)
    view, shape = shapely.STRtree(shapes).query(views, "intersects")
    other = own[view] != shape
    view, shape = view[other], shape[other]
    on = shapely.intersection(views[view], shapes[shape])
    np.minimum.at(away, view, shapely.distance(shapely.points(starts[view]), on))
    return away

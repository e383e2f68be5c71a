"""Measures what stands along the streets of a place: trees, lights, enclosures, widths."""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.place import Place, Shapes
from envgen_usd.places.building_figures import street_edges

BESIDE = 6.0
"""Farthest tree or light of a street from its carriageway, metres."""
LONGEST = 80.0
"""Longest distance between neighbours in a row, metres."""
_PLOT = 12.0
"""Farthest enclosure of a building's plot from its walls, metres."""
_LEAST_FENCE = 6.0
"""Least length of an enclosure, metres."""


@dataclass(frozen=True)
class StreetFigures:
    """Figures of streets.

    Attributes:
        tree_spacing: Metres between neighbouring trees on the same side of a street.
        lamp_spacing: Metres between neighbouring lights on the same side.
        enclosures: Kind of the enclosure of each building with one.
        lane_width: Width of a lane where width and lanes of the street are stated, metres.
        sidewalk_width: Stated widths of sidewalks, metres.
    """

    tree_spacing: FloatArray
    lamp_spacing: FloatArray
    enclosures: tuple[str, ...]
    lane_width: FloatArray
    sidewalk_width: FloatArray


def measure_streets(place: Place) -> StreetFigures:
    """Measures the streets of a place."""
    edges, widths = street_edges(place.streets)
    streets = place.streets
    stated = streets.tagged & np.isfinite(streets.lanes)
    walks = streets.sidewalks[np.isfinite(streets.sidewalks) & (streets.sidewalks > 0.0)]
    return StreetFigures(
        _spacing(place.trees, edges, widths),
        _spacing(place.lamps, edges, widths),
        _enclosures(place),
        streets.widths[stated] / streets.lanes[stated],
        walks,
    )


def _spacing(points: FloatArray, edges: Shapes, widths: FloatArray) -> FloatArray:
    """Distances of neighbours along the sides of streets, metres."""
    if len(points) < 2 or not len(edges):
        return np.empty(0)
    places = shapely.points(points)
    edge = shapely.STRtree(edges).nearest(places)
    away = shapely.distance(places, edges[edge]) - widths[edge] / 2.0
    near = away <= BESIDE
    places, edge = places[near], edge[near]
    s = shapely.line_locate_point(edges[edge], places)
    foot = shapely.get_coordinates(shapely.line_interpolate_point(edges[edge], s))
    ahead = shapely.get_coordinates(shapely.line_interpolate_point(edges[edge], s + 0.5))
    behind = shapely.get_coordinates(
        shapely.line_interpolate_point(edges[edge], np.maximum(s - 0.5, 0.0))
    )
    along, to = ahead - behind, points[near] - foot
    side = np.sign(along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0])
    order = np.lexsort((s, side, edge))
    same = (np.diff(edge[order]) == 0) & (np.diff(side[order]) == 0)
    steps: FloatArray = np.diff(s[order])[same]
    return steps[(steps > 1.0) & (steps <= LONGEST)]


def _enclosures(place: Place) -> tuple[str, ...]:
    """Kind of the longest enclosure near each building with one."""
    long_enough = shapely.length(place.barriers) >= _LEAST_FENCE
    lines, kinds = place.barriers[long_enough], place.barrier_kinds[long_enough]
    if not len(lines) or not len(place.houses):
        return ()
    land = shapely.buffer(place.houses.footprints, _PLOT)
    house, line = shapely.STRtree(lines).query(land, "intersects")
    length = shapely.length(shapely.intersection(lines[line], land[house]))
    order = np.lexsort((length, house))
    house, line = house[order], line[order]
    last = np.concatenate([np.diff(house) > 0, [True]]) if len(house) else np.empty(0, bool)
    return tuple(kinds[line[last]].tolist())

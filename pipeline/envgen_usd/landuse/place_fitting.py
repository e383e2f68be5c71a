"""Plots of a generated place as polygons: candidate sites without what roads and others take."""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.blocks.land_areas import largest, opened, union, without
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.landuse.site_fitting import BORDER_TOLERANCE
from envgen_usd.models.array_types import BoolArray
from envgen_usd.models.road_surface import RoadSurface

LEAST_SHARE = 0.4
"""Least share of a site that must be free; a larger value drops more plots."""
SLIVER = 3.0
"""Width of land that is no part of a plot, metres."""
_AT_FRONT = 0.5


@dataclass(frozen=True)
class Fitted:
    """Sites with their land.

    Attributes:
        sites: Those that have land.
        shapes: Polygon of each, metres; its sides are straight.
    """

    sites: Sites
    shapes: NDArray[np.object_]


def fit_places(sites: Sites, surface: RoadSurface, verge: float) -> Fitted:
    """Land of the sites, in order of precedence.

    1. The road before the plot is on the ground.
    2. A plot is its site without roads and their verges, land under bridges, and the plots before
       it: the largest part at its front, without slivers.
    3. It is kept if that is enough of the site (`LEAST_SHARE`).

    Args:
        sites: Candidates.
        surface: The whole road.
        verge: Least distance between plots and roads, metres.
    """
    outline = Outline.of(surface)
    wholes = shapely.make_valid(shapely.polygons(sites.polygons()))
    bare = _without_roads(wholes, surface, outline, verge)
    fronts = shapely.linestrings(sites.fronts)
    near: list[list[int]] = [[] for _ in wholes]
    for one, other in shapely.STRtree(wholes).query(wholes, predicate="intersects").T:
        if other < one:
            near[one].append(other)
    shapes = np.full(len(wholes), None, object)
    for number in np.flatnonzero(_at_ground(sites, outline)).tolist():
        taken = [shapes[other] for other in near[number] if shapes[other] is not None]
        free = without(bare[number], union(taken))
        part = _at_front(free, fronts[number])
        if part.area >= LEAST_SHARE * wholes[number].area:
            shapes[number] = part
    kept = np.flatnonzero([shape is not None for shape in shapes])
    return Fitted(sites.take(kept, np.ones(len(kept))), shapes[kept])


def _without_roads(
    wholes: NDArray[np.object_], surface: RoadSurface, outline: Outline, verge: float
) -> NDArray[np.object_]:
    edges = shapely.linestrings(np.stack([outline.start[:, :2], outline.end[:, :2]], axis=1))
    decks = surface.vertices[surface.triangles[surface.triangle_level > 0], :2]
    blocked = np.concatenate(
        [shapely.buffer(edges, verge - 0.05, quad_segs=2), shapely.polygons(decks)]
    )
    bare = wholes.copy()
    hit, what = shapely.STRtree(blocked).query(wholes, predicate="intersects")
    for number in np.unique(hit).tolist():
        bare[number] = without(wholes[number], union(blocked[what[hit == number]]))
    return bare


def _at_ground(sites: Sites, outline: Outline) -> BoolArray:
    """True if the road's outline lies before an end of a plot, or before its middle."""
    border = sites.fronts - sites.before[:, None, None] * sites.normals
    places = np.concatenate([border, border.mean(axis=1, keepdims=True)], axis=1)
    distance, _ = outline.nearest(places.reshape(-1, 2), 2.0 * BORDER_TOLERANCE)
    at_ground: BoolArray = np.any(distance.reshape(-1, 3) <= BORDER_TOLERANCE, axis=1)
    return at_ground


def _at_front(free: shapely.Geometry, front: shapely.LineString) -> shapely.Polygon:
    """The largest part of free land at a plot's front, without slivers; or an empty polygon."""
    parts = shapely.get_parts(opened(free, SLIVER))
    at_front = parts[shapely.distance(parts, front) <= _AT_FRONT]
    return largest(shapely.multipolygons(at_front))

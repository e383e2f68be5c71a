"""Plots of a generated place as polygons: candidate sites cut to what roads and others leave."""

from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.blocks.land_areas import largest, opened, union, without
from envgen_usd.landuse.place_sites import ENTRANCE
from envgen_usd.landuse.plot_rectangles import least_rectangle
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.landuse.site_fitting import BORDER_TOLERANCE
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.land_rules import PlotRules
from envgen_usd.models.road_surface import RoadSurface

LEAST_SHARE = 0.4
"""Least share of a site that its plot covers; a larger value drops more plots."""
SLIVER = 3.0
"""Width of land that is no part of a plot, metres."""
_AT_FRONT = 0.5
_STEP = 0.5
"""Distance of the points by which free land is searched, metres."""


@dataclass(frozen=True)
class Fitted:
    """Sites with their land.

    Attributes:
        sites: Those that have land, cut to it.
        shapes: Polygon of each, metres; its sides are straight, along the street or across it.
    """

    sites: Sites
    shapes: NDArray[np.object_]


def fit_places(sites: Sites, surface: RoadSurface, rules: PlotRules) -> Fitted:
    """Land of the sites, in order of precedence.

    1. The road before the plot is on the ground.
    2. Free is its site without roads and their verges, land under bridges, and the plots before it:
       the largest part at its front, without slivers.
    3. The site is cut to the largest part of that between two sides across the street and a line
       along it. It is kept if that is enough of the site (`LEAST_SHARE`), and wide enough.

    Args:
        sites: Candidates.
        surface: The whole road.
        rules: Least distance between plots and roads, and their least width.
    """
    verge, (least, _) = rules.verge[0], least_rectangle(rules)
    outline = Outline.of(surface)
    wholes = shapely.make_valid(shapely.polygons(sites.polygons()))
    bare = _without_roads(wholes, surface, outline, verge)
    fronts = shapely.linestrings(sites.fronts)
    near: list[list[int]] = [[] for _ in wholes]
    for one, other in shapely.STRtree(wholes).query(wholes, predicate="intersects").T:
        if other < one:
            near[one].append(other)
    shapes = np.full(len(wholes), None, object)
    cuts = np.tile([0.0, 1.0, 1.0], (len(wholes), 1))
    for number in np.flatnonzero(_at_ground(sites, outline)).tolist():
        taken = [shapes[other] for other in near[number] if shapes[other] is not None]
        free = without(bare[number], union(taken))
        part = _at_front(free, fronts[number])
        if part.area < LEAST_SHARE * wholes[number].area:
            continue
        one = sites.take(np.array([number]), np.ones(1))
        cuts[number] = _largest_cut(part, one)
        first, last, depth = cuts[number]
        if (last - first) * shapely.length(fronts[number]) < least or depth == 0.0:
            continue
        # Inside of a bend, the sides of a deep plot cross.
        (whole,) = shapely.make_valid(shapely.polygons(_cut(one, cuts[[number]]).polygons()))
        kept = largest(part.intersection(whole))
        if kept.area >= LEAST_SHARE * wholes[number].area:
            shapes[number] = kept
    left = np.flatnonzero([shape is not None for shape in shapes])
    return Fitted(_cut(sites.take(left, np.ones(len(left))), cuts[left]), shapes[left])


def _largest_cut(free: shapely.Polygon, site: Sites) -> FloatArray:
    """The largest part of a single site on free land, from its front.

    Returns:
        3, first and last place along the front and the depth, as shares of the site's.
    """
    length = shapely.length(shapely.linestrings(site.fronts[0]))
    columns, rows = (max(1, round(size / _STEP)) for size in (length, site.depths[0]))
    along = (np.arange(columns) + 0.5)[:, None, None] / columns
    deep = (np.arange(rows) + 0.5)[None, :, None] / rows * site.depths[0]
    (left, right), (out, other) = site.fronts[0], site.normals[0]
    places = left + along * (right - left) + deep * (out + along * (other - out))
    is_free = shapely.contains_xy(free, places[..., 0], places[..., 1])
    # The front itself may lie half a step in the verge of a bent road.
    is_free[:, 0] = True
    reach = np.cumprod(is_free, axis=1).sum(axis=1)
    best, cut = 0.0, np.array([0.0, 1.0, 0.0])
    for first in range(columns):
        areas = np.minimum.accumulate(reach[first:]) * np.arange(1, columns - first + 1)
        last = int(areas.argmax())
        if areas[last] > best:
            best = areas[last]
            depth = reach[first : first + last + 1].min() / rows
            cut = np.array([first / columns, (first + last + 1) / columns, depth])
    return cut


def _cut(sites: Sites, cuts: FloatArray) -> Sites:
    """Sites cut to parts of their fronts and depths, P x 3 as of `_largest_cut`."""
    shares = cuts[:, :2, None]
    fronts, normals = (
        ends[:, :1] + shares * (ends[:, 1:] - ends[:, :1]) for ends in (sites.fronts, sites.normals)
    )
    widths = np.maximum(cuts[:, 1] - cuts[:, 0], 1e-9)
    entrances = np.clip((sites.entrances - cuts[:, 0]) / widths, *ENTRANCE)
    return replace(
        sites,
        fronts=fronts,
        normals=normals,
        depths=sites.depths * cuts[:, 2],
        entrances=entrances,
    )


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

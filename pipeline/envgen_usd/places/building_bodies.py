"""Buildings of a map as bodies that share no space: parts instead of the outlines they cover."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.grid_overlay import mitred
from envgen_usd.models.place import BuildingParts, Houses, Place, Shapes

_SLIVER = 0.5
"""Half the width of strips of an outline beside its parts that are left out, metres."""
_LEAST_AREA = 6.0
"""Area of the smallest rest of an outline, m²."""
_LEAST_HEIGHT = 0.5
"""Height of the lowest body, metres."""
_ON_TOP = 0.9
"""Share of a part on a lower one from which it stands on its roof, and not beside it."""
_TOUCH = 0.05
"""Shared area of two parts that only touch, m²; that of borders drawn twice."""


def with_bodies(place: Place) -> Place:
    """The place with bodies for houses.

    1. An outline keeps the ground that its parts do not cover; strips narrower than 1 m go. Parts
       that begin above its height stand on it. A rest of unknown height is as high as its lowest
       part.
    2. A part within a lower one with a flat roof stands on that roof.
    3. Of other parts that share space, the higher one has it.
    """
    parts = place.parts
    if parts is None:
        return place
    rest = _beside_parts(place.houses, parts)
    # Each part without an outline is a building of its own.
    groups = np.where(parts.outlines >= 0, parts.outlines, -1)
    bodies, lost = _apart(replace(parts.bodies, groups=groups))
    issues = (*place.issues, *_issues(place, parts, len(bodies), lost))
    return replace(place, houses=rest.joined(bodies), parts=None, issues=issues)


def _beside_parts(houses: Houses, parts: BuildingParts) -> Houses:
    """The outlines without what their parts cover."""
    covered: dict[int, list[shapely.Geometry]] = defaultdict(list)
    tops, bottoms = houses.vertical_range()[:, 1], parts.bodies.bottoms
    for number, outline in enumerate(parts.outlines.tolist()):
        if outline >= 0 and bottoms[number] < tops[outline]:
            covered[outline].append(parts.bodies.footprints[number])
    numbers, shapes = [], []
    for number, shape in enumerate(houses.footprints.tolist()):
        pieces = [shape]
        if number in covered:
            pieces = list(_pieces(shapely.difference(shape, shapely.union_all(covered[number]))))
        numbers += [number] * len(pieces)
        shapes += pieces
    order = np.array(numbers, int)
    groups = np.where(np.isin(order, parts.outlines), order, -1)
    lowest = np.full(len(houses), np.inf)
    chosen = parts.outlines >= 0
    np.fmin.at(lowest, parts.outlines[chosen], parts.bodies.heights[chosen])
    low = np.where(np.isfinite(lowest), lowest, np.nan)[order]
    rest = houses.take(order)
    unknown = np.isnan(rest.heights) & np.isnan(rest.storeys)
    heights = np.where(unknown & (groups >= 0), low, rest.heights)
    return replace(rest, footprints=_array(shapes), groups=groups, heights=heights)


def _pieces(shape: shapely.Geometry) -> Iterator[shapely.Polygon]:
    wide = mitred(shapely.buffer(shape, -_SLIVER, join_style="mitre"), _SLIVER)
    for piece in shapely.get_parts(shapely.intersection(wide, shape)):
        if piece.geom_type == "Polygon" and piece.area > _LEAST_AREA:
            yield piece


def _apart(bodies: Houses) -> tuple[Houses, int]:
    """Bodies of which no two share space, and how many parts have no space left."""
    shapes, bottoms = bodies.footprints.copy(), bodies.bottoms.copy()
    storeys = bodies.storeys.copy()
    tops = bodies.vertical_range()[:, 1]
    standing = tops - bottoms >= _LEAST_HEIGHT
    order = np.argsort(tops, kind="stable")
    rank = np.empty(len(order), int)
    rank[order] = np.arange(len(order))
    tree = shapely.STRtree(bodies.footprints)
    for high in order[standing[order]].tolist():
        near = tree.query(bodies.footprints[high], predicate="intersects")
        lower = near[(rank[near] < rank[high]) & standing[near]]
        for low in lower[np.argsort(rank[lower])].tolist():
            shared = shapely.area(shapely.intersection(shapes[low], shapes[high]))
            is_apart = tops[low] <= bottoms[high] or tops[high] <= bottoms[low]
            if is_apart or shared <= _TOUCH:
                continue
            on_top = shared >= _ON_TOP * shapely.area(shapes[high]) and tops[high] < np.inf
            if on_top and bodies.roofs[low] == "flat":
                share = (tops[high] - tops[low]) / (tops[high] - bottoms[high])
                storeys[high] = np.fmax(np.round(storeys[high] * share), 1.0)
                bottoms[high] = tops[low]
                standing[high] = tops[high] - bottoms[high] >= _LEAST_HEIGHT
            else:
                shapes[low] = shapely.difference(shapes[low], shapes[high])
                standing[low] = shapely.area(shapes[low]) > 0.0
    apart = replace(bodies, footprints=shapes, bottoms=bottoms, storeys=storeys)
    return apart.take(standing), int((~standing).sum())


def _array(shapes: Sequence[shapely.Geometry]) -> Shapes:
    found = np.empty(len(shapes), object)
    found[:] = shapes
    return found


def _issues(place: Place, parts: BuildingParts, built: int, lost: int) -> Iterator[Issue]:
    replaced = len(set(parts.outlines.tolist()) - {-1})
    text = f"{built} parts of buildings stand instead of {replaced} outlines where they cover them"
    yield Issue("osm.building_parts", Severity.INFO, place.source, text, "used")
    if lost:
        text = f"{lost} parts of buildings lie within others, or end below where they begin"
        yield Issue("osm.building_part", Severity.INFO, place.source, text, "left out")

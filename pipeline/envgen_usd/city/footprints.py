"""Footprints of features in plan."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import shapely

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.polygon_arrays import Polygons

_LEAST_AREA = 1e-6
"""Least area of a face in plan, m²; smaller faces are vertical."""
_LEAST_REACH = 0.15
"""Least half length and width of a feature, metres; a larger value keeps more distance."""


class Footprints:
    """Footprints of objects, with a spatial index."""

    def __init__(self, shapes: Sequence[shapely.Geometry]) -> None:
        """Takes the shapes, which may be empty."""
        self.shapes = tuple(shapes)
        self._tree = shapely.STRtree(self.shapes)

    def near(self, points: FloatArray, distance: float) -> BoolArray:
        """Returns a mask of the points (N x 2) on a shape or within a distance of a shape, N."""
        hit = np.zeros(len(points), dtype=bool)
        hits = self._tree.query(
            shapely.points(points[:, :2]), predicate="dwithin", distance=distance
        )
        hit[hits[0]] = True
        return hit

    def touches(self, polygon: shapely.Polygon) -> bool:
        """Returns true if a polygon intersects a shape."""
        return bool(len(self._tree.query(polygon, predicate="intersects")))

    def grown(self, polygon: shapely.Polygon, distance: float) -> list[shapely.Geometry]:
        """Returns the shapes that touch a polygon, buffered by a distance in metres."""
        near = self._tree.query(polygon.buffer(distance), predicate="intersects")
        return [self.shapes[i].buffer(distance, join_style="mitre") for i in near.tolist()]

    def joined(self, features: Iterable[CityObject]) -> "Footprints":
        """Returns these shapes and the footprints of features."""
        return Footprints([*self.shapes, *(footprint_of(feature) for feature in features)])


def footprint_of(feature: CityObject) -> shapely.Geometry:
    """Returns the ground that a feature and its parts cover or overhang.

    Args:
        feature: Feature with polygons, or with a placement, which covers the rectangle of its
            size.

    Returns:
        A polygon or several, road frame; empty for a feature without geometry.
    """
    faces = [face for part in feature.walk() for face in _faces(part)]
    feet = [
        _foot(part.kind, part.placement) for part in feature.walk() if part.placement is not None
    ]
    return shapely.union_all([*faces, *feet])


def _foot(kind: str, placement: Placement) -> shapely.Geometry:
    if kind == "SolitaryVegetationObject":
        # A crown may reach over a wall; the trunk must not stand in it.
        return shapely.Point(placement.position[:2]).buffer(_LEAST_REACH)
    x, y = np.maximum(placement.size[:2] / 2, _LEAST_REACH).tolist()
    cos, sin = np.cos(placement.heading), np.sin(placement.heading)
    corners = np.array([[-x, -y], [x, -y], [x, y], [-x, y]]) @ np.array([[cos, sin], [-sin, cos]])
    return shapely.Polygon(placement.position[:2] + corners)


def _faces(part: CityObject) -> Iterator[shapely.Geometry]:
    """Faces of a part in plan, without vertical faces and what lies behind a wall's surface."""
    outside = (each for each in part.surfaces if each.attributes.get("part") != "reveal")
    shapes: Iterable[Polygons] = (
        *part.geometry.values(),
        *(surface.polygons for surface in outside),
    )
    rings = [ring for polygons in shapes for ring in _outer_rings(polygons)]
    if not rings:
        return
    sizes = np.array([len(ring) for ring in rings])
    plan = np.concatenate(rings)
    starts = np.cumsum(sizes) - sizes
    # Twice the area of a ring by its corners from its first corner, which loses no digits.
    x, y = (plan - np.repeat(plan[starts], sizes, axis=0)).T
    after = np.arange(len(plan)) + 1
    after[starts + sizes - 1] = starts
    double = np.add.reduceat(x * y[after] - x[after] * y, starts)
    chosen = np.abs(double) > 2.0 * _LEAST_AREA
    if not chosen.any():
        return
    owner = np.repeat(np.arange(int(chosen.sum())), sizes[chosen])
    corners = plan[np.repeat(chosen, sizes)]
    faces = shapely.polygons(shapely.linearrings(corners, indices=owner))
    yield from np.where(shapely.is_valid(faces), faces, shapely.make_valid(faces))


def _outer_rings(polygons: Polygons) -> Iterator[FloatArray]:
    """Outer ring of each polygon in plan, N x 2."""
    for first in polygons.polygon_offsets[:-1].tolist():
        start, end = polygons.ring_offsets[first : first + 2].tolist()
        if end - start > 2:
            yield polygons.points[start:end, :2]

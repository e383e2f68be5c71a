"""The ground that features cover, in plan."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import shapely

from envgen_usd.geometry.collections import spans
from envgen_usd.models.arrays import BoolArray, FloatArray
from envgen_usd.models.city import CityObject
from envgen_usd.models.polygons import Polygons

_LEAST_AREA = 1e-6
"""Square metres; what is smaller in plan stands upright."""
_LEAST_REACH = 0.15
"""Metres around the foot of a feature whose size is not known."""


class Footprints:
    """What stands somewhere, in plan, with an index for fast questions."""

    def __init__(self, shapes: Sequence[shapely.Geometry]) -> None:
        """Takes the shapes, of which any may be empty."""
        self.shapes = tuple(shapes)
        self._tree = shapely.STRtree(self.shapes)

    def near(self, points: FloatArray, distance: float) -> BoolArray:
        """Returns which of N x 2 points lie on a shape or within a distance of one, N."""
        found = np.zeros(len(points), dtype=bool)
        hits = self._tree.query(
            shapely.points(points[:, :2]), predicate="dwithin", distance=distance
        )
        found[hits[0]] = True
        return found

    def touches(self, polygon: shapely.Polygon) -> bool:
        """Returns whether a polygon has a place in common with a shape."""
        return bool(len(self._tree.query(polygon, predicate="intersects")))

    def grown(self, polygon: shapely.Polygon, distance: float) -> list[shapely.Geometry]:
        """Returns the shapes that touch a polygon, grown by a distance in metres."""
        near = self._tree.query(polygon.buffer(distance), predicate="intersects")
        return [self.shapes[i].buffer(distance, join_style="mitre") for i in near.tolist()]

    def joined(self, features: Iterable[CityObject]) -> "Footprints":
        """Returns these shapes and the footprints of features."""
        return Footprints([*self.shapes, *(footprint_of(feature) for feature in features)])


def footprint_of(feature: CityObject) -> shapely.Geometry:
    """Returns the ground that a feature and its parts cover or overhang.

    Args:
        feature: With polygons, or a placement, which covers a disc of its largest extent.

    Returns:
        A polygon or several, road frame; empty for a feature without any geometry.
    """
    faces = [face for part in feature.walk() for face in _faces(part)]
    feet = [_foot(part) for part in feature.walk() if part.placement is not None]
    return shapely.union_all([*faces, *feet])


def _foot(part: CityObject) -> shapely.Geometry:
    assert part.placement is not None
    reach = max(float(part.placement.size[:2].max()) / 2, _LEAST_REACH)
    # A crown may reach over a wall; the trunk may not stand in it.
    plant = part.kind == "SolitaryVegetationObject"
    return shapely.Point(part.placement.position[:2]).buffer(_LEAST_REACH if plant else reach)


def _faces(part: CityObject) -> Iterator[shapely.Geometry]:
    """Faces of a part that do not stand upright, in plan."""
    shapes: Iterable[Polygons] = (
        *part.geometry.values(),
        *(surface.polygons for surface in part.surfaces),
    )
    for polygons in shapes:
        if len(polygons):
            first = polygons.polygon_offsets[:-1]
            starts, sizes = polygons.ring_offsets[first], np.diff(polygons.ring_offsets)[first]
            owner = np.repeat(np.arange(len(sizes)), sizes)
            plan = polygons.points[spans(starts, sizes), :2]
            faces = shapely.polygons(shapely.linearrings(plan, indices=owner))
            faces = faces[shapely.area(faces) > _LEAST_AREA]
            yield from np.where(shapely.is_valid(faces), faces, shapely.make_valid(faces))

"""Coordinates of given buildings that no building has."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import CityObject, ThematicSurface

LARGEST = 20_000.0
"""Largest extent of a building, and its largest height above or below the road frame's 0, metres.

The reader of roads has the same bound on elevations.
"""


def extent_fault(building: CityObject) -> str:
    """Says what is wrong with the coordinates of a building and its parts; empty if plausible."""
    groups = [group for part in building.walk() for group in _points(part)]
    points = np.concatenate(groups) if groups else np.empty((0, 3))
    if not np.isfinite(points).all():
        return "its coordinates are not finite"
    if not len(points):
        return ""
    height = points[np.abs(points[:, 2]).argmax(), 2]
    if abs(height) > LARGEST:
        return f"it has a height of {height:g} m; the limit is {LARGEST:g} m"
    extent = np.ptp(points, axis=0).max()
    return f"it extends over {extent:g} m; the limit is {LARGEST:g} m" if extent > LARGEST else ""


def _points(part: CityObject) -> Iterator[FloatArray]:
    """Points of a part without its children, each N x 3."""
    for surface in part.surfaces:
        yield from _surface_points(surface)
    for polygons in part.geometry.values():
        yield polygons.points
    for lines in part.curves.values():
        yield from lines
    if part.placement is not None:
        yield part.placement.position.reshape(1, 3)


def _surface_points(surface: ThematicSurface) -> Iterator[FloatArray]:
    yield surface.polygons.points
    for opening in surface.openings:
        yield from _surface_points(opening)

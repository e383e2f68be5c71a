"""Faults of rings: points and self-intersections (codes 101, 102, 104)."""

import numpy as np
import shapely

from envgen_usd.geometry.flat_arrays import spans
from envgen_usd.geometry.iso19107.coincident_points import places
from envgen_usd.geometry.iso19107.fault_codes import SNAP, Fault
from envgen_usd.geometry.polygon_planes import (
    flat_coordinates,
    next_in_ring,
    polygon_of_ring,
    ring_areas,
)
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons

_LEAST_AREA = SNAP * SNAP / 4
"""Square metres; half the area of the smallest triangle with distinct corners."""


def ring_faults(polygons: Polygons) -> list[Fault]:
    """Returns the faults of the rings of polygons, each ring by itself."""
    owner = polygon_of_ring(polygons)
    sizes = np.diff(polygons.ring_offsets)
    repeats = np.zeros(len(owner), dtype=np.int64)
    np.add.at(repeats, np.repeat(np.arange(len(owner)), sizes), repeated_points(polygons))
    few = sizes - repeats < 3
    crossing = np.zeros(len(owner), dtype=bool)
    crossing[~few] = ~_simple(polygons, np.flatnonzero(~few))
    codes = ((101, few), (102, repeats > 0), (104, crossing))
    return [
        Fault(code, int(owner[ring]), detail=f"ring {ring - polygons.polygon_offsets[owner[ring]]}")
        for code, wrong in codes
        for ring in np.flatnonzero(wrong)
    ]


def repeated_points(polygons: Polygons) -> BoolArray:
    """Returns whether each point (N) coincides with the next point of its ring."""
    place = places(polygons.points)
    same: BoolArray = place == place[next_in_ring(polygons.ring_offsets)]
    return same


def _simple(polygons: Polygons, rings: IntArray) -> BoolArray:
    """Returns whether rings of at least three points are simple and have an area."""
    sizes = np.diff(polygons.ring_offsets)[rings]
    flat = flat_coordinates(polygons)[spans(polygons.ring_offsets[rings], sizes)]
    shapes = shapely.linearrings(flat, indices=np.repeat(np.arange(len(rings)), sizes))
    areas: FloatArray = np.linalg.norm(
        ring_areas(polygons.points, polygons.ring_offsets)[rings], axis=1
    )
    simple: BoolArray = shapely.is_simple(shapes) & (areas > _LEAST_AREA)
    return simple

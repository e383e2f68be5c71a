"""Triangles of a surface as few polygons."""

import numpy as np
import pytest

from envgen_usd.city.roads.patch_polygons import patch_polygons
from envgen_usd.geometry.iso19107.polygon_faults import polygon_faults
from envgen_usd.geometry.polygon_planes import ring_areas


def area(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def covered(polygons):
    """Area of polygons without their holes, which run the other way around."""
    rings = ring_areas(polygons.points, polygons.ring_offsets)
    sums = np.add.reduceat(rings, polygons.polygon_offsets[:-1])
    return np.linalg.norm(sums, axis=1).sum()


def test_a_flat_piece_is_one_polygon_with_its_hole():
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0))
    vertices = np.column_stack([x.ravel(), y.ravel(), 0.5 * x.ravel()])
    cells = [(r, c) for r in range(3) for c in range(3) if (r, c) != (1, 1)]
    first = np.array([4 * r + c for r, c in cells])
    triangles = np.concatenate(
        [np.c_[first, first + 1, first + 5], np.c_[first, first + 5, first + 4]]
    )
    made = patch_polygons(vertices, triangles)
    assert len(made) == 1
    assert np.diff(made.ring_offsets).tolist() == [12, 4]
    assert covered(made) == pytest.approx(area(vertices, triangles))


def test_vertices_that_almost_touch_tilt_no_polygon():
    """A mark on a tilted road, snapped to millimetres: two of its vertices are 1 mm apart."""
    vertices = np.array(
        [
            [0.813, 15.608, 16.330],
            [0.884, 15.661, 16.282],
            [0.884, 16.124, 16.791],
            [0.884, 16.139, 16.806],
            [0.813, 16.088, 16.856],
            [0.813, 16.073, 16.840],
            [0.813, 16.072, 16.840],
        ]
    )
    triangles = np.array([[0, 1, 2], [0, 2, 6], [6, 2, 5], [2, 3, 5], [5, 3, 4]])
    made = patch_polygons(vertices, triangles)
    assert polygon_faults(made) == []
    assert covered(made) == pytest.approx(area(vertices, triangles))
    assert {tuple(p) for p in made.points} == {tuple(p) for p in vertices}

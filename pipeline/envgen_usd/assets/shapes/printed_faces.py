"""Meshes of flat faces that show a cell of an atlas."""

import numpy as np
import shapely

from envgen_usd.assets.polygon_mesh import Mesh
from envgen_usd.assets.shapes.simple_solids import flat
from envgen_usd.models.array_types import FloatArray


def face_mesh(area: shapely.Polygon, size: tuple[float, float], cell: FloatArray, x: float) -> Mesh:
    """A face that looks towards +x.

    Args:
        area: Its outline about the middle of its box (y, z), metres.
        size: Width and height of its box, metres.
        cell: 2 x 2, texture coordinates of the box in the atlas, see `sign_atlas.cell_box`.
        x: Its place, metres.
    """
    triangles = face_triangles(area)
    place = triangles.reshape(-1, 2)
    mesh = flat(
        np.c_[np.full(len(place), x), place],
        np.full(len(triangles), 3),
        np.arange(len(place)),
    )
    uv = cell[0] + (place / np.array(size) + 0.5) * (cell[1] - cell[0])
    return Mesh(mesh.points, mesh.face_sizes, mesh.face_vertices, mesh.normals, uv)


def face_triangles(area: shapely.Polygon) -> FloatArray:
    """T x 3 x 2, counter-clockwise."""
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
    corners = shapely.get_coordinates(shapely.orient_polygons(pieces)).reshape(-1, 4, 2)
    return np.asarray(corners[:, :3], dtype=np.float64)

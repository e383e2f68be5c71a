"""Skins of simple shapes: turned bodies, and flat areas within outlines."""

from collections.abc import Sequence

import numpy as np
import shapely

from envgen_usd.assets.polygon_mesh import Mesh
from envgen_usd.assets.vehicles.body_shell import Skin, grid_skin, skin_mesh, skin_of, smoothed
from envgen_usd.models.array_types import FloatArray


def revolved(profile: FloatArray, sides: int, sharp: float = 40.0) -> Mesh:
    """A body turned about the y axis.

    Args:
        profile: N x 2, (radius, y), so that the outside lies to the right of the way; metres.
        sides: Corners of its cross-section.
        sharp: Angle in degrees at which the outline has an edge.
    """
    angle = np.linspace(0.0, 2 * np.pi, sides + 1)
    angle[-1] = 0.0
    circle = np.stack([np.cos(angle), np.zeros(sides + 1), np.sin(angle)], axis=1)
    radius = np.maximum(profile[:, 0], 0.0)[:, None, None]
    places = circle * radius + profile[:, 1, None, None] * np.array([0.0, 1.0, 0.0])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    turns = np.linspace(0.0, 2 * np.pi, sides + 1) * profile[:, 0].max()
    params = np.stack(np.meshgrid(turns, way), axis=-1)
    (skin,) = smoothed([grid_skin(places, params)], sharp, half=False)
    return skin_mesh(skin)


def filled(rings: Sequence[FloatArray], normal: FloatArray) -> Skin:
    """A flat skin within segments that close up.

    Args:
        rings: Starts and ends of the segments, E x 3 each, in a plane; metres.
        normal: Direction (3) that the skin faces, one of the axes.
    """
    starts, ends = rings
    axis = int(np.abs(normal).argmax())
    first, second = (axis + 1) % 3, (axis + 2) % 3
    lines = shapely.linestrings(np.stack([starts, ends], axis=1)[..., [first, second]])
    areas = shapely.get_parts(shapely.polygonize(lines))
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(areas))
    flat = shapely.get_coordinates(shapely.orient_polygons(pieces)).reshape(-1, 4, 2)[:, :3]
    if normal[axis] < 0:
        flat = flat[:, ::-1]
    places = np.empty((len(flat), 3, 3))
    places[..., axis] = starts[0, axis]
    places[..., first], places[..., second] = flat[..., 0], flat[..., 1]
    return skin_of(places, flat)

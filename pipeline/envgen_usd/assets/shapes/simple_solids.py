"""Simple solids with flat or round normals and texture coordinates in metres."""

from dataclasses import replace

import numpy as np

from envgen_usd.assets.polygon_mesh import Mesh, flat_normals, merge, normalised, welded
from envgen_usd.models.array_types import FloatArray, IntArray

_ROUND = 0.8
"""Cosine of the angle below which lathed surfaces meet in a curve; a larger value cuts edges."""
_BOX_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)


def flat(points: FloatArray, sizes: IntArray, corners: IntArray) -> Mesh:
    """A faceted mesh; its texture coordinates are metres in each face's plane."""
    normals = flat_normals(points, sizes, corners)
    across = np.where(np.abs(normals[:, 2:]) > 0.9, [1.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    level = np.stack([-normals[:, 1], normals[:, 0], np.zeros(len(normals))], axis=1)
    along = normalised(np.where(across.any(axis=1, keepdims=True), across, level))
    up = np.cross(normals, along)
    place = points[corners]
    uv = np.stack([(place * along).sum(axis=1), (place * up).sum(axis=1)], axis=1)
    return Mesh(points, sizes, corners, normals, uv)


def box(low: FloatArray | tuple[float, ...], high: FloatArray | tuple[float, ...]) -> Mesh:
    """An axis-aligned box between two corners (3 each)."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    base = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    points = np.concatenate([np.c_[base, np.full(4, z0)], np.c_[base, np.full(4, z1)]])
    return flat(points, np.full(6, 4), _BOX_FACES.reshape(-1))


def raised(
    low: FloatArray | tuple[float, ...],
    high: FloatArray | tuple[float, ...],
    slope: tuple[float, float],
) -> Mesh:
    """A field that rises towards +y with sloping sides, as panels of doors do.

    Args:
        low: Lower corner of its foot (3).
        high: Upper corner (3); y is that of its face.
        slope: Distance along x and z from the edge of the foot to that of the face.
    """
    (x0, y0, z0), (x1, y1, z1), (a, c) = low, high, slope
    foot = np.array([[x0, y0, z0], [x1, y0, z0], [x1, y0, z1], [x0, y0, z1]])
    face = foot + np.array([[a, y1 - y0, c], [-a, y1 - y0, c], [-a, y1 - y0, -c], [a, y1 - y0, -c]])
    sides = np.array([[0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0], [4, 7, 6, 5]])
    return flat(np.concatenate([foot, face]), np.full(5, 4), sides.reshape(-1))


def tube(path: FloatArray, radius: FloatArray, sides: int, *, caps: bool = True) -> Mesh:
    """A round bar along a path.

    Args:
        path: N x 3, metres; consecutive points differ.
        radius: N, metres.
        sides: Number of corners of its cross-section.
        caps: Close both ends.
    """
    frames = _frames(path)
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    spokes = (
        np.cos(angle)[:, None] * frames[:, None, 0] + np.sin(angle)[:, None] * frames[:, None, 1]
    )
    return _around(path, spokes, radius, caps=caps)


def _around(path: FloatArray, spokes: FloatArray, radius: FloatArray, *, caps: bool) -> Mesh:
    """A skin over the rings around a path.

    Args:
        path: N x 3, middles of the rings, metres.
        spokes: N x S x 3, unit vectors from each middle.
        radius: N, metres.
        caps: Close both ends.
    """
    rings = path[:, None] + spokes * radius[:, None, None]
    count, sides = spokes.shape[:2]
    ring, side = np.meshgrid(np.arange(count - 1), np.arange(sides), indexing="ij")
    beside = (side + 1) % sides
    quads = np.stack(
        [ring * sides + side, ring * sides + beside, (ring + 1) * sides + beside,
         (ring + 1) * sides + side], axis=-1,
    ).reshape(-1, 4)  # fmt: skip
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    girth = 2 * np.pi * radius.mean() / sides
    u = np.stack([side, side + 1, side + 1, side], axis=-1).reshape(-1) * girth
    v = np.stack([along[ring], along[ring], along[ring + 1], along[ring + 1]], axis=-1).reshape(-1)
    points, corners = rings.reshape(-1, 3), quads.reshape(-1)
    normals = spokes.reshape(-1, 3)[corners]
    sizes = np.full(len(quads), 4)
    wall = Mesh(points, sizes, corners, normals, np.stack([u, v], axis=1))
    return welded(merge([wall, *_caps(rings, sides)])) if caps else wall


def _caps(rings: FloatArray, sides: int) -> list[Mesh]:
    order = np.arange(sides)
    ends = [(rings[0], order[::-1]), (rings[-1], order)]
    return [flat(ring, np.array([sides]), corners) for ring, corners in ends if np.ptp(ring) > 1e-6]


def _frames(path: FloatArray) -> FloatArray:
    """Two directions across the path at each point, N x 2 x 3, with minimal twist."""
    tangent = normalised(np.gradient(path, axis=0))
    start = np.array([1.0, 0.0, 0.0]) if abs(tangent[0, 0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    frames = np.empty((len(path), 2, 3))
    first = start
    for index, direction in enumerate(tangent):
        first = normalised(first - direction * (first @ direction))
        frames[index] = first, np.cross(direction, first)
    return frames


def post(height: float, radius: float, sides: int = 10, top: float | None = None) -> Mesh:
    """A vertical bar at the origin; `top` is the radius at the top of a tapered bar."""
    path = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, height]])
    return tube(path, np.array([radius, radius if top is None else top]), sides)


def lathe(profile: FloatArray, sides: int) -> Mesh:
    """A body of revolution about z, round about its axis.

    Along the profile, faces meet in a curve or in an edge, by their angle.

    Args:
        profile: N x 2, (radius, z) with the axis on its left, metres: up on the outside, and down
            again on the inside of what is hollow.
        sides: Number of corners of its cross-section; up to 8 are meant as corners.
    """
    path = np.c_[np.zeros((len(profile), 2)), profile[:, 1]]
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(sides)], axis=1)
    spokes = np.broadcast_to(ring, (len(profile), sides, 3))
    body = _around(path, spokes, np.maximum(profile[:, 0], 1e-4), caps=True)
    facets = flat(body.points, body.face_sizes, body.face_vertices)
    if sides <= 8:
        return facets
    normals, walls = facets.normals.copy(), 4 * sides * (len(profile) - 1)
    spokes = normalised(body.normals[:walls] * [1.0, 1.0, 0.0]).reshape(-1, sides, 4, 3)
    slopes = _slopes(normals[:walls].reshape(-1, sides, 4, 3), spokes)
    turned = slopes[:, None, :, :1] * spokes + slopes[:, None, :, 1:] * [0.0, 0.0, 1.0]
    normals[:walls] = turned.reshape(-1, 3)
    return replace(facets, normals=normals)


def _slopes(normals: FloatArray, spokes: FloatArray) -> FloatArray:
    """Outward and upward share of the normals at the corners of each ring, R x 4 x 2.

    Args:
        normals: R x S x 4 x 3, of the faces at the corners of each ring of S faces.
        spokes: R x S x 4 x 3, unit vectors away from the axis.
    """
    outward = np.linalg.norm(normals[:, 0, 0, :2], axis=-1)
    outward *= np.sign((normals[:, 0, 0] * spokes[:, 0, 0]).sum(axis=-1))
    ring = np.stack([outward, normals[:, 0, 0, 2]], axis=1)
    curved = (ring[1:] * ring[:-1]).sum(axis=1, keepdims=True) > _ROUND
    between = ring[1:] + ring[:-1]
    between = between / np.maximum(np.linalg.norm(between, axis=1, keepdims=True), 1e-12)
    low, high = ring.copy(), ring.copy()
    low[1:] = np.where(curved, between, low[1:])
    high[:-1] = np.where(curved, between, high[:-1])
    return np.stack([low, low, high, high], axis=1)


def moved(mesh: Mesh, offset: tuple[float, float, float]) -> Mesh:
    """The mesh, translated."""
    return Mesh(
        mesh.points + np.asarray(offset), mesh.face_sizes, mesh.face_vertices, mesh.normals, mesh.uv
    )


def turned(mesh: Mesh, matrix: FloatArray) -> Mesh:
    """The mesh, rotated by a matrix (3 x 3, applied to column vectors)."""
    return Mesh(
        mesh.points @ matrix.T,
        mesh.face_sizes,
        mesh.face_vertices,
        mesh.normals @ matrix.T,
        mesh.uv,
    )


def upright_size(*meshes: Mesh) -> tuple[float, float, float]:
    """Mean width, twice, and height above the ground: the size of objects without a front."""
    points = np.concatenate([mesh.points for mesh in meshes])
    width = round(float(np.ptp(points[:, :2], axis=0).mean()), 3)
    return width, width, round(float(points[:, 2].max()), 3)

"""Union of closed bodies as a closed shell whose faces keep their class and part."""

import math
from collections.abc import Sequence

import manifold3d
import numpy as np
import shapely
from scipy.spatial import cKDTree

from envgen_usd.chunks import GRID
from envgen_usd.city.buildings.building_faces import Face, Point, Ring
from envgen_usd.geometry.border_loops import border_loops
from envgen_usd.models.array_types import FloatArray

_ROUND = 6
"""Decimals of a coordinate (metres) that identify a body's vertices."""
_FRAME = 0.05
"""Least width of wall around an opening, metres; a larger value drops more openings."""
_FINE = 16e-3
"""Distance above which snapping to the coordinate grid joins no vertices, metres."""
_SMALL = 0.08
"""Least extent of a polygon or a hole, metres.

Smaller pieces, e.g. of a ridge that just pierces a roof, are dropped. A larger value drops more.
"""
_STRAIGHT = 1e-5
"""Metres; a vertex that lies so near to the line between its neighbours lies on it."""
_CLOSE = 0.01
"""Square metres: product of the distances of a vertex from both neighbours on a line with it.
With a smaller product, the grid of coordinates moves the vertex so far off the line that the
circle through all three is smaller than a roof (5 m). A Delaunay triangulation then cuts off a
sliver of any direction."""
_NARROW = 6e-3
"""Height below which snapping to the coordinate grid may tilt a triangle, metres."""


def unite(bodies: Sequence[list[Face]]) -> list[Face] | None:
    """Returns the outer faces of the union of bodies.

    Faces keep class and part, and their openings inside the remaining area. The Boolean operation
    is that of the Manifold library, which tracks the original face of each triangle. Triangles of a
    face are joined again.

    Args:
        bodies: Closed, outward-facing shells; they may overlap or touch.

    Returns:
        The faces; `None` if the union, snapped to the coordinate grid, is not a closed 2-manifold.
    """
    if len(bodies) == 1:
        return bodies[0]
    first = manifold3d.Manifold.reserve_ids(len(bodies))
    solids = [_solid(faces, first + number) for number, faces in enumerate(bodies)]
    united = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    mesh = united.simplify(GRID).to_mesh64()
    vertices = np.asarray(mesh.vert_properties)[:, :3]
    if len(vertices) < 4 or len(cKDTree(vertices).query_pairs(_FINE)):
        return None
    points = [tuple(point) for point in vertices.tolist()]
    triangles = np.asarray(mesh.tri_verts).tolist()
    runs, ids = mesh.run_index, mesh.run_original_id
    groups: dict[tuple[int, int], list[list[int]]] = {}
    face_ids = mesh.face_id
    for run, original in enumerate(ids):
        for t in range(runs[run] // 3, runs[run + 1] // 3):
            groups.setdefault((original - first, face_ids[t]), []).append(triangles[t])
    faces = []
    for (body, face), members in sorted(groups.items()):
        faces += _faces(bodies[body][face], members, points)
    return None if _any_thin(faces) else faces


def _any_thin(faces: Sequence[Face]) -> bool:
    """True if a polygon is so narrow somewhere that its plane is uncertain there."""
    others = []
    for face in faces:
        if len(face.ring) != 4 or face.holes:
            others.append(_flat_rings(face))
        elif _has_short_side(face.ring):
            return True
    if not others:
        return False
    rings = [ring for shape in others for ring in shape]
    if _any_flat_corner(rings) or min(float(np.ptp(r, axis=0).max()) for r in rings) < _SMALL:
        return True
    cut = [manifold3d.triangulate(shape) for shape in others]
    corners = [np.concatenate(shape)[found] for shape, found in zip(others, cut, strict=True)]
    owner = np.repeat(np.arange(len(others)), [len(found) for found in cut])
    low = np.unique(owner[_heights(np.concatenate(corners)) < _NARROW])
    # The Delaunay triangulation has the widest triangles, but takes much longer.
    return any(_is_narrow(others[number]) for number in low.tolist())


def _has_short_side(ring: Ring) -> bool:
    a, b, c, d = ring
    return min(math.dist(a, b), math.dist(b, c), math.dist(c, d), math.dist(d, a)) < _FINE


def _any_flat_corner(rings: list[FloatArray]) -> bool:
    """Whether a vertex lies nearly between its neighbours, or quite so and close to them."""
    sizes = np.array([len(ring) for ring in rings])
    ends = np.cumsum(sizes)
    before, after = np.arange(-1, ends[-1] - 1), np.arange(1, ends[-1] + 1)
    before[ends - sizes], after[ends - 1] = ends - 1, ends - sizes
    points = np.concatenate(rings)
    heights = _heights(np.stack([points[before], points, points[after]], axis=1))
    sides = np.hypot(*(points - points[before]).T) * np.hypot(*(points[after] - points).T)
    return bool(((heights < _NARROW) & ((heights > _STRAIGHT) | (sides < _CLOSE))).any())


def _is_narrow(shape: list[FloatArray]) -> bool:
    pieces = shapely.constrained_delaunay_triangles(shapely.Polygon(shape[0], shape[1:]))
    borders = shapely.get_exterior_ring(shapely.get_parts(pieces))
    corners = shapely.get_coordinates(borders).reshape(-1, 4, 2)[:, :3]
    return float(_heights(corners).min()) < _NARROW


def _heights(triangles: FloatArray) -> FloatArray:
    """Least height of each of T triangles, T x 3 x 2."""
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    doubled = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    sides = np.stack([first, second, second - first])
    longest = np.sqrt((sides**2).sum(axis=2)).max(axis=0)
    heights: FloatArray = doubled / np.maximum(longest, 1e-12)
    return heights


def _solid(faces: list[Face], original: int) -> manifold3d.Manifold:
    index: dict[Point, int] = {}
    triangles: list[int] = []
    owners: list[int] = []
    for number, face in enumerate(faces):
        corners = [
            index.setdefault((round(x, _ROUND), round(y, _ROUND), round(z, _ROUND)), len(index))
            for ring in (face.ring, *face.holes)
            for x, y, z in ring
        ]
        cut = _triangles(face)
        triangles += [corners[i] for i in cut]
        owners += [number] * (len(cut) // 3)
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            np.array(list(index)),
            np.array(triangles, dtype=np.uint64).reshape(-1, 3),
            run_index=np.array([0, len(triangles)], dtype=np.uint64),
            run_original_id=np.array([original], dtype=np.uint32),
            face_id=np.array(owners, dtype=np.uint64),
        )
    )


def _triangles(face: Face) -> list[int]:
    """Corners of the triangles of a face: indices into its concatenated rings."""
    if len(face.ring) == 4 and not face.holes:
        return [0, 1, 2, 0, 2, 3]
    if len(face.ring) == 3:
        return [0, 1, 2]
    indices: list[int] = manifold3d.triangulate(_flat_rings(face)).ravel().tolist()
    return indices


def _flat_rings(face: Face) -> list[FloatArray]:
    axis = _axis(face.ring)
    return [np.array([_flat(p, axis) for p in ring]) for ring in (face.ring, *face.holes)]


def _faces(source: Face, triangles: list[list[int]], points: list[Point]) -> list[Face]:
    """Remaining polygons of a face, with holes."""
    loops = border_loops((c[i], c[(i + 1) % 3]) for c in triangles for i in range(3))
    if loops is None:
        return [_piece(source, [points[i] for i in corners], []) for corners in triangles]
    axis = _axis(source.ring)
    flat = {loop: [_flat(points[i], axis) for i in loop] for loop in loops}
    exteriors = [loop for loop in loops if _area(flat[loop]) > 0.0]
    holes: dict[tuple[int, ...], list[Ring]] = {loop: [] for loop in exteriors}
    for loop in loops:
        if loop not in holes:
            owner = exteriors[0] if len(exteriors) == 1 else _owner(loop, exteriors, flat)
            holes[owner].append([points[i] for i in loop])
    return [_piece(source, [points[i] for i in loop], holes[loop]) for loop in exteriors]


def _axis(ring: Ring) -> tuple[int, int, float]:
    """Projection plane with the largest area of a face: two coordinates, and their orientation."""
    nx = ny = nz = 0.0
    x0, y0, z0 = ring[-1]
    for x1, y1, z1 in ring:
        nx += (y0 - y1) * (z0 + z1)
        ny += (z0 - z1) * (x0 + x1)
        nz += (x0 - x1) * (y0 + y1)
        x0, y0, z0 = x1, y1, z1
    ax, ay, az = abs(nx), abs(ny), abs(nz)
    if ax >= ay and ax >= az:
        return 1, 2, 1.0 if nx > 0.0 else -1.0
    if ay >= az:
        return 2, 0, 1.0 if ny > 0.0 else -1.0
    return 0, 1, 1.0 if nz > 0.0 else -1.0


def _flat(point: Point, axis: tuple[int, int, float]) -> tuple[float, float]:
    return point[axis[0]] * axis[2], point[axis[1]]


def _area(loop: list[tuple[float, float]]) -> float:
    pairs = zip(loop, loop[1:] + loop[:1], strict=True)
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in pairs) / 2


def _owner(
    loop: tuple[int, ...],
    exteriors: list[tuple[int, ...]],
    flat: dict[tuple[int, ...], list[tuple[float, float]]],
) -> tuple[int, ...]:
    """The smallest exterior around a hole."""
    hole = shapely.Polygon(flat[loop])
    around = [e for e in exteriors if shapely.Polygon(flat[e]).covers(hole)]
    return min(around or exteriors, key=lambda e: _area(flat[e]))


def _piece(source: Face, ring: Ring, holes: list[Ring]) -> Face:
    if not source.openings:
        return Face(source.kind, source.part, ring, holes)
    axis = _axis(source.ring)
    shape = shapely.Polygon(
        [_flat(p, axis) for p in ring], [[_flat(p, axis) for p in hole] for hole in holes]
    )
    shapely.prepare(shape)
    flat = np.array([[_flat(p, axis) for p in opening.ring] for opening in source.openings])
    # Openings are axis-aligned rectangles in the face's projection.
    low, high = flat.min(axis=1) - _FRAME, flat.max(axis=1) + _FRAME
    inside = shapely.covers(shape, shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1]))
    kept = [opening for opening, stays in zip(source.openings, inside, strict=True) if stays]
    return Face(source.kind, source.part, ring, holes, kept)

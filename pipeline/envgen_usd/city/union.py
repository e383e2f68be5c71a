"""Several closed bodies as one closed shell whose faces remember what they were."""

import math
from collections.abc import Sequence

import manifold3d
import numpy as np
import shapely
from scipy.spatial import cKDTree

from envgen_usd.chunks import GRID
from envgen_usd.city.faces import Face, Point, Ring
from envgen_usd.models.arrays import FloatArray

_ROUND = 6
"""Decimals of a coordinate (metres) by which vertices of a body are told apart."""
_FRAME = 0.05
"""Wall that must remain around an opening, metres."""
_FINE = 16e-3
"""Metres; vertices that lie farther apart are not joined by the grid of coordinates."""
_SMALL = 0.08
"""Metres; a polygon or a hole of less extent, as where a ridge just comes through a roof, is not
worth its vertices."""
_STRAIGHT = 1e-5
"""Metres; a vertex that lies so near to the line between its neighbours lies on it."""
_NARROW = 6e-3
"""Metres; a triangle that is less high may be tilted by the grid of coordinates."""


def unite(bodies: Sequence[list[Face]]) -> list[Face] | None:
    """Returns the outer faces of the union of bodies.

    Faces keep class and part, and those of their openings that lie in what is left of them. The
    Boolean operation is that of the Manifold library, which keeps for each triangle the face that
    it came from; triangles of one face are joined again.

    Args:
        bodies: Each a closed shell that looks outwards; they may overlap or touch.

    Returns:
        The faces; none where the bodies meet so closely that the union would not be a closed
        2-manifold any more when its coordinates are put on their grid.
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
    """Whether a polygon is so narrow somewhere that its plane is not certain there."""
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
    """Whether a vertex lies nearly, but not quite, between its neighbours."""
    sizes = np.array([len(ring) for ring in rings])
    ends = np.cumsum(sizes)
    before, after = np.arange(-1, ends[-1] - 1), np.arange(1, ends[-1] + 1)
    before[ends - sizes], after[ends - 1] = ends - 1, ends - sizes
    points = np.concatenate(rings)
    heights = _heights(np.stack([points[before], points, points[after]], axis=1))
    return bool(((heights > _STRAIGHT) & (heights < _NARROW)).any())


def _is_narrow(shape: list[FloatArray]) -> bool:
    pieces = shapely.constrained_delaunay_triangles(shapely.Polygon(shape[0], shape[1:]))
    borders = shapely.get_exterior_ring(shapely.get_parts(pieces))
    corners = shapely.get_coordinates(borders).reshape(-1, 4, 2)[:, :3]
    return float(_heights(corners).min()) < _NARROW


def _heights(triangles: FloatArray) -> FloatArray:
    """Least height of each of T triangles, T x 3 x 2."""
    one, two = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    doubled = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    sides = np.stack([one, two, two - one])
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
    """Corners of the triangles of a face: indices in its rings, one after the other."""
    if len(face.ring) == 4 and not face.holes:
        return [0, 1, 2, 0, 2, 3]
    if len(face.ring) == 3:
        return [0, 1, 2]
    found: list[int] = manifold3d.triangulate(_flat_rings(face)).ravel().tolist()
    return found


def _flat_rings(face: Face) -> list[FloatArray]:
    axis = _axis(face.ring)
    return [np.array([_flat(p, axis) for p in ring]) for ring in (face.ring, *face.holes)]


def _faces(source: Face, triangles: list[list[int]], points: list[Point]) -> list[Face]:
    """What is left of a face: one or several polygons with holes."""
    loops = _loops(triangles)
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


def _loops(triangles: list[list[int]]) -> list[tuple[int, ...]] | None:
    """Borders of joined triangles; none where a vertex is passed twice."""
    edges = {(c[i], c[(i + 1) % 3]) for c in triangles for i in range(3)}
    border = [(a, b) for a, b in edges if (b, a) not in edges]
    following = dict(border)
    if len(following) != len(border):
        return None
    loops = []
    while following:
        start = min(following)
        loop = [start]
        while (vertex := following.pop(loop[-1])) != start:
            loop.append(vertex)
        loops.append(tuple(loop))
    return loops


def _axis(ring: Ring) -> tuple[int, int, float]:
    """The two coordinates in which a face is seen with the largest area, and their sense."""
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
    # Openings are rectangles along the axes in which the face is seen.
    low, high = flat.min(axis=1) - _FRAME, flat.max(axis=1) + _FRAME
    inside = shapely.covers(shape, shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1]))
    kept = [opening for opening, stays in zip(source.openings, inside, strict=True) if stays]
    return Face(source.kind, source.part, ring, holes, kept)

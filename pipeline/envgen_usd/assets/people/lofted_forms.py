"""Closed smooth surfaces around a line or a point, with a fine and a coarse mesh."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.polygon_mesh import Mesh, merge, normalised, vertex_normals
from envgen_usd.models.array_types import FloatArray, IntArray

_OUTLINE = {3: 1.5, 4: 1.2, 5: 1.12, 6: 1.08}
"""Widening that gives a polygon of so many corners about the outline of its ellipse."""


@dataclass(frozen=True)
class Loft:
    """A closed surface through superellipses along a line.

    Attributes:
        centres: N x 3, metres.
        left: N x 3, unit vectors of the half-widths.
        front: N x 3, unit vectors of the depths.
        sections: N x 4: half-width, depth to the front, depth to the back (metres), and exponent:
            2 for an ellipse, more for a squarer section.
    """

    centres: FloatArray
    left: FloatArray
    front: FloatArray
    sections: FloatArray

    def mesh(self, sides: int) -> Mesh:
        """The surface with all sections, of so many corners each, closed at both ends."""
        count = len(self.centres)
        # The line of the texture's seam is at the back; both halves mirror one another there.
        angle = np.linspace(-np.pi, np.pi, sides, endpoint=False) + np.pi / sides
        power = 2.0 / self.sections[:, 3:]
        across = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** power
        along = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** power
        depth = np.where(along > 0.0, self.sections[:, 1:2], self.sections[:, 2:3])
        rings = (
            self.centres[:, None]
            + (across * self.sections[:, :1])[..., None] * self.left[:, None]
            + (along * depth)[..., None] * self.front[:, None]
        )
        points = np.concatenate([rings.reshape(-1, 3), self.centres[[0, -1]]])
        sizes, corners = _grid_faces(count, sides)
        middle = count // 2
        tangent = self.centres[min(middle + 1, count - 1)] - self.centres[max(middle - 1, 0)]
        if np.cross(self.front[middle], self.left[middle]) @ tangent < 0.0:
            corners = _reversed(sizes, corners)
        reach = self.sections[:, :1] * np.abs(angle)
        run = np.cumsum([0.0, *np.linalg.norm(np.diff(self.centres, axis=0), axis=1)])
        walls = np.stack([reach, np.broadcast_to(run[:, None], reach.shape)], axis=2)
        uv = np.concatenate([walls.reshape(-1, 2), [[0.0, run[0]], [0.0, run[-1]]]])
        return Mesh(
            points, sizes, corners, vertex_normals(points, sizes, corners), uv, False, False
        )

    def coarse(self, sides: int, rows: Sequence[int]) -> Mesh:
        """The surface through a few of the sections."""
        chosen = list(rows)
        sections = self.sections[chosen] * [*(_OUTLINE.get(sides, 1.0),) * 3, 1.0]
        loft = Loft(self.centres[chosen], self.left[chosen], self.front[chosen], sections)
        return loft.mesh(sides)


def _grid_faces(rings: int, sides: int) -> tuple[IntArray, IntArray]:
    """Quads between rings, and triangles to the two poles that follow the rings' points."""
    ring, side = np.meshgrid(np.arange(rings - 1), np.arange(sides), indexing="ij")
    beside = (side + 1) % sides
    low, high = ring * sides, (ring + 1) * sides
    quads = np.stack([low + side, low + beside, high + beside, high + side], axis=2)
    k = np.arange(sides)
    top = (rings - 1) * sides
    first = np.stack([(k + 1) % sides, k, np.full(sides, rings * sides)], axis=1)
    last = np.stack([top + k, top + (k + 1) % sides, np.full(sides, rings * sides + 1)], axis=1)
    sizes = np.concatenate([np.full(ring.size, 4), np.full(2 * sides, 3)])
    return sizes, np.concatenate([quads.reshape(-1), first.reshape(-1), last.reshape(-1)])


def _reversed(sizes: IntArray, corners: IntArray) -> IntArray:
    """The corners of each face in the opposite order."""
    ends = np.cumsum(sizes)
    position = np.arange(len(corners))
    face = np.repeat(np.arange(len(sizes)), sizes)
    starts = ends - sizes
    turned: IntArray = corners[starts[face] + ends[face] - 1 - position]
    return turned


def star(
    centre: FloatArray,
    frame: FloatArray,
    reach: Callable[[FloatArray], FloatArray],
    longitudes: FloatArray,
    latitudes: FloatArray,
) -> Mesh:
    """A closed surface around a point, from its distance in each direction.

    Args:
        centre: 3, metres.
        frame: 3 x 3, local axes (forward, left, up) as columns.
        reach: Distance in metres of local directions (N x 3).
        longitudes: Rising angles of the meridians from the front to the left, below a full turn.
        latitudes: Rising angles of the parallels between both poles.
    """
    around, up = np.meshgrid(longitudes, latitudes)
    rows = np.stack(
        [np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=2
    ).reshape(-1, 3)
    directions = np.concatenate([rows, [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]])
    local = directions * reach(directions)[:, None]
    sizes, corners = _grid_faces(len(latitudes), len(longitudes))
    points = centre + local @ frame.T
    uv = local[:, 1:] * np.where(local[:, :1] < 0.0, -1.0, 1.0)
    return Mesh(points, sizes, corners, vertex_normals(points, sizes, corners), uv, False, False)


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Joins meshes whose normals and texture coordinates are all per vertex."""
    return replace(merge(meshes), corner_normals=False, corner_uv=False)


def smoothed(mesh: Mesh) -> Mesh:
    """A mesh with values per corner as one with smooth normals per vertex, without texture."""
    normals = vertex_normals(mesh.points, mesh.face_sizes, mesh.face_vertices)
    uv = np.zeros((len(mesh.points), 2))
    return replace(mesh, normals=normals, uv=uv, corner_normals=False, corner_uv=False)


def sharpened(mesh: Mesh) -> Mesh:
    """A mesh with values per vertex as one with the same values per corner."""
    if mesh.corner_normals:
        return mesh
    index = mesh.face_vertices
    return replace(
        mesh, normals=mesh.normals[index], uv=mesh.uv[index], corner_normals=True, corner_uv=True
    )


def rotation(axis: int, degrees: float) -> FloatArray:
    """3 x 3, right-handed rotation about the axis of that number."""
    angle = np.radians(degrees)
    cos, sin = np.cos(angle), np.sin(angle)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[first, first], matrix[first, second] = cos, -sin
    matrix[second, first], matrix[second, second] = sin, cos
    return matrix


def between(first: FloatArray, second: FloatArray, share: FloatArray) -> FloatArray:
    """N x 3 x 3, rotations that turn from one to another; for small angles."""
    mixed = first + share[:, None, None] * (second - first)
    forward = normalised(mixed[..., 0])
    left = normalised(mixed[..., 1] - forward * (mixed[..., 1] * forward).sum(-1, keepdims=True))
    return np.stack([forward, left, np.cross(forward, left)], axis=-1)

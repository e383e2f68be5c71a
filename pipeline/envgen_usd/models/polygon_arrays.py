"""Polygons with holes in flat arrays, and the solids that they bound."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.frozen_model import Model

ShellPath = tuple[int, int]
"""Number of a solid, and number of a shell of that solid, exterior first."""


@dataclass(frozen=True, repr=False, eq=False)
class Polygons(Model):
    """P polygons in 3D, each with an exterior ring and any number of holes.

    Rings do not repeat their first point at the end. Seen against the surface normal, exteriors
    run counter-clockwise and holes clockwise. Polygon p owns the rings from
    ``ring_offsets[polygon_offsets[p]:polygon_offsets[p + 1] + 1]``; the first is the exterior.

    Attributes:
        points: N x 3, metres, road frame.
        ring_offsets: R + 1, first point of each ring, and N.
        polygon_offsets: P + 1, first ring of each polygon, and R.
    """

    points: FloatArray
    ring_offsets: IntArray
    polygon_offsets: IntArray

    def __len__(self) -> int:
        """Returns the number of polygons."""
        return len(self.polygon_offsets) - 1

    @staticmethod
    def of_triangles(vertices: FloatArray, triangles: IntArray) -> "Polygons":
        """Creates a polygon from each triangle: vertices V x 3, triangles T x 3."""
        count = len(triangles)
        return Polygons(
            vertices[triangles.reshape(-1)],
            np.arange(0, 3 * count + 1, 3, dtype=np.int64),
            np.arange(count + 1, dtype=np.int64),
        )

    @staticmethod
    def of_rings(rings: list[FloatArray]) -> "Polygons":
        """Creates a polygon without holes from each ring (N_i x 3)."""
        sizes = np.array([0, *(len(ring) for ring in rings)], dtype=np.int64)
        points = np.concatenate(rings) if rings else np.empty((0, 3))
        return Polygons(points, np.cumsum(sizes), np.arange(len(rings) + 1, dtype=np.int64))

    def rings(self, polygon: int) -> list[FloatArray]:
        """Returns the rings of a polygon, exterior first; each N_i x 3."""
        first, last = self.polygon_offsets[polygon : polygon + 2]
        return [
            self.points[self.ring_offsets[r] : self.ring_offsets[r + 1]] for r in range(first, last)
        ]


@dataclass(frozen=True, repr=False, eq=False)
class Solids(Polygons):
    """Polygons that bound one solid with cavities, or several solids.

    A single solid without cavities is a plain `Polygons`.

    Attributes:
        shell: P, shell of each polygon. Normals of exterior shells point away from the solid, and
            normals of inner shells into their cavity.
        solid: S, solid of each shell, ascending; the first shell of a solid is its exterior.
        composite: True for solids that touch each other and form a whole (CompositeSolid); false
            for separate solids (MultiSolid).
    """

    shell: IntArray
    solid: IntArray
    composite: bool = False

    @property
    def exterior(self) -> BoolArray:
        """P, true for polygons of exterior shells."""
        first = np.ones(len(self.solid), dtype=bool)
        first[1:] = self.solid[1:] != self.solid[:-1]
        outer: BoolArray = first[self.shell]
        return outer

    @staticmethod
    def of_shells(polygons: Polygons, paths: Sequence[ShellPath], *, composite: bool) -> Polygons:
        """Groups polygons by shells; a single shell gives the polygons themselves.

        Args:
            polygons: P polygons.
            paths: P, number of the solid and number of its shell, for each polygon.
            composite: As the attribute.
        """
        shells = sorted(set(paths))
        if len(shells) < 2:
            return polygons
        number = {path: n for n, path in enumerate(shells)}
        return Solids(
            **vars(polygons),
            shell=np.array([number[path] for path in paths], dtype=np.int64),
            solid=np.unique([path[0] for path in shells], return_inverse=True)[1].astype(np.int64),
            composite=composite,
        )

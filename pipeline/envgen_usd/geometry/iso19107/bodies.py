"""Bodies that share space: shells of a solid (codes 401 to 404), parts of a building (601)."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

import manifold3d
import numpy as np

from envgen_usd.geometry.iso19107.faults import SNAP
from envgen_usd.geometry.iso19107.places import places
from envgen_usd.geometry.triangulate import triangulate
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.polygons import Polygons


def cavity_faults(exterior: Polygons, cavities: Sequence[Polygons]) -> tuple[int, ...]:
    """Returns the codes of what is wrong with how the shells of a solid lie to each other.

    Args:
        exterior: The outer shell, valid in itself.
        cavities: The inner shells, each valid in itself.
    """
    shells = [exterior, *cavities]
    outer, *inner = (_body(shell, exterior.points[0]) for shell in shells)
    codes = {_nested(outer, cavity) for cavity in inner}
    codes |= {_apart(one, other) for one, other in combinations(inner, 2)}
    codes |= {402 for one, other in combinations(shells, 2) if _same(one, other)}
    codes -= {401, 403} if 402 in codes else {0}
    rest = outer - manifold3d.Manifold.batch_boolean(inner, manifold3d.OpType.Add)
    # The surface of a cavity is a piece too, of negative volume.
    if codes <= {0} and sum(piece.volume() > 0 for piece in rest.decompose()) > 1:
        return (404,)
    return tuple(sorted(codes - {0}))


def overlaps(
    solids: Mapping[int, Polygons], groups: Iterable[Sequence[int]]
) -> list[tuple[int, int, float]]:
    """Returns pairs of solids that share space, and the volume of it, cubic metres.

    Solids that only touch share none.

    Args:
        solids: Outer shells by the number of the solid, each valid.
        groups: Numbers of solids that are to be held against each other.
    """
    found = []
    for group in groups:
        boxes = {n: (solids[n].points.min(axis=0), solids[n].points.max(axis=0)) for n in group}
        meeting = [pair for pair in combinations(group, 2) if _meet(*(boxes[n] for n in pair))]
        made = {
            n: _body(solids[n], boxes[group[0]][0]) for n in sorted({n for p in meeting for n in p})
        }
        for one, other in meeting:
            shared = made[one] ^ made[other]
            if shared.volume() > SNAP * shared.surface_area():
                found.append((one, other, float(shared.volume())))
    return found


def _meet(one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]) -> bool:
    """Whether two boxes, by their corners, share space."""
    return bool((np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]) > SNAP).all())


def _body(shell: Polygons, origin: FloatArray) -> manifold3d.Manifold:
    """A closed shell as a body of positive volume, whatever way its normals point."""
    triangles, _ = triangulate(shell)
    points = shell.points - origin
    used, corners = np.unique(places(shell.points)[triangles], return_inverse=True)
    faces = corners.reshape(-1, 3).astype(np.uint64)
    made = manifold3d.Manifold(manifold3d.Mesh64(points[used], faces))
    if made.volume() < 0:
        made = manifold3d.Manifold(manifold3d.Mesh64(points[used], faces[:, ::-1].copy()))
    return made


def _nested(outer: manifold3d.Manifold, cavity: manifold3d.Manifold) -> int:
    common, rest = cavity ^ outer, outer - cavity
    slack = SNAP * cavity.surface_area()
    if common.volume() < slack:
        return 403
    # Where two surfaces share a face, both sides of it vanish from the rest.
    whole = outer.surface_area() + cavity.surface_area()
    shares = rest.surface_area() < whole - slack
    return 401 if shares or common.volume() < cavity.volume() - slack else 0


def _apart(one: manifold3d.Manifold, other: manifold3d.Manifold) -> int:
    whole = one.surface_area() + other.surface_area()
    shares = (one + other).surface_area() < whole - SNAP * min(
        one.surface_area(), other.surface_area()
    )
    return 401 if shares or (one ^ other).volume() > SNAP * one.surface_area() else 0


def _same(one: Polygons, other: Polygons) -> bool:
    place = places(np.concatenate([one.points, other.points]))
    ends = np.unique(place[: len(one.points)]), np.unique(place[len(one.points) :])
    return len(one) == len(other) and np.array_equal(*ends)

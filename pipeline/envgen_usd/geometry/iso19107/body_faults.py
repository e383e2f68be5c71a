"""Bodies with common volume: shells of a solid (codes 401 to 404), parts of a building (601)."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

import manifold3d
import numpy as np

from envgen_usd.geometry.iso19107.coincident_points import places
from envgen_usd.geometry.iso19107.fault_codes import SNAP
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.polygon_arrays import Polygons


def cavity_faults(exterior: Polygons, cavities: Sequence[Polygons]) -> tuple[int, ...]:
    """Returns the fault codes of the position of a solid's shells relative to each other.

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
    # The surface of a cavity is a separate piece of negative volume.
    if codes <= {0} and sum(piece.volume() > 0 for piece in rest.decompose()) > 1:
        return (404,)
    return tuple(sorted(codes - {0}))


def overlaps(
    solids: Mapping[int, Polygons], groups: Iterable[Sequence[int]]
) -> list[tuple[int, int, float]]:
    """Returns pairs of solids with a common volume, and that volume in cubic metres.

    Solids that only touch have no common volume.

    Args:
        solids: Outer shells by the number of the solid, each valid.
        groups: Groups of numbers; the solids of a group are compared with each other.
    """
    overlapping = []
    for group in groups:
        boxes = {n: (solids[n].points.min(axis=0), solids[n].points.max(axis=0)) for n in group}
        meeting = [pair for pair in combinations(group, 2) if _meet(*(boxes[n] for n in pair))]
        bodies = {
            n: _body(solids[n], boxes[group[0]][0]) for n in sorted({n for p in meeting for n in p})
        }
        for first, second in meeting:
            shared = bodies[first] ^ bodies[second]
            if shared.volume() > SNAP * shared.surface_area():
                overlapping.append((first, second, float(shared.volume())))
    return overlapping


def _meet(first: tuple[FloatArray, FloatArray], second: tuple[FloatArray, FloatArray]) -> bool:
    """Returns whether two boxes, given by their corners, overlap."""
    return bool((np.minimum(first[1], second[1]) - np.maximum(first[0], second[0]) > SNAP).all())


def _body(shell: Polygons, origin: FloatArray) -> manifold3d.Manifold:
    """Converts a closed shell to a body of positive volume for either orientation."""
    triangles, _ = triangulate(shell)
    points = shell.points - origin
    used, corners = np.unique(places(shell.points)[triangles], return_inverse=True)
    faces = corners.reshape(-1, 3).astype(np.uint64)
    body = manifold3d.Manifold(manifold3d.Mesh64(points[used], faces))
    if body.volume() < 0:
        body = manifold3d.Manifold(manifold3d.Mesh64(points[used], faces[:, ::-1].copy()))
    return body


def _nested(outer: manifold3d.Manifold, cavity: manifold3d.Manifold) -> int:
    common, rest = cavity ^ outer, outer - cavity
    slack = SNAP * cavity.surface_area()
    if common.volume() < slack:
        return 403
    # Where two surfaces share a face, the rest lacks both sides of it.
    whole = outer.surface_area() + cavity.surface_area()
    shares = rest.surface_area() < whole - slack
    return 401 if shares or common.volume() < cavity.volume() - slack else 0


def _apart(first: manifold3d.Manifold, second: manifold3d.Manifold) -> int:
    whole = first.surface_area() + second.surface_area()
    shares = (first + second).surface_area() < whole - SNAP * min(
        first.surface_area(), second.surface_area()
    )
    return 401 if shares or (first ^ second).volume() > SNAP * first.surface_area() else 0


def _same(first: Polygons, second: Polygons) -> bool:
    place = places(np.concatenate([first.points, second.points]))
    ends = np.unique(place[: len(first.points)]), np.unique(place[len(first.points) :])
    return len(first) == len(second) and np.array_equal(*ends)

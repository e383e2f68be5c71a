"""Bodies with common volume: shells of a solid (codes 401 to 404), other solids (501 to 601)."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

import manifold3d
import numpy as np

from envgen_usd.geometry.iso19107.coincident_points import places
from envgen_usd.geometry.iso19107.fault_codes import SNAP
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.polygon_arrays import Polygons

_THICK = 1e-7
"""Thickness (see `_thickness`) of a common volume in metres; larger values tolerate more.

It lies above the rounding of coordinates of 10,000 km, and below all digits of files.
"""


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
    rest = _solid(shells, exterior.points[0])
    # The surface of a cavity is a separate piece of negative volume.
    if codes <= {0} and sum(piece.volume() > 0 for piece in rest.decompose()) > 1:
        return (404,)
    return tuple(sorted(codes - {0}))


def composite_faults(solids: Sequence[Sequence[Polygons]]) -> list[tuple[int, int, str]]:
    """Returns the faults between the solids of a composite solid: code, solid and figures.

    Args:
        solids: Shells of each solid, the exterior first, each valid.
    """
    origin = solids[0][0].points[0]
    bodies = [_solid(shells, origin) for shells in solids]
    faults = [
        (502 if _equal(bodies[one], bodies[other]) else 501, other, f"with solid {one} of it")
        for one, other in combinations(range(len(bodies)), 2)
        if _has_volume(bodies[one] ^ bodies[other])
    ]
    union = manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add)
    pieces = sum(piece.volume() > 0 for piece in union.decompose())
    return faults or ([(503, 0, f"{pieces} pieces")] if pieces > 1 else [])


def overlaps(
    solids: Mapping[int, Sequence[Polygons]], groups: Iterable[Sequence[int]]
) -> list[tuple[int, int, str]]:
    """Returns pairs of solids with a common volume, and its volume and thickness as text.

    As in val3dity, each common volume counts, however thin. Solids that only touch have none.

    Args:
        solids: Shells by the number of the solid, the exterior first, each valid.
        groups: Groups of numbers; the solids of a group are compared with each other.
    """
    overlapping = []
    for group in groups:
        exteriors = {n: solids[n][0].points for n in group}
        boxes = {n: (points.min(axis=0), points.max(axis=0)) for n, points in exteriors.items()}
        meeting = [pair for pair in combinations(group, 2) if _meet(*(boxes[n] for n in pair))]
        needed = sorted({number for pair in meeting for number in pair})
        bodies = {n: _solid(solids[n], boxes[group[0]][0]) for n in needed}
        for first, second in meeting:
            shared = bodies[first] ^ bodies[second]
            if _has_volume(shared):
                figures = f"{shared.volume():.3g} m³, {1e3 * _thickness(shared):.4g} mm thick"
                overlapping.append((first, second, figures))
    return overlapping


def _meet(first: tuple[FloatArray, FloatArray], second: tuple[FloatArray, FloatArray]) -> bool:
    """Returns whether two boxes, given by their corners, overlap."""
    return bool((np.minimum(first[1], second[1]) > np.maximum(first[0], second[0])).all())


def _equal(first: manifold3d.Manifold, second: manifold3d.Manifold) -> bool:
    return not _has_volume(first - second) and not _has_volume(second - first)


def _solid(shells: Sequence[Polygons], origin: FloatArray) -> manifold3d.Manifold:
    """Converts a solid with its cavities to a body."""
    outer, *cavities = (_body(shell, origin) for shell in shells)
    return manifold3d.Manifold.batch_boolean([outer, *cavities], manifold3d.OpType.Subtract)


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
    if _has_volume(cavity - outer):
        return 401 if _has_volume(cavity ^ outer) else 403
    # Where two surfaces share a face, the rest lacks both sides of it.
    whole = outer.surface_area() + cavity.surface_area()
    shares = (outer - cavity).surface_area() < whole - SNAP * cavity.surface_area()
    return 401 if shares else 0


def _apart(first: manifold3d.Manifold, second: manifold3d.Manifold) -> int:
    whole = first.surface_area() + second.surface_area()
    shares = (first + second).surface_area() < whole - SNAP * min(
        first.surface_area(), second.surface_area()
    )
    return 401 if shares or _has_volume(first ^ second) else 0


def _has_volume(body: manifold3d.Manifold) -> bool:
    """Returns whether a body is more than the rounding of coordinates."""
    return _thickness(body) > _THICK


def _thickness(body: manifold3d.Manifold) -> float:
    """Returns the thickness of the sheet with the volume and surface of the thickest piece, metres.

    It is at least two thirds of the radius of the largest ball inside a convex piece.
    """
    pieces = (piece for piece in body.decompose() if piece.surface_area() > 0)
    return max((2 * piece.volume() / piece.surface_area() for piece in pieces), default=0.0)


def _same(first: Polygons, second: Polygons) -> bool:
    place = places(np.concatenate([first.points, second.points]))
    ends = np.unique(place[: len(first.points)]), np.unique(place[len(first.points) :])
    return len(first) == len(second) and np.array_equal(*ends)

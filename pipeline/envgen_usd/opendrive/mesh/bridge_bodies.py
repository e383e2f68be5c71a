"""Bodies of bridges: underside, sides and parapets of a deck."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from envgen_usd.chunks import GRID
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.mesh.lift import Mesh
from envgen_usd.opendrive.surface_ids import nc_name

_Key = tuple[int, int, int]
_THICKNESS = 0.9
"""Metres from the deck to its underside; a larger value gives a thicker deck."""
_PARAPET = 1.0
"""Height of a parapet in metres."""
_PARAPET_WIDTH = 0.25
"""Width of a parapet in metres."""
_CORNERS = 5
"""Corners of the section: road's edge, parapet (inside and outside, top), bottom (outside, in)."""
_ALONG = 0.99
"""Least cosine between parallel edges; a larger value demands closer directions."""
_CAP = np.array([[3, 4, 0], [3, 0, 1], [3, 1, 2]])


def bridge_body(deck: Mesh, others: Iterable[Mesh]) -> Mesh:
    """Closes a bridge deck from below and beside, with parapets along its free edges.

    Args:
        deck: Surface of a level above the ground.
        others: Surfaces of the other levels; edges of the deck that adjoin them get no parapet.
    """
    beside = _neighbours(others)
    owner = _owners(deck)
    parts = [_underside(deck)]
    for loop in deck.outline:
        joint = np.array([_is_joint(edge, beside) for edge in _edges(deck, loop)])
        parts.append(_sides(deck, loop, joint, owner))
    index: dict[Patch, int] = {}
    triangles = np.concatenate([corners for corners, _ in parts])
    owners = np.concatenate([number for _, number in parts])
    meaning = [index.setdefault(_patch(deck.patches[k]), len(index)) for k in owners.tolist()]
    places, vertex = np.unique(_keys(triangles.reshape(-1, 3)), axis=0, return_inverse=True)
    corners = vertex.reshape(-1, 3).astype(np.int64)
    whole = np.array([len(set(corner)) == 3 for corner in corners.tolist()])
    return Mesh(
        places / round(1 / GRID),
        corners[whole],
        np.array(meaning, dtype=np.int64)[whole],
        tuple(index),
        (),
    )


def _keys(points: FloatArray) -> IntArray:
    return np.round(points / GRID).astype(np.int64)


def _edges(mesh: Mesh, loop: IntArray) -> list[tuple[_Key, _Key]]:
    """Returns the grid positions of both ends of each edge of a loop."""
    keys: list[_Key] = [(x, y, z) for x, y, z in _keys(mesh.vertices[loop]).tolist()]
    return list(zip(keys, keys[1:] + keys[:1], strict=True))


def _neighbours(meshes: Iterable[Mesh]) -> dict[_Key, list[_Key]]:
    """Returns the neighbours of each position along the outlines of meshes."""
    neighbours: dict[_Key, list[_Key]] = {}
    for a, b in (edge for mesh in meshes for loop in mesh.outline for edge in _edges(mesh, loop)):
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    return neighbours


def _is_joint(edge: tuple[_Key, _Key], beside: Mapping[_Key, Sequence[_Key]]) -> bool:
    """Returns whether an outline leaves along an edge and reaches the edge's end.

    The test compares directions only, because the other side may have an additional vertex a
    millimetre aside.
    """
    start, end = edge
    if start not in beside or end not in beside:
        return False
    along = np.subtract(end, start)
    ways = np.subtract(beside[start], start)
    cosines = ways @ along / (np.linalg.norm(ways, axis=1) * np.linalg.norm(along))
    return bool(cosines.max() > _ALONG)


def _owners(deck: Mesh) -> dict[tuple[int, int], int]:
    """Returns the patch of the triangle at each directed edge."""
    sides = np.concatenate([deck.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    return dict(
        zip(map(tuple, sides.tolist()), np.tile(deck.triangle_patch, 3).tolist(), strict=True)
    )


def _patch(above: Patch) -> Patch:
    place = f"road_{nc_name(above.road)}" if above.road else f"junction_{nc_name(above.junction)}"
    return Patch(
        id=f"deck_{place}",
        kind="deck",
        lane_type="none",
        road=above.road,
        section=0 if above.road else -1,
        junction=above.junction,
        material="concrete",
    )


def _bottom(points: FloatArray, deck: Mesh) -> FloatArray:
    """Returns points of the underside, below the lowest deck height at the given points."""
    plan, place = np.unique(_keys(deck.vertices)[:, :2], axis=0, return_inverse=True)
    lowest = np.full(len(plan), np.inf)
    np.minimum.at(lowest, place.ravel(), deck.vertices[:, 2])
    table = {tuple(key): z for key, z in zip(plan.tolist(), lowest.tolist(), strict=True)}
    z = [table[tuple(key)] - _THICKNESS for key in _keys(points)[:, :2].tolist()]
    return np.column_stack([points[:, :2], z])


def _underside(deck: Mesh) -> tuple[FloatArray, IntArray]:
    kerb = np.array([patch.kind == "kerb" for patch in deck.patches])[deck.triangle_patch]
    corners = deck.vertices[deck.triangles[~kerb]][:, ::-1]
    below = _bottom(corners.reshape(-1, 3), deck).reshape(-1, 3, 3)
    return below, deck.triangle_patch[~kerb]


def _sides(
    deck: Mesh, loop: IntArray, joint: BoolArray, owner: dict[tuple[int, int], int]
) -> tuple[FloatArray, IntArray]:
    """Returns bands along a loop; `joint` marks the edges where another surface adjoins."""
    points = deck.vertices[loop]
    section = _section(points, _bottom(points, deck), joint)
    following = np.roll(section, -1, axis=0)
    edges = zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
    number = np.array([owner[edge] for edge in edges])
    free = np.flatnonzero(~joint)
    triangles, owners = [], []
    for k in range(_CORNERS - 1):
        triangles += _quads(following[free], section[free], k, k + 1)
        owners += [number[free]] * 2
    closed = np.flatnonzero(joint)
    triangles += _quads(following[closed], section[closed], 0, _CORNERS - 1)
    owners += [number[closed]] * 2
    begins = np.flatnonzero(~joint & np.roll(joint, 1))
    ends = np.flatnonzero(~joint & np.roll(joint, -1))
    triangles += [section[begins][:, cap[::-1]] for cap in _CAP]
    triangles += [following[ends][:, cap] for cap in _CAP]
    owners += [number[begins]] * 3 + [number[ends]] * 3
    return np.concatenate(triangles), np.concatenate(owners)


def _quads(first: FloatArray, second: FloatArray, low: int, high: int) -> list[FloatArray]:
    """Returns two triangles per edge, between two corners of the sections at its ends."""
    return [
        np.stack([first[:, low], second[:, low], second[:, high]], axis=1),
        np.stack([first[:, low], second[:, high], first[:, high]], axis=1),
    ]


def _section(points: FloatArray, below: FloatArray, joint: BoolArray) -> FloatArray:
    """Returns the section at each vertex of a loop, N x 5 x 3, metres."""
    step = np.roll(points, -1, axis=0)[:, :2] - points[:, :2]
    step /= np.maximum(np.hypot(*step.T), 1e-9)[:, None]
    right = np.column_stack([step[:, 1], -step[:, 0]]) * ~joint[:, None]
    outward = right + np.roll(right, 1, axis=0)
    outward *= _PARAPET_WIDTH / np.maximum(np.hypot(*outward.T), 1e-9)[:, None]
    aside = np.column_stack([outward, np.zeros(len(points))])
    above = points + np.array([0.0, 0.0, _PARAPET])
    return np.stack([points, above, above + aside, below + aside, below], axis=1)

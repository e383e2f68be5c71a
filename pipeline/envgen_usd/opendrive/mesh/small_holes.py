"""Closes small, unintended holes between strips with the adjacent surface."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.geometry.border_loops import trace_loops
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.mesh.arrangement import Faces
from envgen_usd.opendrive.mesh.half_edges import half_edges
from envgen_usd.opendrive.mesh.overlap_removal import Cover
from envgen_usd.opendrive.strips.lane_strips import Strip, junction_patch

_WIDEST_IN_JUNCTION = 6.0
"""Widest hole in metres that is closed in a junction."""
_WIDEST_IN_MIDDLE = 25.0
"""Widest hole in metres that is closed around the centre of a junction."""
_WIDEST = 0.5
"""Widest hole in metres (inscribed circle) that is closed outside junctions."""
_SMALL_TURN = np.radians(25.0)
"""Largest turn in radians at a vertex of a round border; larger turns are corners."""


def fill_holes(faces: Faces, cover: Cover, strips: Sequence[Strip]) -> Cover:
    """Assigns the faces of small holes to the lane with the longest common border.

    In junctions these are gaps between connecting roads; elsewhere only slits are closed.
    """
    empty = np.flatnonzero(cover.patch < 0)
    tree = shapely.STRtree(shapely.points(faces.inner[empty]))
    edges = half_edges(faces, cover.patch >= 0)
    border = edges.twin < 0
    pairs = np.column_stack([edges.start[border], edges.end[border]])
    beside = dict(zip(map(tuple, pairs.tolist()), edges.face[border].tolist(), strict=True))
    middles = _middles(strips)
    lane, patch = cover.lane.copy(), cover.patch.copy()
    index = {meaning: number for number, meaning in enumerate(cover.patches)}
    for loop in trace_loops(pairs, faces.points):
        if shapely.is_ccw(shapely.linearrings(faces.points[loop])):
            continue
        owners = _neighbours(loop, faces.points, beside, cover.lane)
        owner = max(owners, key=lambda strip: (owners[strip], -strip))
        hole = shapely.Polygon(faces.points[loop])
        if _width(hole) > _limit(hole, owners, (strips, middles)):
            continue
        inside = empty[tree.query(hole, predicate="intersects")]
        lane[inside] = owner
        patch[inside] = index.setdefault(_filler(strips[owner].patch), len(index))
    return Cover(lane, cover.several, patch, tuple(index))


def _middles(strips: Sequence[Strip]) -> dict[str, shapely.Point]:
    """Returns the centre of each junction from the ends of its lanes."""
    ends: dict[str, list[FloatArray]] = {}
    for strip in strips:
        if strip.patch.junction and strip.patch.kind == "lane":
            sides = np.stack([strip.left[[0, -1]], strip.right[[0, -1]]])[..., :2]
            ends.setdefault(strip.patch.junction, []).append(sides.reshape(-1, 2))
    hulls = {name: shapely.MultiPoint(np.concatenate(sides)) for name, sides in ends.items()}
    return {name: shapely.centroid(hull.convex_hull) for name, hull in hulls.items()}


def _limit(
    hole: shapely.Polygon,
    owners: Mapping[int, float],
    both: tuple[Sequence[Strip], Mapping[str, shapely.Point]],
) -> float:
    """Returns the largest width in metres of an unintended hole.

    Turning paths leave a wider hole in the middle of a crossing. A hole with bent lanes around it
    is the island of a roundabout.
    """
    strips, middles = both
    junctions = {strips[strip].patch.junction for strip in owners} - {""}
    within = sum(owners[strip] for strip in owners if strips[strip].patch.junction)
    if within <= sum(owners.values()) / 2:
        return _WIDEST
    central = any(hole.contains(middles[name]) for name in junctions if name in middles)
    return _WIDEST_IN_MIDDLE if central and not _is_round(hole) else _WIDEST_IN_JUNCTION


def _is_round(hole: shapely.Polygon) -> bool:
    """Returns whether small turns bend the border outwards for more than half a circle."""
    ring = shapely.get_coordinates(shapely.simplify(hole, 0.02).normalize().exterior)[:-1]
    step = np.roll(ring, -1, axis=0) - ring
    before = np.roll(step, 1, axis=0)
    turn = -np.arctan2(
        before[:, 0] * step[:, 1] - before[:, 1] * step[:, 0], (before * step).sum(axis=1)
    )
    return float(turn[(turn > 0) & (turn < _SMALL_TURN)].sum()) > np.pi


def _width(hole: shapely.Polygon) -> float:
    """Returns the diameter of the inscribed circle in metres."""
    return 2 * float(shapely.length(shapely.maximum_inscribed_circle(hole, 0.05)))


def _neighbours(
    loop: IntArray, points: FloatArray, beside: Mapping[tuple[int, int], int], lane: IntArray
) -> dict[int, float]:
    """Returns the lane strips along a loop with the lengths of the common border, metres."""
    following = np.roll(loop, -1)
    lengths = np.hypot(*(points[following] - points[loop]).T)
    edges = zip(loop.tolist(), following.tolist(), strict=True)
    shared: dict[int, float] = {}
    for edge, length in zip(edges, lengths.tolist(), strict=True):
        owner = int(lane[beside[edge]])
        shared[owner] = shared.get(owner, 0.0) + length
    return shared


def _filler(beside: Patch) -> Patch:
    if beside.junction:
        return junction_patch(beside.junction, beside.lane_type, "filler")
    return replace(beside, id=f"{beside.id}_filler", kind="filler")

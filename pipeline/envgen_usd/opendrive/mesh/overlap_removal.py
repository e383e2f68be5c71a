"""Resolves overlapping lanes: assigns each face of the arrangement to a lane."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.geometry.flat_arrays import ascending
from envgen_usd.models.array_types import IntArray
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.mesh.arrangement import Faces
from envgen_usd.opendrive.strips.lane_strips import Strip, junction_patch
from envgen_usd.opendrive.strips.strip_index import Cells

_RANKS = {
    "biking": 4,
    "shoulder": 3,
    "restricted": 3,
    "border": 2,
    "curb": 2,
    "sidewalk": 2,
    "walking": 2,
    "median": 1,
    "none": 0,
}
_DRIVING_RANK = 5
"""Rank of lane types outside `_RANKS`, i.e. of driving lanes; a higher rank has priority."""
_RANKS_OF_KINDS = {"island": 6, "parking": -1, "junction": -2, "transition": -3}


@dataclass(frozen=True)
class Cover:
    """Assignment of faces to lanes and patches.

    Attributes:
        lane: F, strip index of the assigned lane; -1 for an empty face.
        several: F, number of roads with a lane of the same rank on the face.
        patch: F, index into `patches`; -1 for an empty face.
        patches: Semantics of the faces.
    """

    lane: IntArray
    several: IntArray
    patch: IntArray
    patches: tuple[Patch, ...]


def cover_faces(faces: Faces, strips: Sequence[Strip], cells: Cells) -> Cover:
    """Assigns each face to a lane.

    Driving lanes have priority over other lanes, then roads outside junctions over connecting
    roads. Where lanes of several connecting roads overlap, the face belongs to the junction.

    Args:
        faces: Faces of the arrangement of all strips and marks.
        strips: Strips of lanes.
        cells: Spatial index of the strips.
    """
    place, strip = cells.covering(faces.inner)
    lane, several = _winners(len(faces.inner), place, strip, strips)
    index: dict[Patch, int] = {}
    patch = np.full(len(lane), -1)
    covered = np.flatnonzero(lane >= 0)
    codes, which = np.unique(2 * lane[covered] + (several[covered] > 1), return_inverse=True)
    numbers = []
    for owner, shared in zip(*(part.tolist() for part in np.divmod(codes, 2)), strict=True):
        meaning = strips[owner].patch
        if meaning.junction and shared:
            meaning = junction_patch(meaning.junction, meaning.lane_type, "junction")
        numbers.append(index.setdefault(meaning, len(index)))
    patch[covered] = np.array(numbers, dtype=np.int64)[which]
    return Cover(lane, several, patch, tuple(index))


def _rank(patch: Patch) -> int:
    if patch.kind != "lane":
        return _RANKS_OF_KINDS[patch.kind]
    return _RANKS.get(patch.lane_type, _DRIVING_RANK)


def _winners(
    count: int, place: IntArray, strip: IntArray, strips: Sequence[Strip]
) -> tuple[IntArray, IntArray]:
    """Returns the lane strip of each face, and the number of roads with a lane of equal rank."""
    ranks = np.array([_rank(one.patch) for one in strips])
    outside = np.array([not one.patch.junction for one in strips])
    road = road_numbers(strips)
    order = np.lexsort((strip, -outside[strip].astype(int), -ranks[strip], place))
    place, strip = place[order], strip[order]
    first = np.flatnonzero(np.diff(place, prepend=-1))
    lane = np.full(count, -1)
    lane[place[first]] = strip[first]
    rival = ranks[strip] == ranks[lane[place]]
    roads = int(road.max(initial=0)) + 1
    pairs = ascending(place[rival] * roads + road[strip[rival]])
    return lane, np.bincount(pairs // roads, minlength=count)


def road_numbers(strips: Sequence[Strip]) -> IntArray:
    """Returns a number for each strip; strips of the same road share their number."""
    names = {name: k for k, name in enumerate(dict.fromkeys(one.patch.road for one in strips))}
    return np.array([names[one.patch.road] for one in strips], dtype=np.int64)

"""What each face of the arrangement is: the lane that wins there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.models.arrays import IntArray
from envgen_usd.models.surface import Patch
from envgen_usd.opendrive.arrangement import Faces
from envgen_usd.opendrive.cells import Cells
from envgen_usd.opendrive.names import nc_name
from envgen_usd.opendrive.strips import Strip

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
_RANKS_OF_KINDS = {"island": 6, "filler": -1, "junction": -2, "transition": -3}


@dataclass(frozen=True)
class Cover:
    """What covers each face.

    Attributes:
        lane: F, index of the strip of the winning lane, -1 where nothing lies.
        several: F, number of roads that have a lane of the winner's rank there.
        patch: F, index into `patches`, -1 where nothing lies.
        patches: What the faces mean.
    """

    lane: IntArray
    several: IntArray
    patch: IntArray
    patches: tuple[Patch, ...]


def cover_faces(faces: Faces, strips: Sequence[Strip]) -> Cover:
    """Chooses one lane for each face.

    Lanes to drive on win over others, then roads outside junctions over connecting roads. Where
    lanes of several connecting roads meet, the face belongs to the junction.

    Args:
        faces: Faces of the arrangement of all strips and marks.
        strips: Strips of lanes.
    """
    inner = shapely.get_coordinates(shapely.point_on_surface(np.array(faces.polygons)))
    place, strip = Cells(strips).covering(inner)
    lane, several = _winners(len(inner), place, strip, strips)
    index: dict[Patch, int] = {}
    patch = np.full(len(lane), -1)
    for face in np.flatnonzero(lane >= 0).tolist():
        meaning = strips[lane[face]].patch
        if meaning.junction and several[face] > 1:
            meaning = junction_patch(meaning.junction, meaning.lane_type, "junction")
        patch[face] = index.setdefault(meaning, len(index))
    return Cover(lane, several, patch, tuple(index))


def junction_patch(junction: str, lane_type: str, kind: str) -> Patch:
    """Area of a junction that no lane owns alone."""
    return Patch(
        id=f"junction_{nc_name(junction)}_{kind}_{nc_name(lane_type)}",
        kind=kind,
        lane_type=lane_type,
        junction=junction,
    )


def _rank(patch: Patch) -> int:
    if patch.kind != "lane":
        return _RANKS_OF_KINDS[patch.kind]
    return _RANKS.get(patch.lane_type, _DRIVING_RANK)


def _winners(
    count: int, place: IntArray, strip: IntArray, strips: Sequence[Strip]
) -> tuple[IntArray, IntArray]:
    """Winning lane strip of each face, and how many roads have a lane of its rank there."""
    ranks = np.array([_rank(one.patch) for one in strips])
    outside = np.array([not one.patch.junction for one in strips])
    road = road_numbers(strips)
    order = np.lexsort((strip, -outside[strip].astype(int), -ranks[strip], place))
    place, strip = place[order], strip[order]
    first = np.flatnonzero(np.diff(place, prepend=-1))
    lane = np.full(count, -1)
    lane[place[first]] = strip[first]
    rival = ranks[strip] == ranks[lane[place]]
    pairs = np.unique(np.column_stack([place[rival], road[strip[rival]]]), axis=0)
    return lane, np.bincount(pairs[:, 0], minlength=count)


def road_numbers(strips: Sequence[Strip]) -> IntArray:
    """A number for each strip that is the same for all strips of a road."""
    names = {name: k for k, name in enumerate(dict.fromkeys(one.patch.road for one in strips))}
    return np.array([names[one.patch.road] for one in strips], dtype=np.int64)

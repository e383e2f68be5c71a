"""What each face of the arrangement is: the lane that wins there, and the mark painted on it."""

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


@dataclass(frozen=True)
class Cover:
    """What covers each face.

    Attributes:
        lane: F, index of the strip of the winning lane, -1 where nothing lies.
        patch: F, index into `patches`, -1 where nothing lies.
        patches: What the faces mean.
    """

    lane: IntArray
    patch: IntArray
    patches: tuple[Patch, ...]


def cover_faces(faces: Faces, strips: Sequence[Strip]) -> Cover:
    """Chooses one lane for each face.

    Lanes to drive on win over others, then roads outside junctions over connecting roads. Where
    lanes of several connecting roads meet, the face belongs to the junction. A mark counts on its
    own road, and in a junction on its own lane only.
    """
    inner = shapely.get_coordinates(shapely.point_on_surface(np.array(faces.polygons)))
    place, strip = Cells(strips).covering(inner)
    is_mark = np.array([one.mark for one in strips], dtype=bool)[strip]
    lane, several = _winners(len(inner), place[~is_mark], strip[~is_mark], strips)
    mark = _marks(place[is_mark], strip[is_mark], lane, several, strips)
    return _patches(lane, several, mark, strips)


def _rank(patch: Patch) -> int:
    return -1 if patch.kind == "transition" else _RANKS.get(patch.lane_type, _DRIVING_RANK)


def _winners(
    count: int, place: IntArray, strip: IntArray, strips: Sequence[Strip]
) -> tuple[IntArray, IntArray]:
    """Winning lane strip of each face, and how many roads have a lane of its kind there."""
    kinds = np.array([_rank(one.patch) for one in strips])
    outside = np.array([not one.patch.junction for one in strips])
    names = {name: k for k, name in enumerate(dict.fromkeys(one.patch.road for one in strips))}
    road = np.array([names[one.patch.road] for one in strips])
    order = np.lexsort((strip, -outside[strip].astype(int), -kinds[strip], place))
    place, strip = place[order], strip[order]
    first = np.flatnonzero(np.diff(place, prepend=-1))
    lane = np.full(count, -1)
    lane[place[first]] = strip[first]
    rival = kinds[strip] == kinds[lane[place]]
    pairs = np.unique(np.column_stack([place[rival], road[strip[rival]]]), axis=0)
    return lane, np.bincount(pairs[:, 0], minlength=count)


def _marks(
    place: IntArray, strip: IntArray, lane: IntArray, several: IntArray, strips: Sequence[Strip]
) -> IntArray:
    """Mark strip of each face, -1 for none."""
    found = np.full(len(lane), -1)
    for face, mark in zip(place.tolist(), strip.tolist(), strict=True):
        under = lane[face]
        if under < 0 or strips[under].patch.road != strips[mark].patch.road:
            continue
        if strips[mark].patch.junction and several[face] > 1:
            continue
        found[face] = mark
    return found


def _patches(lane: IntArray, several: IntArray, mark: IntArray, strips: Sequence[Strip]) -> Cover:
    index: dict[Patch, int] = {}
    patch = np.full(len(lane), -1)
    for face in np.flatnonzero(lane >= 0).tolist():
        meaning = strips[lane[face]].patch
        if mark[face] >= 0:
            meaning = strips[mark[face]].patch
        elif meaning.junction and several[face] > 1:
            meaning = junction_patch(meaning.junction, meaning.lane_type, "junction")
        patch[face] = index.setdefault(meaning, len(index))
    return Cover(lane, patch, tuple(index))


def junction_patch(junction: str, lane_type: str, kind: str) -> Patch:
    """Area of a junction that no lane owns alone."""
    return Patch(
        id=f"junction_{nc_name(junction)}_{kind}_{nc_name(lane_type)}",
        kind=kind,
        lane_type=lane_type,
        junction=junction,
    )

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
_RANKS_OF_KINDS = {"junction": -1, "transition": -2, "mark": -3}
_LEAST_SHOWN = 0.7


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
    mark = _marks(faces, (place[is_mark], strip[is_mark]), (lane, several), strips)
    return _patches(lane, several, mark, strips)


def _rank(patch: Patch) -> int:
    if patch.kind != "lane":
        return _RANKS_OF_KINDS[patch.kind]
    return _RANKS.get(patch.lane_type, _DRIVING_RANK)


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
    faces: Faces,
    hits: tuple[IntArray, IntArray],
    under: tuple[IntArray, IntArray],
    strips: Sequence[Strip],
) -> IntArray:
    """Mark strip of each face, -1 for none.

    A mark lies on its own road only; in a junction it is left out where it would cross another
    road, and left out completely where most of it would.
    """
    (face, mark), (lane, several) = hits, under
    junction = np.array([bool(strip.patch.junction) for strip in strips])
    names = {name: k for k, name in enumerate(dict.fromkeys(one.patch.road for one in strips))}
    road = np.array([names[strip.patch.road] for strip in strips])
    good = (lane[face] >= 0) & (road[lane[face]] == road[mark])
    good &= ~junction[mark] | (several[face] <= 1)
    area = shapely.area(np.array(faces.polygons)[face])
    shown = np.bincount(mark, area * good, minlength=len(strips))
    whole = np.bincount(mark, area, minlength=len(strips))
    good &= ~junction[mark] | (shown > _LEAST_SHOWN * whole)[mark]
    found = np.full(len(lane), -1)
    found[face[good]] = mark[good]
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

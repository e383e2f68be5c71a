"""Which faces of the arrangement are painted."""

from collections.abc import Sequence

import numpy as np
import shapely

from envgen_usd.models.arrays import IntArray
from envgen_usd.models.surface import Patch
from envgen_usd.opendrive.arrangement import Faces
from envgen_usd.opendrive.cells import Cells
from envgen_usd.opendrive.cover import Cover, road_numbers
from envgen_usd.opendrive.strips import Strip

_LEAST_SHOWN = 0.7
_NEVER_PAINTED = {"sidewalk", "walking", "curb", "border"}


def paint_faces(
    faces: Faces, cover: Cover, strips: Sequence[Strip], marks: Sequence[Strip]
) -> Cover:
    """Gives the faces under marks to them; they keep the height of their lane.

    A lane's mark lies on its own road only; in a junction it is left out where it would cross
    another road, and left out completely where most of it would. Paint of objects holds on all
    lanes but those beside the carriageway.

    Args:
        faces: Faces of the arrangement of all strips and marks.
        cover: Lanes of the faces.
        strips: Strips of lanes.
        marks: Strips of marks.
    """
    if not marks:
        return cover
    inner = shapely.get_coordinates(shapely.point_on_surface(np.array(faces.polygons)))
    face, mark = Cells(marks).covering(inner)
    on_lane = cover.lane[face] >= 0
    face, mark = face[on_lane], mark[on_lane]
    shown = _shown(faces, cover, (face, mark), (strips, marks))
    index: dict[Patch, int] = {patch: k for k, patch in enumerate(cover.patches)}
    patch = cover.patch.copy()
    for at, number in zip(face[shown].tolist(), mark[shown].tolist(), strict=True):
        patch[at] = index.setdefault(marks[number].patch, len(index))
    return Cover(cover.lane, cover.several, patch, tuple(index))


def _shown(
    faces: Faces,
    cover: Cover,
    hits: tuple[IntArray, IntArray],
    both: tuple[Sequence[Strip], Sequence[Strip]],
) -> IntArray:
    """Which of the pairs (face, mark) are painted."""
    (face, mark), (strips, marks) = hits, both
    numbers = road_numbers([*strips, *marks])
    own = numbers[cover.lane[face]] == numbers[len(strips) :][mark]
    crossing = np.array([bool(one.patch.junction) for one in marks])[mark]
    own &= np.array([one.patch.kind != "island" for one in strips])[cover.lane[face]]
    own &= ~crossing | (cover.several[face] <= 1)
    area = shapely.area(np.array(faces.polygons)[face])
    visible = np.bincount(mark, area * own, minlength=len(marks))
    whole = np.bincount(mark, area, minlength=len(marks))
    own &= ~crossing | (visible > _LEAST_SHOWN * whole)[mark]
    free = np.array([one.patch.section < 0 for one in marks])[mark]
    kinds = np.array([one.patch.lane_type not in _NEVER_PAINTED for one in strips])
    return np.flatnonzero(np.where(free, kinds[cover.lane[face]], own))

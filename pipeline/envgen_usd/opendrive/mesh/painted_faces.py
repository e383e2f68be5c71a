"""Assigns faces of the arrangement to road marks and paint."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import shapely

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import IntArray
from envgen_usd.models.road_surface import KERB_STONE, Patch
from envgen_usd.opendrive.mesh.arrangement import Faces
from envgen_usd.opendrive.mesh.overlap_removal import Cover, road_numbers
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.strip_index import Cells

_LEAST_SHOWN = 0.7
"""Least visible share of a mark's area in a junction; below it the mark is left out."""
_NEVER_PAINTED = {"sidewalk", "walking", "curb", "border"}


def paint_faces(
    faces: Faces, cover: Cover, strips: Sequence[Strip], marks: Sequence[Strip]
) -> tuple[Cover, Counter[str]]:
    """Assigns the faces below marks to these; the faces keep the height of their lane.

    A lane's mark or kerb stone applies to its road only. In a junction, parts of marks on other
    roads are left out, and a mark with a visible share below `_LEAST_SHOWN` is dropped. Paint of
    objects applies to all lanes except those beside the carriageway.

    Args:
        faces: Faces of the arrangement of all strips and marks.
        cover: Assignment of the faces to lanes.
        strips: Strips of lanes.
        marks: Strips of marks.

    Returns:
        The cover with paint, and the number of marks left out in each junction.
    """
    if not marks:
        return cover, Counter()
    face, mark = Cells(marks).covering(faces.inner)
    on_lane = cover.lane[face] >= 0
    face, mark = face[on_lane], mark[on_lane]
    shown = _shown(faces, cover, (face, mark), (strips, marks))
    index: dict[Patch, int] = {patch: k for k, patch in enumerate(cover.patches)}
    patch = cover.patch.copy()
    seen, which = np.unique(mark[shown], return_inverse=True)
    numbers = [index.setdefault(marks[number].patch, len(index)) for number in seen.tolist()]
    # Pairs are sorted by mark within a face; the last covers the others.
    patch[face[shown]] = np.array(numbers, dtype=np.int64)[which]
    hidden = np.setdiff1d(mark, mark[shown]).tolist()
    left_out = Counter(
        marks[number].patch.junction for number in hidden if marks[number].patch.kind != KERB_STONE
    )
    del left_out[""]
    return Cover(cover.lane, cover.several, patch, tuple(index)), left_out


def hidden_marks(counts: Mapping[str, int]) -> Iterator[Issue]:
    """Yields an issue for each junction with marks that are left out."""
    for junction, count in sorted(counts.items()):
        yield Issue(
            "junction.hidden_mark",
            Severity.INFO,
            f"junction[id={junction}]",
            f"{count} lines and dashes of connecting roads lie across other roads",
            "left out",
        )


def _shown(
    faces: Faces,
    cover: Cover,
    hits: tuple[IntArray, IntArray],
    both: tuple[Sequence[Strip], Sequence[Strip]],
) -> IntArray:
    """Returns the indices of the pairs (face, mark) that are painted."""
    (face, mark), (strips, marks) = hits, both
    numbers = road_numbers([*strips, *marks])
    same_road = numbers[cover.lane[face]] == numbers[len(strips) :][mark]
    # A kerb stone is there wherever its sidewalk is; half a dash would be seen as a fault.
    stone = np.array([one.patch.kind == KERB_STONE for one in marks])[mark]
    crossing = np.array([bool(one.patch.junction) for one in marks])[mark] & ~stone
    same_road &= np.array([one.patch.kind != "island" for one in strips])[cover.lane[face]]
    same_road &= ~crossing | (cover.several[face] <= 1)
    area = shapely.area(faces.polygons[face])
    visible = np.bincount(mark, area * same_road, minlength=len(marks))
    whole = np.bincount(mark, area, minlength=len(marks))
    same_road &= ~crossing | (visible > _LEAST_SHOWN * whole)[mark]
    free = np.array([one.patch.section < 0 for one in marks])[mark] & ~stone
    kinds = np.array([one.patch.lane_type not in _NEVER_PAINTED for one in strips])
    return np.flatnonzero(np.where(free, kinds[cover.lane[face]], same_road))

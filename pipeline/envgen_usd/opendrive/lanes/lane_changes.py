"""Permission to change between adjacent lanes (11.9)."""

from itertools import pairwise

from envgen_usd.models.lanes import DRIVEN, Lane, LaneSection
from envgen_usd.models.road_marks import RoadMark

_CLOSED = frozenset({"solid", "curb", "grass", "edge"})
"""Line types that traffic may not cross."""
_SHORTEST = 1.0
"""Least length in metres of a mark, or of a gap between marks, that affects lane changes."""


def may_change(section: LaneSection, lane: Lane, other: Lane) -> bool:
    """Returns whether traffic may change to the adjacent lane somewhere in a section.

    Both lanes have to be for vehicles. ``laneChange`` of the mark between them decides. Without
    it, the nearer line of the mark decides: solid lines forbid the change.

    Args:
        section: Lane section of both lanes.
        lane: Lane before the change.
        other: Lane after the change.
    """
    if not {lane.type, other.type} <= DRIVEN:
        return False
    inner = min(lane, other, key=lambda each: abs(each.id))
    holder = section.centre if lane.id * other.id < 0 else inner
    starts = [section.s + mark.s_offset for mark in holder.marks]
    if not starts or starts[0] - section.s > _SHORTEST:
        return True
    lengths = [end - start for start, end in pairwise([*starts, section.end])]
    # In a short section, the longest mark or gap counts, however short.
    least = min(_SHORTEST, max(lengths))
    return any(
        length >= least and _allows(mark, lane, other, centre=holder is section.centre)
        for mark, length in zip(holder.marks, lengths, strict=True)
    )


def _allows(mark: RoadMark, lane: Lane, other: Lane, *, centre: bool) -> bool:
    if mark.lane_change in {"increase", "decrease", "both", "none"}:
        direction = "increase" if other.id > lane.id else "decrease"
        return mark.lane_change in {"both", direction}
    lines = [*mark.lines, *mark.explicit]
    if mark.type == "custom":
        return all(line.space > 0 and line.rule != "no passing" for line in lines)
    # A type lists its lines from the inside outwards, on the centre lane from left to right.
    first = lane.id > 0 if centre else abs(lane.id) < abs(other.id)
    kinds = mark.type.split() or ["none"]
    return kinds[0 if first else -1] not in _CLOSED

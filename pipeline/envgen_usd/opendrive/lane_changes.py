"""Whether traffic may change from one lane to the one beside it (11.9)."""

from itertools import pairwise

from envgen_usd.models.lanes import DRIVEN, Lane, LaneSection
from envgen_usd.models.road_marks import RoadMark

_CLOSED = frozenset({"solid", "curb", "grass", "edge"})
"""Types of lines that are not driven over."""
_SHORTEST = 1.0
"""Metres of a mark, or between marks, that count."""


def may_change(section: LaneSection, lane: Lane, other: Lane) -> bool:
    """Whether traffic may change from a lane to its neighbour anywhere in a section.

    Both have to be for vehicles. The mark between them says it by its ``laneChange``, and where
    that is missing by the line that is nearer to the lane: solid lines are not crossed.

    Args:
        section: Section of both.
        lane: Lane that is left.
        other: Lane beside it.
    """
    if not {lane.type, other.type} <= DRIVEN:
        return False
    inner = min(lane, other, key=lambda each: abs(each.id))
    holder = section.centre if lane.id * other.id < 0 else inner
    starts = [section.s + mark.s_offset for mark in holder.marks]
    if not starts or starts[0] - section.s > _SHORTEST:
        return True
    lengths = [end - start for start, end in pairwise([*starts, section.end])]
    # A mark that is shorter than what counts is all there is where the section is short, too.
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
    # Lines are named from the inside outwards, on the centre lane from left to right.
    first = lane.id > 0 if centre else abs(lane.id) < abs(other.id)
    kinds = mark.type.split() or ["none"]
    return kinds[0 if first else -1] not in _CLOSED

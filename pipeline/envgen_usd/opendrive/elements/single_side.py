"""Lane sections that hold for one side of the road only (singleSide, 11.3)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.models.cubics import NO_CUBICS, Cubics
from envgen_usd.models.lanes import Lane, LaneSection


def fill_single_sides(sections: Sequence[LaneSection], single: Sequence[bool]) -> list[LaneSection]:
    """Gives one-sided sections the lanes that go on beside them.

    Args:
        sections: Ascending.
        single: Whether each section is marked with singleSide.

    Returns:
        The sections; a side that a singleSide section leaves out is continued from the section
        before, with its offsets counted from the new section's start.
    """
    filled: list[LaneSection] = []
    for section, one_sided in zip(sections, single, strict=True):
        if not (one_sided and filled):
            filled.append(section)
            continue
        before = filled[-1]
        step = section.s - before.s
        left, right = section.left, section.right
        if not left and before.left:
            left, before = _go_on(before.left, step), replace(before, left=_cut(before.left))
        elif not right and before.right:
            right, before = _go_on(before.right, step), replace(before, right=_cut(before.right))
        filled[-1] = before
        filled.append(replace(section, left=left, right=right))
    return filled


def _cut(lanes: tuple[Lane, ...]) -> tuple[Lane, ...]:
    return tuple(replace(lane, successors=(lane.id,)) for lane in lanes)


def _go_on(lanes: tuple[Lane, ...], step: float) -> tuple[Lane, ...]:
    return tuple(
        replace(
            lane,
            width=_shift(lane.width, step),
            border=_shift(lane.border, step),
            height=lane.height - np.array([step, 0, 0]),
            speed=lane.speed - np.array([step, 0]),
            marks=tuple(replace(mark, s_offset=mark.s_offset - step) for mark in lane.marks),
            predecessors=(lane.id,),
        )
        for lane in lanes
    )


def _shift(cubics: Cubics, step: float) -> Cubics:
    if not len(cubics.start):
        return NO_CUBICS
    return Cubics(cubics.start - step, cubics.coefficients)

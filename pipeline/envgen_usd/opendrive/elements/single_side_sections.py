"""Lane sections for a single side of the road (singleSide, 11.3)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.models.cubics import NO_CUBICS, Cubics
from envgen_usd.models.lanes import Lane, LaneSection


def fill_single_sides(sections: Sequence[LaneSection], single: Sequence[bool]) -> list[LaneSection]:
    """Copies to singleSide sections the lanes that continue on the other side.

    Args:
        sections: Lane sections, ascending.
        single: Whether each section has the attribute singleSide.

    Returns:
        The sections. A side without lanes in a singleSide section continues the previous section;
        its offsets are relative to the new start.
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

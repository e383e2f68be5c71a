"""Lane sections with equal numbers of lanes, evaluated at once."""

from collections.abc import Sequence
from dataclasses import fields
from typing import TypeAlias

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.plan_view import PlanView
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.built_lanes import widest_lanes
from envgen_usd.opendrive.geometry.curve_evaluation import bends_at, evaluate_at
from envgen_usd.opendrive.geometry.stacked_cubics import StackedCubics, StackedStarts

Place: TypeAlias = tuple[Road, LaneSection]
"""A lane section and its road."""


class SectionStack:
    """N lane sections with equal numbers of lanes on either side of the centre.

    Attributes:
        places: N sections with their roads.
        start: N, metres, start of each section.
        end: N, metres, end of each section.
    """

    def __init__(self, places: Sequence[Place]) -> None:
        """Stacks sections.

        Args:
            places: At least one section; all have as many lanes left as the first, and right.
        """
        self.places = places
        self.start = np.array([section.s for _, section in places])
        self.end = np.array([section.end for _, section in places])
        roads = {id(road): road for road, _ in places}
        number = {key: k for k, key in enumerate(roads)}
        self._road: IntArray = np.array([number[id(road)] for road, _ in places])
        self._roads = list(roads.values())
        self._views = _joined([road.plan_view for road in self._roads])
        self._geometries = StackedStarts([road.plan_view.s for road in self._roads])
        self._offset = StackedCubics([road.lane_offset for road in self._roads])
        self._elevation = StackedCubics([road.elevation for road in self._roads])
        sections = [section for _, section in places]
        self._left = _stacked_lanes(sections, [section.left for section in sections])
        self._right = _stacked_lanes(sections, [section.right for section in sections])

    def borders(self, owner: IntArray, s: FloatArray) -> FloatArray:
        """Returns t of all borders from left to right, M x (L + 1), metres.

        Width has priority over border; negative widths count as zero, and `widest_lanes` holds.

        Args:
            owner: M, index of the section.
            s: M, metres along the reference line.
        """
        ds = s - self.start[owner]
        columns = [self._offset(self._road[owner], s)]
        for lane in self._left:
            columns.insert(0, lane.outer(owner, ds, columns[0], 1.0))
        for lane in self._right:
            columns.append(lane.outer(owner, ds, columns[-1], -1.0))
        return np.column_stack(columns)

    def heights(self, owner: IntArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns heights at the left and right border of each lane, M x L each, metres."""
        ds = s - self.start[owner]
        lanes = [*reversed(self._left), *self._right]
        at_left, at_right = np.zeros((2, len(s), len(lanes)))
        for column, lane in enumerate(lanes):
            if lane.is_raised:
                inner, outer = lane.heights(owner, ds)
                on_left = column < len(self._left)
                at_left[:, column] = outer if on_left else inner
                at_right[:, column] = inner if on_left else outer
        return at_left, at_right

    def line(self, owner: IntArray, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns x, y (metres) and heading (radians) of the reference line, M each."""
        return evaluate_at(self._views, self._geometry(owner, s), s)

    def bends(self, owner: IntArray, s: FloatArray) -> FloatArray:
        """Returns the curvature of the reference line as in `bends_at`, M, 1/m."""
        return bends_at(self._views, self._geometry(owner, s), s)

    def elevation(self, owner: IntArray, s: FloatArray) -> FloatArray:
        """Returns the elevation of the reference line, M, metres."""
        return self._elevation(self._road[owner], s)

    def _geometry(self, owner: IntArray, s: FloatArray) -> IntArray:
        return np.maximum(*self._geometries.last_before(self._road[owner], s))


class _StackedLane:
    """The lanes at the same place of N sections."""

    def __init__(self, lanes: Sequence[Lane], widest: FloatArray) -> None:
        self._widest = widest
        by_border = [len(lane.border.start) > 0 and not len(lane.width.start) for lane in lanes]
        self._by_border = np.array(by_border)
        self._has_border = any(by_border)
        self._width = StackedCubics([lane.width for lane in lanes])
        if self._has_border:
            self._border = StackedCubics([lane.border for lane in lanes])
        self.is_raised = any(len(lane.height) for lane in lanes)
        if self.is_raised:
            self._entries = StackedStarts([lane.height[:, 0] for lane in lanes])
            self._heights = np.concatenate([lane.height[:, 1:] for lane in lanes])

    def outer(self, owner: IntArray, ds: FloatArray, inner: FloatArray, sign: float) -> FloatArray:
        """Returns t of the outer border, which the sign says to be left (1) or right (-1)."""
        width = self._width(owner, ds)
        if self._has_border:
            beside = sign * (self._border(owner, ds) - inner)
            width = np.where(self._by_border[owner], beside, width)
        outer: FloatArray = inner + sign * np.clip(width, 0.0, self._widest[owner])
        return outer

    def heights(self, owner: IntArray, ds: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns inner and outer height, M each; constant from each entry to the next."""
        entry, first = self._entries.last_before(owner, ds + 1e-9)
        heights = np.where((entry >= first)[:, None], self._heights[np.maximum(entry, 0)], 0.0)
        return heights[:, 0], heights[:, 1]


def _stacked_lanes(
    sections: Sequence[LaneSection], sides: Sequence[tuple[Lane, ...]]
) -> list[_StackedLane]:
    """Stacks the lanes of one side of N sections, from the centre outwards."""
    pairs = zip(sections, sides, strict=True)
    widest = np.array([widest_lanes(section, lanes) for section, lanes in pairs])
    columns = zip(*sides, strict=True)
    return [_StackedLane(lanes, widest[:, place]) for place, lanes in enumerate(columns)]


def _joined(views: Sequence[PlanView]) -> PlanView:
    """Concatenates plan views; s ascends within each of them."""
    if len(views) == 1:
        return views[0]
    names = [field.name for field in fields(PlanView)]
    return PlanView(*(np.concatenate([getattr(each, name) for each in views]) for name in names))

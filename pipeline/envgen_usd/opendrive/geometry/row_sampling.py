"""Rows of a lane section at which the chord error stays below a tolerance."""

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanes import LaneSection
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.curve_evaluation import bend
from envgen_usd.opendrive.geometry.lane_borders import lane_borders, section_points

_PROBES = np.linspace(0.0, 1.0, 9)
_LONGEST_STEP = 50.0
"""Largest distance between rows in metres; a smaller value adds rows on straight roads."""
_MARGIN = 1.15
"""Factor on the number of rows; a larger value adds rows."""
_MOST_ROWS = 20_000
"""Largest number of rows of an interval; bounds the cost of hostile curves."""


def section_rows(road: Road, section: LaneSection, tolerance: float) -> FloatArray:
    """Returns the rows of a section: all knots of its polynomials, and rows by curvature between.

    A chord over a step h of a curve p has an error of at most ``max |p''| h² / 8``.

    Args:
        road: The road.
        section: A lane section of the road with positive length.
        tolerance: Largest chord error in metres; a larger value gives fewer rows.

    Returns:
        N ascending s, N >= 2, metres, from the section's start to its end.
    """
    knots = _knots(road, section)
    start, span = knots[:-1], np.diff(knots)
    probes = start[:, None] + span[:, None] * _PROBES
    steps = np.sqrt(_bend_of_borders(road, section, probes, span) * span**2 / (8 * tolerance))
    steps = np.maximum(np.ceil(steps * _MARGIN), np.ceil(span / _LONGEST_STEP))
    steps = np.clip(steps, 1, _MOST_ROWS).astype(np.int64)
    first = np.cumsum(steps) - steps
    owner = np.repeat(np.arange(len(span)), steps)
    part = (np.arange(len(owner)) - first[owner]) / steps[owner]
    return np.append(start[owner] + part * span[owner], knots[-1])


def _knots(road: Road, section: LaneSection) -> FloatArray:
    lanes = (*section.left, *section.right)
    relative = [lane.width.start for lane in lanes]
    relative += [lane.border.start for lane in lanes]
    relative += [lane.height[:, 0] for lane in lanes]
    absolute = [
        road.plan_view.s,
        road.elevation.start,
        road.superelevation.start,
        road.lane_offset.start,
        np.empty(0) if road.shapes is None else road.shapes.s,
    ]
    inside = np.concatenate([*absolute, *(part + section.s for part in relative)])
    inside = np.unique(inside[(inside > section.s) & (inside < section.end)])
    apart = np.diff(inside, prepend=section.s) > 1e-3
    inside = inside[apart & (section.end - inside > 1e-3)]
    return np.concatenate([[section.s], inside, [section.end]])


def _bend_of_borders(
    road: Road, section: LaneSection, probes: FloatArray, span: FloatArray
) -> FloatArray:
    """Returns the largest second derivative of all borders in each interval.

    Numerical second differences cover every cause of a bent border. The curvature of the reference
    line guards against aliasing over long turns.
    """
    flat = np.clip(probes.ravel(), section.s, np.nextafter(section.end, section.s))
    t = lane_borders(road, section, flat).t
    points = section_points(road, section, flat, t).reshape(*probes.shape, -1, 3)
    second = points[:, :-2] - 2 * points[:, 1:-1] + points[:, 2:]
    step = np.maximum(span / (len(_PROBES) - 1), 1e-6)
    measured: FloatArray = np.linalg.norm(second, axis=-1).max(axis=(1, 2)) / step**2
    reach = np.abs(t).max() if t.size else 0.0
    curvature = bend(road.plan_view, flat).reshape(probes.shape).max(axis=1)
    least = curvature * (1 + np.minimum(curvature * reach, 4.0))
    worst: FloatArray = np.maximum(measured, least)
    return worst

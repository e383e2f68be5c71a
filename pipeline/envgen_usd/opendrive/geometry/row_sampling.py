"""Rows of a lane section at which the chord error stays below a tolerance."""

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.lanes import LaneSection
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.curve_evaluation import bend
from envgen_usd.opendrive.geometry.lane_borders import (
    LaneBorders,
    lane_borders,
    section_points,
)

_PARTS = 8
"""Parts of an interval between knots; each has a density of rows of its own."""
_PROBES = np.linspace(0.0, 1.0, _PARTS + 1)
_BESIDE = np.clip(np.arange(_PARTS)[:, None] + np.arange(-2, 2), 0, _PARTS - 2)
"""Inner probes that count for each part."""
_LONGEST_STEP = 50.0
"""Largest distance between rows in metres; a smaller value adds rows on straight roads."""
_MARGIN = 1.2
"""Factor on the number of rows; a larger value adds rows."""
_OF_KNOTS = 0.25
"""Share of the tolerance that leaving out knots may use up; a larger value gives fewer rows."""
_MOST_ROWS = 20_000
"""Largest number of rows of an interval; bounds the cost of hostile curves."""


def section_rows(road: Road, section: LaneSection, tolerance: float) -> FloatArray:
    """Returns the rows of a section: by curvature, and at the knots of its polynomials.

    A chord over a step h of a curve p has an error of at most ``max |p''| h² / 8``. Knots without
    effect on the shape are left out.

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
    flat = np.clip(probes.ravel(), section.s, np.nextafter(section.end, section.s))
    borders = lane_borders(road, section, flat)
    points = section_points(road, section, flat, borders.t)
    part = span[:, None] / _PARTS
    curvature = bend(road.plan_view, flat).reshape(probes.shape)
    bends = _bends(points.reshape(*probes.shape, -1, 3), borders.t, curvature, part)
    steps = part * np.sqrt(bends / (8 * tolerance))
    reached = np.cumsum(np.maximum(steps * _MARGIN, part / _LONGEST_STEP), axis=1)
    count = np.clip(np.ceil(reached[:, -1]), 1, _MOST_ROWS)
    share = np.column_stack([np.zeros(len(span)), reached]) * (count / reached[:, -1])[:, None]
    first = np.cumsum(count) - count
    rows = np.interp(np.arange(count.sum()), (first[:, None] + share).ravel(), probes.ravel())
    rows[first.astype(np.int64)] = start
    errors = np.where(count > 1, np.inf, tolerance * steps.sum(axis=1) ** 2)
    if (np.maximum(errors[:-1], errors[1:]) < tolerance * _OF_KNOTS).any():
        tops = _tops(points, borders)[np.r_[0 : len(flat) : len(_PROBES), len(flat) - 1]]
        gone = _needless(knots, tops, errors, tolerance * _OF_KNOTS)
        rows = np.delete(rows, first[gone].astype(np.int64))
    return np.append(rows, knots[-1])


def _tops(points: FloatArray, borders: LaneBorders) -> FloatArray:
    """Returns the borders (N x B x 3) of all lanes at their heights."""
    if not (borders.height_left.any() or borders.height_right.any()):
        return points
    left, right = points[:, :-1].copy(), points[:, 1:].copy()
    left[..., 2] += borders.height_left
    right[..., 2] += borders.height_right
    return np.concatenate([points, left, right], axis=1)


def _needless(
    knots: FloatArray, points: FloatArray, errors: FloatArray, tolerance: float
) -> IntArray:
    """Returns inner knots that can go, as the chords around them stay within the tolerance.

    Args:
        knots: K + 1, metres.
        points: K + 1 x B x 3, metres, borders at the knots.
        errors: K, metres, error of the chord between two knots; infinite if rows lie between.
        tolerance: Largest error in metres.
    """
    ready = np.maximum(errors[:-1], errors[1:]) < tolerance
    ready[ready] = _off(points[:-2][ready], points[1:-1][ready], points[2:][ready]) <= tolerance
    if not ready.any():
        return np.empty(0, dtype=np.int64)
    kept, idle, offset = np.arange(len(knots)), 0, 1
    errors = errors.copy()
    while idle < 2 and len(kept) > 2:
        # Every second knot is tested at a time, so that no two neighbours go at once.
        place = np.arange(offset, len(kept) - 1, 2)
        before, here, after = (kept[place + k] for k in (-1, 0, 1))
        sum_of = np.maximum(errors[before], errors[here])
        close = (sum_of < tolerance) & (knots[after] - knots[before] <= _LONGEST_STEP)
        place, before, here, after = (part[close] for part in (place, before, here, after))
        error = _off(points[before], points[here], points[after]) + sum_of[close]
        goes = error <= tolerance
        errors[before[goes]] = error[goes]
        kept = np.delete(kept, place[goes])
        idle = 0 if goes.any() else idle + 1
        offset = 3 - offset
    gone = np.ones(len(knots), dtype=bool)
    gone[kept] = False
    return np.flatnonzero(gone)


def _off(before: FloatArray, here: FloatArray, after: FloatArray) -> FloatArray:
    """Returns the largest distance of points (N x B x 3) from the chords beside them, N."""
    chord, apart = after - before, here - before
    share = (apart * chord).sum(-1) / np.maximum((chord * chord).sum(-1), 1e-12)
    across = apart - share[..., None] * chord
    off: FloatArray = np.sqrt((across * across).sum(-1).max(axis=1, initial=0.0))
    return off


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


def _bends(
    points: FloatArray, t: FloatArray, curvature: FloatArray, part: FloatArray
) -> FloatArray:
    """Returns the largest second derivative of all borders around each part, K x 8, 1/m.

    Numerical second differences cover every cause of a bent border. What they have along the border
    leaves its shape alone. The curvature of the reference line guards against aliasing over long
    turns.

    Args:
        points: K x 9 x B x 3, metres, borders at the probes.
        t: Of all borders at all probes, metres.
        curvature: K x 9, of the reference line at the probes, 1/m.
        part: K x 1, metres between two probes.
    """
    second = points[:, :-2] - 2 * points[:, 1:-1] + points[:, 2:]
    along = points[:, 2:] - points[:, :-2]
    along /= np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-12)
    second -= (second * along).sum(axis=-1, keepdims=True) * along
    measured = np.linalg.norm(second, axis=-1).max(axis=2, initial=0.0)
    measured /= np.maximum(part, 1e-6) ** 2
    reach = np.abs(t).max() if t.size else 0.0
    curvature = curvature.max(axis=1, keepdims=True)
    least = curvature * (1 + np.minimum(curvature * reach, 4.0))
    # A part lies between two probes; the part before and the part after count as well.
    beside = measured[:, _BESIDE].max(axis=2)
    bends: FloatArray = np.maximum(beside, least)
    return bends

"""Rows of lane sections at which the chord error stays below a tolerance."""

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.lanes import LaneSection
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.lane_borders import stacked_points
from envgen_usd.opendrive.geometry.section_stack import SectionStack

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
    """Returns the rows of a single section; see `stacked_rows`.

    Returns:
        N ascending s, N >= 2, metres, from the section's start to its end.
    """
    _, rows = stacked_rows(SectionStack([(road, section)]), tolerance)
    return rows


def stacked_rows(stack: SectionStack, tolerance: float) -> tuple[IntArray, FloatArray]:
    """Returns the rows of all sections: by curvature, and at the knots of their polynomials.

    A chord over a step h of a curve p has an error of at most ``max |p''| h² / 8``. Knots without
    effect on the shape are left out.

    Args:
        stack: Lane sections of positive length.
        tolerance: Largest chord error in metres; a larger value gives fewer rows.

    Returns:
        The sections of the rows, ascending, and s of the rows in metres. Within a section, s
        ascends from its start to its end.
    """
    owner_of_knot, knots = _knots(stack)
    inner = owner_of_knot[1:] == owner_of_knot[:-1]
    begin = np.flatnonzero(inner)
    owner, start = owner_of_knot[begin], knots[begin]
    span = knots[begin + 1] - start
    probes = start[:, None] + span[:, None] * _PROBES
    # At a knot, the next polynomial begins, so the last probe lies just before it.
    flat = np.minimum(probes, np.nextafter(knots[begin + 1], start)[:, None]).ravel()
    of_probe = np.repeat(owner, len(_PROBES))
    t = stack.borders(of_probe, flat)
    points = stacked_points(stack, of_probe, flat, t)
    part = span[:, None] / _PARTS
    curvature = stack.bends(of_probe, flat).reshape(probes.shape)
    borders = points.reshape(*probes.shape, -1, 3)
    bends = _bends(_with_jumps(borders, owner, tolerance), _reach(t, owner), curvature, part)
    steps = part * np.sqrt(bends / (8 * tolerance))
    reached = np.cumsum(np.maximum(steps * _MARGIN, part / _LONGEST_STEP), axis=1)
    count = np.clip(np.ceil(reached[:, -1]), 1, _MOST_ROWS)
    share = np.column_stack([np.zeros(len(span)), reached]) * (count / reached[:, -1])[:, None]
    first = np.cumsum(count) - count
    rows = np.interp(np.arange(count.sum()), (first[:, None] + share).ravel(), probes.ravel())
    place = first.astype(np.int64)
    rows[place] = start
    errors = np.full(len(knots) - 1, np.inf)
    single = count == 1
    errors[begin[single]] = tolerance * steps[single].sum(axis=1) ** 2
    kept = np.ones(len(rows), dtype=bool)
    if (np.maximum(errors[:-1], errors[1:]) < tolerance * _OF_KNOTS).any():
        # A knot is the first probe of its interval; that at a section's end is the last probe.
        probe = np.cumsum(np.append(0, inner)) * len(_PROBES)
        probe[~np.append(inner, False)] -= 1
        tops = _tops(points[probe], *stack.heights(of_probe[probe], flat[probe]))
        gone = _needless(owner_of_knot, knots, tops, errors, tolerance * _OF_KNOTS)
        kept[place[np.searchsorted(begin, gone)]] = False
    owner_of_row = np.repeat(owner, count.astype(np.int64))[kept]
    ends = np.searchsorted(owner_of_row, np.arange(len(stack.end)), side="right")
    return (
        np.insert(owner_of_row, ends, np.arange(len(stack.end))),
        np.insert(rows[kept], ends, stack.end),
    )


def _with_jumps(points: FloatArray, owner: IntArray, tolerance: float) -> FloatArray:
    """Ends an interval (K x 9 x B x 3, metres) where the next one starts if borders jump there.

    The jump then counts as a bend, so that its height spreads over a short distance only.
    """
    jump = _norm(points[1:, 0] - points[:-1, -1]).max(axis=1, initial=0.0)
    jumps = np.flatnonzero((jump > tolerance) & (owner[1:] == owner[:-1]))
    if len(jumps):
        points = points.copy()
        points[jumps, -1] = points[jumps + 1, 0]
    return points


def _reach(t: FloatArray, owner: IntArray) -> FloatArray:
    """Returns for each interval the largest distance of its section's borders from the line.

    Args:
        t: Of the borders at all probes of all K intervals, metres.
        owner: K, ascending, section of the interval.
    """
    reach = np.abs(t).max(axis=1).reshape(len(owner), -1).max(axis=1)
    new = np.append(True, owner[1:] != owner[:-1])
    farthest: FloatArray = np.maximum.reduceat(reach, np.flatnonzero(new))[np.cumsum(new) - 1]
    return farthest


def _tops(points: FloatArray, at_left: FloatArray, at_right: FloatArray) -> FloatArray:
    """Returns the borders (N x B x 3) of all lanes at their heights (N x L at either border)."""
    if not (at_left.any() or at_right.any()):
        return points
    left, right = points[:, :-1].copy(), points[:, 1:].copy()
    left[..., 2] += at_left
    right[..., 2] += at_right
    return np.concatenate([points, left, right], axis=1)


def _needless(
    owner: IntArray, knots: FloatArray, points: FloatArray, errors: FloatArray, tolerance: float
) -> IntArray:
    """Returns inner knots that can go, as the chords around them stay within the tolerance.

    Args:
        owner: K + 1, ascending, section of the knot.
        knots: K + 1, metres.
        points: K + 1 x B x 3, metres, borders at the knots.
        errors: K, metres, error of the chord between two knots; infinite if rows lie between,
            and between two sections.
        tolerance: Largest error in metres.
    """
    ready = np.maximum(errors[:-1], errors[1:]) < tolerance
    ready[ready] = _off(points[:-2][ready], points[1:-1][ready], points[2:][ready]) <= tolerance
    if not ready.any():
        return np.empty(0, dtype=np.int64)
    kept, idle, offset = np.arange(len(knots)), 0, 1
    errors = errors.copy()
    while idle < 2 and len(kept) > 2:
        # Every second knot of a section is tested at a time, so that no two neighbours go at once.
        rank = np.arange(len(kept)) - np.searchsorted(owner[kept], owner[kept])
        place = np.flatnonzero((rank - offset) % 2 == 0)
        place = place[(place > 0) & (place < len(kept) - 1)]
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
    share = _dot(apart, chord) / np.maximum(_dot(chord, chord), 1e-12)
    off: FloatArray = _norm(apart - share[..., None] * chord).max(axis=1, initial=0.0)
    return off


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Returns scalar products of vectors (... x 3); NumPy's sums over short axes take longer."""
    product: FloatArray = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
    return product


def _norm(vectors: FloatArray) -> FloatArray:
    norm: FloatArray = np.sqrt(_dot(vectors, vectors))
    return norm


def _knots(stack: SectionStack) -> tuple[IntArray, FloatArray]:
    """Returns the sections of knots, ascending, and the ascending s of knots in each section."""
    starts: list[FloatArray] = []
    owners: list[int] = []
    from_section: list[bool] = []
    for number, (road, section) in enumerate(stack.places):
        lanes = (*section.left, *section.right)
        relative = [
            *(lane.width.start for lane in lanes),
            *(lane.border.start for lane in lanes if len(lane.border.start)),
            *(lane.height[:, 0] for lane in lanes if len(lane.height)),
        ]
        absolute = [road.plan_view.s, road.elevation.start, road.superelevation.start]
        absolute += [road.lane_offset.start, *([] if road.shapes is None else [road.shapes.s])]
        starts += [*relative, *absolute]
        from_section += [True] * len(relative) + [False] * len(absolute)
        owners += [number] * (len(relative) + len(absolute))
    counts = [len(each) for each in starts]
    owner = np.repeat(owners, counts)
    knots = np.concatenate(starts)
    knots += np.where(np.repeat(from_section, counts), stack.start[owner], 0.0)
    inside = (knots > stack.start[owner]) & (knots < stack.end[owner])
    every = np.arange(len(stack.start))
    owner = np.concatenate([every, owner[inside], every])
    knots = np.concatenate([stack.start, knots[inside], stack.end])
    order = np.lexsort([knots, owner])
    owner, knots = owner[order], knots[order]
    is_end = np.append(owner[1:] != owner[:-1], True)
    is_start = np.append(True, is_end[:-1])
    near = (np.diff(knots, prepend=0.0) <= 1e-3) | (stack.end[owner] - knots <= 1e-3)
    kept = is_start | is_end | ~near
    return owner[kept], knots[kept]


def _bends(
    points: FloatArray, reach: FloatArray, curvature: FloatArray, part: FloatArray
) -> FloatArray:
    """Returns the largest second derivative of all borders around each part, K x 8, 1/m.

    Numerical second differences cover every cause of a bent border. What they have along the border
    leaves its shape alone. The curvature of the reference line guards against aliasing over long
    turns.

    Args:
        points: K x 9 x B x 3, metres, borders at the probes.
        reach: K, metres, largest distance of the section's borders from the reference line.
        curvature: K x 9, of the reference line at the probes, 1/m.
        part: K x 1, metres between two probes.
    """
    second = points[:, :-2] - 2 * points[:, 1:-1] + points[:, 2:]
    along = points[:, 2:] - points[:, :-2]
    along /= np.maximum(_norm(along), 1e-12)[..., None]
    second -= _dot(second, along)[..., None] * along
    measured = _norm(second).max(axis=2, initial=0.0)
    measured /= np.maximum(part, 1e-6) ** 2
    curvature = curvature.max(axis=1, keepdims=True)
    least = curvature * (1 + np.minimum(curvature * reach[:, None], 4.0))
    # A part lies between two probes; the part before and the part after count as well.
    beside = measured[:, _BESIDE].max(axis=2)
    bends: FloatArray = np.maximum(beside, least)
    return bends

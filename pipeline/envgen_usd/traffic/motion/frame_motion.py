"""Samples of a trace ─► places and headings frame by frame."""

import math
from dataclasses import dataclass

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.actors import Actor, Trace
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

LEAST_RATE = 10.0
"""Frames a second below which a trace is refined. Between frames, actors move in straight lines: a
smaller value lets them cut corners."""
MOST_RATE = 60.0
"""Frames a second to which denser traces are thinned; a larger value makes larger files."""
_LONGEST_GAP = 1.0
"""Seconds without a sample after which an actor is gone, unless the trace is coarser."""
_GAP_STEPS = 5.0
"""Steps of the trace without a sample after which an actor is gone, if that is longer."""
_FIRST_HOUR = 1e6
"""Seconds; times of traces that begin later count from their begin."""
_SLACK = 1e-6
"""Frames by which a sample may miss its frame, because times have few decimals."""
_SIDEWAYS = math.cos(math.radians(45.0))
"""Cosine between heading and motion below which the motion gives the tangent of the path."""


@dataclass(frozen=True)
class FrameGrid:
    """Times of frames: frame f is at f / rate seconds after `begin`.

    Attributes:
        rate: Frames a second.
        begin: Time of frame 0 in the trace, seconds.
        step: Longest usual time between samples, seconds.
    """

    rate: float
    begin: float
    step: float


@dataclass(frozen=True)
class PlanPath:
    """An actor on the plan, frame by frame.

    Attributes:
        frames: N, ascending.
        places: N x 3, metres; the height is NaN where the trace gives none.
        headings: N, radians, unwrapped.
    """

    frames: IntArray
    places: FloatArray
    headings: FloatArray


def frame_grid(trace: Trace) -> tuple[FrameGrid, tuple[Issue, ...]]:
    """Returns the frames of a trace, and an issue where they are not those of its samples."""
    rate, issues = trace.rate, []
    if rate < LEAST_RATE:
        rate *= math.ceil(LEAST_RATE / rate - 1e-9)
        issues.append(_note(trace, rate, "curves between the samples follow the headings"))
    elif rate > MOST_RATE:
        rate /= math.ceil(rate / MOST_RATE - 1e-9)
        issues.append(_note(trace, rate, "samples between the frames are left out"))
    first = min(float(actor.times[0]) for actor in trace.actors)
    begin = 0.0
    if abs(first) > _FIRST_HOUR:
        begin = first
        text = f"begins at {first:.3f} s"
        issues.append(Issue("traffic.begin", Severity.INFO, trace.source, text, "is frame 0"))
    return FrameGrid(rate, begin, 1.0 / trace.rate), tuple(issues)


def _note(trace: Trace, rate: float, done: str) -> Issue:
    text = f"has {trace.rate:.4g} samples a second"
    return Issue(
        "traffic.rate", Severity.INFO, trace.source, text, f"{rate:.4g} frames a second; {done}"
    )


def on_frames(actor: Actor, grid: FrameGrid) -> PlanPath:
    """Returns where an actor is in each frame between its samples, without its gaps."""
    at = (actor.times - grid.begin) * grid.rate
    limit = max(_LONGEST_GAP, _GAP_STEPS * grid.step) * grid.rate
    first, last = math.ceil(at[0] - _SLACK), math.floor(at[-1] + _SLACK)
    frames = np.arange(first, max(last, first) + 1)
    after = np.clip(np.searchsorted(at, frames - _SLACK), 1, max(len(at) - 1, 1))
    places = np.full((len(actor.times), 3), np.nan)
    places[:, : actor.positions.shape[1]] = actor.positions
    if len(at) == 1:
        return PlanPath(frames, places, actor.headings)
    share = np.clip((frames - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)
    headings = np.interp(frames, at, actor.headings)
    if grid.step * grid.rate > 1.5:
        moved = _curved(actor, places, after, share, limit / grid.rate)
    else:
        moved = places[after - 1] + share[:, None] * (places[after] - places[after - 1])
    there = (at[after] - at[after - 1] <= limit) | (share == 0.0) | (share == 1.0)
    return PlanPath(frames[there], moved[there], headings[there])


def _curved(
    actor: Actor, places: FloatArray, after: IntArray, share: FloatArray, longest: float
) -> FloatArray:
    """Places on cubic Hermite curves whose tangents follow headings and speeds."""
    times = actor.times
    steps = np.diff(times)
    speeds = np.diff(places, axis=0) / steps[:, None]
    speeds[steps > longest] = 0.0
    weight = np.concatenate([[0.0], steps, [0.0]])[:, None]
    padded = np.concatenate([speeds[:1], speeds, speeds[-1:]])
    # Each chord counts by the length of the other: exact for constant acceleration.
    mean = (padded[:-1] * weight[1:] + padded[1:] * weight[:-1]) / (weight[1:] + weight[:-1])
    ahead = np.stack([np.cos(actor.headings), np.sin(actor.headings)], axis=1)
    plain = np.hypot(mean[:, 0], mean[:, 1])
    along = (mean[:, :2] * ahead).sum(axis=1)
    straight = np.abs(along) >= _SIDEWAYS * plain
    mean[straight, :2] = (np.sign(along) * plain)[straight, None] * ahead[straight]
    u = share[:, None]
    step = steps[after - 1][:, None]
    start, end = places[after - 1], places[after]
    curve: FloatArray = (
        (1 + 2 * u) * (1 - u) ** 2 * start
        + u * (1 - u) ** 2 * step * mean[after - 1]
        + u**2 * (3 - 2 * u) * end
        - u**2 * (1 - u) * step * mean[after]
    )
    return curve


def stretches(frames: IntArray) -> tuple[tuple[int, int], ...]:
    """Returns the first and last frame of each stretch of frames without a gap."""
    breaks: BoolArray = np.diff(frames) > 1
    first = frames[np.concatenate([[True], breaks])]
    last = frames[np.concatenate([breaks, [True]])]
    return tuple(zip(first.tolist(), last.tolist(), strict=True))


def travelled(path: PlanPath) -> FloatArray:
    """Returns the metres since the first frame, N; motion against the heading counts less."""
    step = np.diff(path.places[:, :2], axis=0)
    middle = (path.headings[1:] + path.headings[:-1]) / 2
    forward = step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle)
    length = np.hypot(step[:, 0], step[:, 1]) * np.where(forward < 0.0, -1.0, 1.0)
    # A jump over a gap is no way.
    length[np.diff(path.frames) > 1] = 0.0
    return np.concatenate([[0.0], np.cumsum(length)])

"""Rows of a trace, in any order of actors ─► `Trace`; faulty rows are left out by name."""

from collections.abc import Mapping, Sequence

import numpy as np

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.actors import Actor, Trace
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.traffic.traces.actor_kinds import ActorFacts

_FARTHEST = 1e8
"""Largest coordinate, metres; a larger number is no place on a map."""
_FASTEST = 100.0
"""Speed in m/s that no road user has; a larger value calls fewer jumps an issue."""
_GAP = 1.0
"""Seconds after which an actor is gone until its next sample, which may be anywhere."""


def trace_of_rows(
    ids: Sequence[str],
    rows: FloatArray,
    facts: Mapping[str, ActorFacts],
    source: str,
    issues: Sequence[Issue] = (),
) -> Trace:
    """Sorts rows by actor and checks their times and places.

    Args:
        ids: N, actor of each row.
        rows: N x 5, time (s), x, y, z (metres, road frame; NaN without a height) and heading
            (radians), in the order of the source.
        facts: Kind and size of each actor.
        source: Name of the file.
        issues: What is known before.

    Raises:
        EnvgenError: No row is left.
    """
    found: list[Issue] = list(issues)
    # Not np.unique: texts of NumPy lose zeros at their end.
    number_of = {name: number for number, name in enumerate(dict.fromkeys(ids))}
    owner = np.array([number_of[name] for name in ids], dtype=np.int64)
    number = np.abs(rows[:, [0, 1, 2, 4]])
    sound: BoolArray = np.all(np.isfinite(number) & (number < _FARTHEST * 100), axis=1)
    if not sound.all():
        text = f"{np.count_nonzero(~sound)} rows without a time, a place or a heading"
        found.append(_issue("traffic.broken_rows", source, text, "left out"))
    actors = []
    ends = np.cumsum(np.bincount(owner, minlength=len(number_of)))
    by_actor = np.split(np.argsort(owner, kind="stable"), ends[:-1])
    for name, places in zip(number_of, by_actor, strict=False):  # without rows a part, and no name
        own = rows[places[sound[places]]]
        kept, faults = _in_time(own, f"{source}: actor {name}")
        found += faults
        if len(kept):
            actors.append(_actor(name, kept, facts[name]))
    if not actors:
        raise EnvgenError(f"{source}: no actor has a time, a place and a heading")
    return Trace(tuple(actors), sample_rate(actors), source, tuple(found))


def _in_time(rows: FloatArray, where: str) -> tuple[FloatArray, list[Issue]]:
    """The rows of an actor in the order of their times, one for each; what was wrong with them."""
    issues: list[Issue] = []
    if np.any(np.diff(rows[:, 0]) < 0.0):
        text = "its samples are not in the order of their times"
        issues.append(_issue("traffic.time", where, text, "sorted"))
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
    again = np.diff(rows[:, 0], prepend=-np.inf) <= 0.0
    if again.any():
        text = f"{np.count_nonzero(again)} samples at times that it has already; do two actors "
        text += "share its id?"
        issues.append(_issue("traffic.time", where, text, "the first at each time is kept"))
        rows = rows[~again]
    seconds = np.diff(rows[:, 0])
    ways = np.linalg.norm(np.diff(rows[:, 1:3], axis=0), axis=1)
    jumps = np.flatnonzero((ways > _FASTEST * seconds) & (seconds <= _GAP))
    if len(jumps):
        first = jumps[0]
        text = f"{len(jumps)} jumps faster than {_FASTEST:g} m/s, the first of {ways[first]:.0f} m "
        text += f"at {rows[first, 0]:g} s"
        issues.append(_issue("traffic.jump", where, text, "kept"))
    return rows, issues


def _actor(name: str, rows: FloatArray, facts: ActorFacts) -> Actor:
    flat = np.isnan(rows[:, 3]).all()
    places = rows[:, 1:3] if flat else rows[:, 1:4]
    headings = np.unwrap(rows[:, 4])
    return Actor(name, facts.kind, *facts.size, rows[:, 0], places, headings, facts.model)


def sample_rate(actors: Sequence[Actor]) -> float:
    """Returns the samples a second of a trace, Hz: one by the median step of its actors."""
    steps = np.concatenate([np.diff(actor.times) for actor in actors])
    if not len(steps):
        return 1.0
    rate = 1.0 / float(np.median(steps))
    whole = round(rate)
    return float(whole) if whole and abs(rate - whole) < 0.01 * rate else rate


def _issue(kind: str, where: str, text: str, action: str) -> Issue:
    return Issue(kind, Severity.WARNING, where, text, action)

"""Leads simulated people around objects on sidewalks, of which the simulation knows nothing."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.models.actors import Actor, Obstacle, Trace
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

_OFFSETS = np.array([0.0, 0.3, -0.3, 0.6, -0.6, 0.9, -0.9, 1.2, -1.2, 1.5, -1.5])
"""Metres beside the simulated way, to the left."""
_BODY = 0.35
"""Metres that a person keeps from objects; a larger value leads them farther around."""
_HIT, _AWAY, _TURN = 50.0, 0.1, 2.0
"""Costs of a frame inside an object, of a metre beside the way, and of a metre of sideways step."""
_SECONDS = 1.6
"""Time in which a sidestep is made; a larger value makes it gentler."""


def sidestepped(trace: Trace, obstacles: Sequence[Obstacle]) -> Trace:
    """Returns the trace with people who walk around obstacles where there is room.

    1. The cheapest sequence of offsets beside the way is found (Viterbi 1967), where the frames
       around a hit count as hits, too.
    2. A mean over time makes steps of it.

    Args:
        trace: Simulated actors.
        obstacles: What is in the way.
    """
    if not obstacles:
        return trace
    shapes = shapely.buffer([shapely.Polygon(each.outline) for each in obstacles], _BODY)
    tree = shapely.STRtree(shapes)
    actors = [
        _led(actor, tree, trace.rate) if actor.kind == "pedestrian" else actor
        for actor in trace.actors
    ]
    return replace(trace, actors=tuple(actors))


def _led(actor: Actor, tree: shapely.STRtree, rate: float) -> Actor:
    left = np.stack([-np.sin(actor.headings), np.cos(actor.headings)], axis=1)
    ways = actor.positions[:, None, :2] + _OFFSETS[:, None] * left[:, None]
    hit = np.zeros(ways.shape[:2], dtype=bool)
    places = shapely.points(ways.reshape(-1, 2))
    hit.reshape(-1)[tree.query(places, predicate="within")[0]] = True
    if not hit[:, 0].any():
        return actor
    window = max(round(_SECONDS * rate), 1)
    chosen = _OFFSETS[_cheapest(_spread(hit, window // 2 + 1))]
    padded = np.pad(chosen, (window // 2, window - 1 - window // 2), mode="edge")
    offset = np.convolve(padded, np.full(window, 1.0 / window), mode="valid")
    positions = actor.positions.copy()
    positions[:, :2] += offset[:, None] * left
    return replace(actor, positions=positions, headings=actor.headings + _drift(actor, offset))


def _spread(hit: BoolArray, frames: int) -> BoolArray:
    """Frames (F x O) near a hit count as hits."""
    sums = np.pad(hit.astype(np.int64).cumsum(axis=0), ((1, 0), (0, 0)))
    rows = np.arange(len(hit))
    high = np.minimum(rows + frames + 1, len(hit))
    low = np.maximum(rows - frames, 0)
    near: BoolArray = sums[high] - sums[low] > 0
    return near


def _cheapest(hit: BoolArray) -> IntArray:
    """Index of the offset in each frame of the cheapest sequence, F."""
    own = _HIT * hit + _AWAY * np.abs(_OFFSETS)
    change = _TURN * np.abs(_OFFSETS[:, None] - _OFFSETS)
    cost = own[0]
    origins = np.zeros(hit.shape, dtype=np.int64)
    for frame in range(1, len(hit)):
        total = cost[:, None] + change
        origins[frame] = total.argmin(axis=0)
        cost = total.min(axis=0) + own[frame]
    best = np.zeros(len(hit), dtype=np.int64)
    best[-1] = cost.argmin()
    for frame in range(len(hit) - 1, 0, -1):
        best[frame - 1] = origins[frame, best[frame]]
    return best


def _drift(actor: Actor, offset: FloatArray) -> FloatArray:
    """Turn of the heading by sidesteps, radians."""
    if len(offset) < 2:
        return np.zeros(len(offset))
    way = np.hypot(*np.gradient(actor.positions[:, :2], axis=0).T)
    drift: FloatArray = np.arctan2(np.gradient(offset), np.maximum(way, 0.02))
    return np.clip(drift, -0.6, 0.6)

"""Counts where actors drive through objects and through one another."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.actors import Motion, Obstacle
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.traffic.motion.trace_meetings import laid_apart

_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
_MOST = 5
"""Conflicts that are listed; the others are counted."""
_TOUCH = 0.05
"""Metres by which boxes are smaller than actors: what only touches is no conflict."""


@dataclass(frozen=True, eq=False)
class Boxes:
    """Rectangles of actors in frames.

    Attributes:
        owner: B, index of the actor.
        frame: B, frame.
        corners: B x 4 x 2, metres.
        low: B, height of the foot, metres.
        high: B, height of the top, metres.
    """

    owner: IntArray
    frame: IntArray
    corners: FloatArray
    low: FloatArray
    high: FloatArray


def boxes_of(motions: Sequence[Motion], sizes: Sequence[FloatArray]) -> Boxes:
    """Returns the rectangles of all actors in all frames.

    Args:
        motions: Actors.
        sizes: Length, width and height of each, metres.
    """
    counts = [len(motion.frames) for motion in motions]
    owner = np.repeat(np.arange(len(motions)), counts)
    place = np.concatenate([motion.places for motion in motions])
    heading = np.concatenate([motion.turns[:, 2] for motion in motions])
    size = np.array(sizes).reshape(-1, 3)[owner]
    local = _CORNERS * np.maximum(size[:, None, :2] - 2 * _TOUCH, 0.02)
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    corners = place[:, None, :2] + np.stack(
        [
            cos * local[..., 0] - sin * local[..., 1],
            sin * local[..., 0] + cos * local[..., 1],
        ],
        axis=2,
    )
    frames = np.concatenate([motion.frames for motion in motions])
    return Boxes(owner, frames, corners, place[:, 2], place[:, 2] + size[:, 2])


def actor_conflicts(boxes: Boxes, ids: Sequence[str], source: str) -> list[Issue]:
    """Returns an issue for pairs of actors that overlap, if there are any."""
    shapes = shapely.polygons(laid_apart(boxes.corners, boxes.frame - boxes.frame.min()))
    one, other = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    pairs = (one < other) & (boxes.owner[one] != boxes.owner[other])
    pairs &= (boxes.low[one] < boxes.high[other]) & (boxes.low[other] < boxes.high[one])
    meetings = Counter[tuple[str, str]]()
    for a, b in zip(
        boxes.owner[one[pairs]].tolist(), boxes.owner[other[pairs]].tolist(), strict=True
    ):
        meetings[ids[min(a, b)], ids[max(a, b)]] += 1
    if not meetings:
        return []
    named = ", ".join(f"{a} and {b} ({n} frames)" for (a, b), n in meetings.most_common(_MOST))
    text = f"{len(meetings)} pairs of actors overlap: {named}{_more(len(meetings))}"
    return [Issue("traffic.actors_overlap", Severity.WARNING, source, text, "kept as in the trace")]


def object_conflicts(
    boxes: Boxes,
    ids: Sequence[str],
    obstacles: Sequence[Obstacle],
    source: str,
) -> list[Issue]:
    """Returns an issue for actors that drive through objects, if there are any.

    Args:
        boxes: Actors.
        ids: Ids of the actors.
        obstacles: What is in the way; objects of several outlines share their name.
        source: Name of the trace.
    """
    if not obstacles:
        return []
    spans = np.array([(each.low, each.high) for each in obstacles])
    names = [each.path for each in obstacles]
    tree = shapely.STRtree([shapely.Polygon(each.outline) for each in obstacles])
    box, obstacle = tree.query(shapely.polygons(boxes.corners), predicate="intersects")
    meets = (boxes.low[box] + _STEP < spans[obstacle, 1]) & (boxes.high[box] > spans[obstacle, 0])
    hits = Counter[tuple[str, str]]()
    frames = {
        (boxes.owner[b], names[o], boxes.frame[b])
        for b, o in zip(box[meets].tolist(), obstacle[meets].tolist(), strict=True)
    }
    for owner, name, _ in frames:
        hits[ids[owner], name] += 1
    if not hits:
        return []
    named = ", ".join(f"{a} through {b} ({n} frames)" for (a, b), n in hits.most_common(_MOST))
    several = len({actor for actor, _ in hits})
    text = f"{several} actors pass through objects: {named}{_more(len(hits))}"
    return [
        Issue("traffic.through_objects", Severity.WARNING, source, text, "kept as in the trace")
    ]


_STEP = 0.15
"""Metres of an object below which an actor passes over it."""


def _more(count: int) -> str:
    return f" and {count - _MOST} more" if count > _MOST else ""

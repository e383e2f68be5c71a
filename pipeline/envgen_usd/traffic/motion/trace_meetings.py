"""Where the actors of a trace meet one another, moment by moment."""

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.models.actors import Actor
from envgen_usd.models.array_types import FloatArray, IntArray

_APART = 1e6
"""Metres between the moments, when they are laid side by side to be compared at once."""


def laid_apart(places: FloatArray, moments: FloatArray | IntArray) -> FloatArray:
    """Places so far apart that only those of a moment are near one another, as a copy.

    Args:
        places: N x ... x 2, metres.
        moments: N, whole numbers.
    """
    moved = places.copy()
    moved[..., 0] += (moments * _APART).reshape(-1, *(1,) * (places.ndim - 2))
    return moved


def deepest(
    bodies: NDArray[np.object_],
    hits: IntArray,
    others: NDArray[np.object_],
    reach: float | FloatArray,
) -> FloatArray:
    """How deep each body is inside of what it hits, metres; 0 for those that hit nothing.

    Args:
        bodies: B middle lines.
        hits: H, index of a body.
        others: H, what it hits.
        reach: Distances of the middle line, H or all alike, below which the body is inside.
    """
    depths = np.zeros(len(bodies))
    np.maximum.at(depths, hits, reach - shapely.distance(bodies[hits], others))
    return depths


def body_lines(actor: Actor, middles: FloatArray, headings: FloatArray) -> NDArray[np.object_]:
    """Middle lines of a body: with round ends, it is what lies within half of its width of them.

    Args:
        actor: Gives length and width.
        middles: N x ... x 2, metres.
        headings: N, radians.

    Returns:
        Lines of the shape N x ....
    """
    ahead = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    ahead = ahead.reshape(len(ahead), *(1,) * (middles.ndim - 2), 2)
    half = max(actor.length - actor.width, 1e-3) / 2 * ahead
    lines: NDArray[np.object_] = shapely.linestrings(
        np.stack([middles - half, middles + half], axis=-2)
    )
    return lines


class Meetings:
    """Bodies of all actors at all moments."""

    def __init__(self, actors: Sequence[Actor], rate: float) -> None:
        """Args: the actors, and the moments a second at which they are compared."""
        self._rate = rate
        self._widths = np.array([actor.width for actor in actors])
        self._owner = np.repeat(np.arange(len(actors)), [len(each.times) for each in actors])
        lines = [
            body_lines(each, self._apart(each, each.positions[:, :2]), each.headings)
            for each in actors
        ]
        self._tree = shapely.STRtree(np.concatenate(lines))

    def overlapping(self) -> frozenset[int]:
        """Index of the first actor of each pair that overlaps."""
        lines = self._tree.geometries
        one, other = self._tree.query(
            lines,
            predicate="dwithin",
            distance=(self._widths[self._owner] + self._widths.max()) / 2,
        )
        pairs = self._owner[one] < self._owner[other]
        one, other = one[pairs], other[pairs]
        reach = self._widths[self._owner[one]] + self._widths[self._owner[other]]
        near = shapely.distance(lines[one], lines[other]) < reach / 2
        return frozenset(self._owner[one[near]].tolist())

    def depths(self, index: int, actor: Actor, ways: FloatArray, room: float) -> FloatArray:
        """How deep an actor would be inside of others, F x O, metres.

        Args:
            index: Of the actor; it is not in its own way.
            actor: The actor.
            ways: F x O x 2, metres; where it might be at each of its moments.
            room: Metres that it keeps from others.
        """
        lines = body_lines(actor, self._apart(actor, ways), actor.headings).ravel()
        most = (actor.width + self._widths.max()) / 2 + room
        body, other = self._tree.query(lines, predicate="dwithin", distance=most)
        strange = self._owner[other] != index
        body, other = body[strange], other[strange]
        reach = (actor.width + self._widths[self._owner[other]]) / 2 + room
        depths = deepest(lines, body, self._tree.geometries[other], reach)
        return depths.reshape(ways.shape[:2])

    def _apart(self, actor: Actor, places: FloatArray) -> FloatArray:
        """Places of an actor at all of its moments, laid apart."""
        return laid_apart(places, np.round(actor.times * self._rate))

"""Candidates for places of actors, and which of them have room on the surface."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
import shapely

from envgen_usd.chunks import Chunk, tiles_of
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.parked_actors import ActorLook, Looks, ParkedActor
from envgen_usd.traffic.standing.standing_surface import StandingSurface, usual_wheels
from envgen_usd.traffic.wheel_contact import FLOATING, rest, wheel_points

_Kind = TypeVar("_Kind", bound=str)
_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
_STEP = 0.06
"""Largest difference of height below a person, metres; larger differences are steps."""
_BESIDE = 0.1
"""Least distance of an actor from objects and other actors, metres; a larger value drops more."""


@dataclass(frozen=True)
class Candidates:
    """Places for actors of one group, in order of precedence.

    Attributes:
        ids: N ids.
        looks: N looks.
        places: N x 3, metres; z is a guess of the surface's height.
        headings: N, radians.
        place: Where they stand, as `ParkedActor.place`.
        on_road: True if objects of the sidewalk cannot be in their way.
        upright: True for people, who stand upright on slopes, and not with a foot on a kerb.
    """

    ids: Sequence[str]
    looks: Sequence[ActorLook]
    places: FloatArray
    headings: FloatArray
    place: str
    on_road: bool = False
    upright: bool = False

    def rectangles(self, beside: float = 0.0) -> FloatArray:
        """Returns what they cover in plan, N x 4 x 2, metres, widened by a distance."""
        sizes = np.array([look.size[:2] for look in self.looks]).reshape(-1, 2) + 2 * beside
        corners = _CORNERS * sizes[:, None]
        rectangles: FloatArray = wheel_points(self.places, self.headings, corners)
        return rectangles

    def chosen(self, rows: IntArray) -> "Candidates":
        """Returns some of the candidates."""
        return Candidates(
            [self.ids[row] for row in rows.tolist()],
            [self.looks[row] for row in rows.tolist()],
            self.places[rows],
            self.headings[rows],
            self.place,
            self.on_road,
            self.upright,
        )


@dataclass
class Pavement:
    """What actors stand on in a chunk, and what is in their way; it fills up.

    Attributes:
        chunk: The tile; actors elsewhere belong to other chunks.
        road: The roads near the chunk.
        ground: The ground of the chunk, made when it is asked for.
        obstacles: What stands in the chunk, in plan.
        actors: The actors that have a place.
        wanted: Number of candidates by place.
    """

    chunk: Chunk
    road: StandingSurface
    ground: Callable[[], StandingSurface]
    obstacles: Sequence[shapely.Geometry]
    actors: list[ParkedActor] = field(default_factory=list)
    wanted: Counter[str] = field(default_factory=Counter)
    _shapes: list[shapely.Geometry] = field(default_factory=list)

    def add(self, candidates: Candidates) -> None:
        """Keeps the candidates of the chunk that have a surface below them and room."""
        own: BoolArray = np.all(tiles_of(candidates.places) == (self.chunk.x, self.chunk.y), axis=1)
        if not candidates.on_road:
            # Objects beyond the border are those of another chunk, which nobody asks.
            own &= _within(candidates.rectangles(), self.chunk)
        candidates = candidates.chosen(np.flatnonzero(own))
        self.wanted[candidates.place] += len(candidates.ids)
        if not candidates.ids:
            return
        free = self._free(candidates)
        heights, pitch, roll, firm = self._rest(candidates)
        for row in np.flatnonzero(free & firm).tolist():
            place = np.append(candidates.places[row, :2], heights[row])
            self.actors.append(
                ParkedActor(
                    candidates.ids[row],
                    candidates.looks[row],
                    np.round(place, 3),
                    round(float(candidates.headings[row]), 6),
                    candidates.place,
                    round(float(pitch[row]), 6),
                    round(float(roll[row]), 6),
                )
            )
        kept = candidates.rectangles()[free & firm]
        self._shapes += list(shapely.polygons(kept)) if len(kept) else []

    def _free(self, candidates: Candidates) -> BoolArray:
        """Whether candidates touch neither objects nor actors nor an earlier candidate."""
        wide = shapely.polygons(candidates.rectangles(_BESIDE))
        taken = [*self._shapes, *(() if candidates.on_road else self.obstacles)]
        blocked = np.zeros(len(wide), dtype=bool)
        if taken:
            blocked[shapely.STRtree(taken).query(wide, predicate="intersects")[0]] = True
        exact = shapely.polygons(candidates.rectangles())
        first, second = shapely.STRtree(exact).query(exact, predicate="intersects")
        for row, other in sorted(zip(first.tolist(), second.tolist(), strict=True)):
            if other < row and not blocked[other]:
                blocked[row] = True
        free: BoolArray = ~blocked
        return free

    def _rest(self, candidates: Candidates) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
        sizes = np.array([(look.size[0], look.width) for look in candidates.looks]).reshape(-1, 2)
        wheels = usual_wheels(sizes)
        plan = wheel_points(candidates.places, candidates.headings, wheels)
        guess = np.repeat(candidates.places[:, 2], wheels.shape[1])
        points = np.column_stack([plan.reshape(-1, 2), guess])
        heights = self.road.heights(points)
        missing = np.isnan(heights)
        if missing.any():
            heights[missing] = self.ground().heights(points[missing])
        wheels_at = heights.reshape(-1, 4)
        middle, tilt, misses = rest(wheels_at, wheels)
        if candidates.upright:
            level = np.ptp(wheels_at, axis=1) <= _STEP
            return middle, np.zeros(len(middle)), np.zeros(len(middle)), level
        touch = (np.abs(misses) <= FLOATING) & ~np.isnan(wheels_at)
        firm: BoolArray = np.all(touch, axis=1)
        # The pitch of a parked actor is positive with its front up.
        return middle, -tilt[:, 1], tilt[:, 0], firm


def _within(rectangles: FloatArray, chunk: Chunk) -> BoolArray:
    low, high = np.array(chunk.bounds[:2]), np.array(chunk.bounds[2:])
    inside: BoolArray = np.all((rectangles >= low) & (rectangles <= high), axis=(1, 2))
    return inside


class LookDraw:
    """Draws looks by the weights of kinds and of looks."""

    def __init__(self, weights: Mapping[_Kind, float], looks: Looks) -> None:
        """Takes the weights of kinds; kinds without looks do not occur."""
        self.looks: list[ActorLook] = []
        shares = []
        for kind, weight in sorted(weights.items()):
            total = sum(look.weight for look in looks.get(kind, ()))
            for look in looks.get(kind, ()):
                if weight > 0.0 and look.weight > 0.0:
                    self.looks.append(look)
                    shares.append(weight * look.weight / total)
        self._limits = np.cumsum(shares)

    def __bool__(self) -> bool:
        """True if any look can be drawn."""
        return bool(self.looks)

    def at(self, shares: FloatArray) -> list[ActorLook]:
        """Returns the looks at shares in [0, 1), N."""
        places = np.searchsorted(self._limits, shares * self._limits[-1], side="right")
        return [self.looks[min(place, len(self.looks) - 1)] for place in places.tolist()]


def gathered(parts: Iterable[Candidates]) -> Sequence[Candidates]:
    """Joins candidates of equal places, in the order of the first of each place."""
    groups: dict[tuple[str, bool, bool], list[Candidates]] = {}
    for part in parts:
        groups.setdefault((part.place, part.on_road, part.upright), []).append(part)
    return [
        Candidates(
            [name for part in group for name in part.ids],
            [look for part in group for look in part.looks],
            np.concatenate([part.places for part in group]),
            np.concatenate([part.headings for part in group]),
            place,
            on_road,
            upright,
        )
        for (place, on_road, upright), group in groups.items()
    ]

"""Actors that move: their traces, and their poses on the surface of the map."""

from dataclasses import dataclass

from envgen_usd.errors import Issue
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.frozen_model import Model

KINDS = ("car", "van", "truck", "bus", "train", "motorcycle", "bicycle", "pedestrian")
"""Kinds of actors."""


@dataclass(frozen=True, repr=False, eq=False)
class Actor(Model):
    """An actor as its source knows it.

    Attributes:
        id: Unique in its trace.
        kind: One of `KINDS`.
        length: Metres.
        width: Metres.
        height: Metres.
        times: N, seconds, ascending.
        positions: N x 2 or N x 3, metres, road frame; the middle of its box, in plan.
        headings: N, radians counter-clockwise from +x to its front.
        model: What the source calls its type, e.g. ``car_red``; decides between assets.
    """

    id: str
    kind: str
    length: float
    width: float
    height: float
    times: FloatArray
    positions: FloatArray
    headings: FloatArray
    model: str = ""

    @property
    def size(self) -> tuple[float, float, float]:
        """Length, width and height, metres."""
        return self.length, self.width, self.height


@dataclass(frozen=True, repr=False, eq=False)
class Trace(Model):
    """Actors over time.

    Attributes:
        actors: In the order of the source.
        rate: Samples a second of the source, Hz.
        source: Name of the file or program.
        issues: What the source holds beside them, and what was left out.
    """

    actors: tuple[Actor, ...]
    rate: float
    source: str
    issues: tuple[Issue, ...] = ()


@dataclass(frozen=True, repr=False, eq=False)
class Motion(Model):
    """An actor frame by frame; it rests on the surface.

    Attributes:
        actor: The actor.
        frames: N, ascending; frame f is at f / rate seconds. The actor is there in all of them.
        places: N x 3, metres, road frame; the middle of its foot, on the surface.
        turns: N x 3, radians: roll about +x, pitch about +y (positive lowers the front) and
            heading about +z. Headings are unwrapped, so that they interpolate the short way.
        travelled: N, metres driven or walked since the first frame; less after driving backwards.
        stays: First and last frame of each stretch without a gap, ascending.
        lifts: N x K, metres from the plane of the pose up to the surface below each wheel.
    """

    actor: Actor
    frames: IntArray
    places: FloatArray
    turns: FloatArray
    travelled: FloatArray
    stays: tuple[tuple[int, int], ...]
    lifts: FloatArray


@dataclass(frozen=True, repr=False, eq=False)
class Obstacle(Model):
    """What no actor may drive through.

    Attributes:
        path: Path of the prim.
        outline: N x 2, metres, in plan.
        low: Height of its foot, metres.
        high: Height of its top, metres.
    """

    path: str
    outline: FloatArray
    low: float
    high: float

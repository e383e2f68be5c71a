"""A trace on the surface of a map: frame by frame, where each actor rests."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.actors import Actor, Motion, Trace
from envgen_usd.models.array_types import FloatArray
from envgen_usd.traffic.motion.frame_motion import (
    FrameGrid,
    PlanPath,
    frame_grid,
    on_frames,
    stretches,
    travelled,
)
from envgen_usd.traffic.motion.surface_contact import ContactSurface, guessed_heights
from envgen_usd.traffic.wheel_contact import FLOATING, rest, wheel_points


@dataclass(frozen=True)
class Ridden:
    """Motions of a trace.

    Attributes:
        source: Name of the trace.
        rate: Frames a second.
        motions: Of those actors that are on the map.
        issues: What was left out.
    """

    source: str
    rate: float
    motions: tuple[Motion, ...]
    issues: tuple[Issue, ...]


def plan_paths(trace: Trace) -> tuple[FrameGrid, list[PlanPath], tuple[Issue, ...]]:
    """Returns the frames of a trace and where its actors are on the plan."""
    grid, issues = frame_grid(trace)
    return grid, [on_frames(actor, grid) for actor in trace.actors], issues


def ride(
    trace: Trace,
    load: Callable[[FloatArray], ContactSurface],
    wheels_of: Callable[[Actor], FloatArray],
) -> Ridden:
    """Sets the actors of a trace onto the surface of the map.

    Args:
        trace: Actors over time.
        load: Gives the surface near points, N x 2, metres.
        wheels_of: Gives the wheels of an actor, K x 2, metres ahead and to the left of its middle.

    Raises:
        EnvgenError: No actor is on the map.
    """
    grid, paths, issues = plan_paths(trace)
    wheels = [wheels_of(actor) for actor in trace.actors]
    points = [
        wheel_points(path.places, path.headings, feet).reshape(-1, 2)
        for path, feet in zip(paths, wheels, strict=True)
    ]
    everywhere = np.concatenate(points)
    surface = load(everywhere).near(everywhere)
    found = list(issues)
    motions: list[Motion] = []
    for actor, path, feet in zip(trace.actors, paths, wheels, strict=True):
        motion, lost = _on_surface(actor, path, feet, surface)
        if lost:
            text = f"{lost} of {len(path.frames)} frames are outside the map"
            done = "not there in these" if motion else "left out"
            where = f"{trace.source}: actor {actor.id}"
            found.append(Issue("traffic.outside", Severity.WARNING, where, text, done))
        if motion:
            motions.append(motion)
    if not motions:
        raise EnvgenError(_nowhere(trace, everywhere))
    return Ridden(trace.source, grid.rate, tuple(motions), (*found, *_floating(trace, motions)))


def _on_surface(
    actor: Actor, path: PlanPath, wheels: FloatArray, surface: ContactSurface
) -> tuple[Motion | None, int]:
    """Motion of an actor, `None` if it never is on the map; and how many frames are outside."""
    guess = guessed_heights(surface, path.places)
    points = wheel_points(path.places, path.headings, wheels)
    count = len(wheels)
    heights = surface.heights(points.reshape(-1, 2), np.repeat(guess, count)).reshape(-1, count)
    on_map = ~np.isnan(heights).all(axis=1)
    if not on_map.any():
        return None, len(path.frames)
    kept = PlanPath(path.frames[on_map], path.places[on_map], path.headings[on_map])
    height, tilt, lifts = rest(heights[on_map], wheels)
    places = np.column_stack([kept.places[:, :2], height])
    turns = np.column_stack([tilt, kept.headings])
    return (
        Motion(actor, kept.frames, places, turns, travelled(kept), stretches(kept.frames), lifts),
        int(np.count_nonzero(~on_map)),
    )


def _floating(trace: Trace, motions: Sequence[Motion]) -> tuple[Issue, ...]:
    """An issue if wheels of rigid vehicles miss the surface, e.g. on a kerb."""
    worst = [np.abs(motion.lifts).max(axis=1) for motion in motions]
    several = [
        motion for motion, most in zip(motions, worst, strict=True) if (most > FLOATING).any()
    ]
    if not several:
        return ()
    frames = np.concatenate(worst)
    share = np.count_nonzero(frames > FLOATING)
    text = (
        f"{len(several)} vehicles stand on edges in {share} of {len(frames)} frames: a wheel of a "
        f"rigid body would miss the surface by up to {100 * frames.max():.1f} cm"
    )
    done = "wheels follow the surface where the asset has some"
    return (Issue("traffic.floating", Severity.INFO, trace.source, text, done),)


def _nowhere(trace: Trace, points: FloatArray) -> str:
    low, high = points.min(axis=0), points.max(axis=0)
    return (
        f"{trace.source}: no actor is on the map; they are within x {low[0]:.0f} to {high[0]:.0f} "
        f"m, y {low[1]:.0f} to {high[1]:.0f} m of the road file's frame. "
        "Give --net for the offset of a SUMO network, or the trace of this road"
    )

"""What moves on a stage: bodies with their meshes, read once, and their places at any time."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property, partial

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.limb_motion import PoseSurfaces
from envgen_usd.render.moving_parts import body_extents, overlapping
from envgen_usd.render.render_scene import Moment, MovingParts, SceneObject
from envgen_usd.render.stage.body_ways import BodyWays
from envgen_usd.render.stage.moving_content import MovingContent
from envgen_usd.render.stage.placed_parts import column_matrix
from envgen_usd.render.stage.stage_clock import clock_of
from envgen_usd.render.stage.stage_traversal import world_matrix
from envgen_usd.render.trajectories.traffic_poses import Ride

OWN_VEHICLE = np.array([(-1.0, -0.95, 0.0), (3.8, 0.95, 1.8)])
"""Box of the vehicle that carries the sensors, in its frame, metres; what overlaps it is hidden.

A larger box hides more of the traffic around the vehicle.
"""
_DRIVEN = (frozenset({"car"}), frozenset({"truck", "bus"}))
"""Classes of the vehicles whose place a camera takes; the first that moves on the stage."""
_SAME = 1e-6
"""Seconds by which two times may differ that are one."""
_GLANCE = 0.1
"""Seconds between the times at which a vehicle's visibility is asked, about."""


class MovingObjects:
    """What moves on a stage. The payloads of these prims stay loaded.

    Attributes:
        clock: Times of the stage.
        parts: Meshes and lamps of the bodies.
        paths: Path of each object, by its number.
        hidden: Paths of the objects that overlapped the own vehicle so far.
    """

    def __init__(self, stage: Usd.Stage, roots: Sequence[Sdf.Path], content: MovingContent) -> None:
        """Prepares to ask the stage for places.

        Args:
            stage: The stage, with the payloads of these prims.
            roots: Outermost moving prims.
            content: What was read of them.
        """
        self.clock = clock_of(stage, roots)
        self.paths = content.paths
        self.hidden: dict[str, None] = {}
        self._bodies = content.bodies
        self._prims = [stage.GetPrimAtPath(body.path) for body in content.bodies]
        self._ways = BodyWays(stage, content.bodies, self.clock.code(0.0))
        self._world = world_matrix(stage)
        self._xforms = UsdGeom.XformCache()
        self.parts = MovingParts(
            geometries=content.geometries,
            uses=content.uses,
            bodies=content.carriers,
            layouts=content.layouts,
            owners=np.array([body.owner for body in content.bodies], np.int64),
            lamps=content.lamps,
            lamp_bodies=content.lamp_bodies,
            start=self._placed(0.0),
        )
        self._extents = body_extents(self.parts, len(self._bodies))

    @cached_property
    def surfaces(self) -> PoseSurfaces:
        """Surfaces of the bodies, for what bends from a frame to the next."""
        return PoseSurfaces(self.parts)

    def at(self, seconds: float | None, vehicle: FloatArray | None = None) -> Moment:
        """Where the bodies are at a time.

        Args:
            seconds: Seconds since the start of the stage; the first and the last place hold beyond
                its range. `None` is the start.
            vehicle: 4 x 4, from the frame of the own vehicle to the world: objects that overlap it
                are hidden. `None` hides none.
        """
        moment = self._placed(seconds or 0.0)
        if vehicle is None or not len(self._bodies):
            return moment
        met = np.unique(self.parts.owners[overlapping(self._extents, moment, vehicle, OWN_VEHICLE)])
        if not len(met):
            return moment
        self.hidden |= dict.fromkeys(self.paths[owner] for owner in met.tolist())
        return replace(moment, shown=moment.shown & ~np.isin(self.parts.owners, met))

    def rides(self, scene_objects: Sequence[SceneObject]) -> tuple[Ride, ...]:
        """The cars that move, or other motor vehicles where there are none.

        Args:
            scene_objects: Labels of the stage.
        """
        labels: dict[int, set[str]] = {}
        for use, bodies in zip(self.parts.uses, self.parts.bodies, strict=True):
            pairs = np.stack((self.parts.owners[bodies], use.scene_objects), axis=1)
            for owner, label in np.unique(pairs, axis=0).tolist():
                labels.setdefault(owner, set()).add(scene_objects[label].label)
        for kinds in _DRIVEN:
            chosen = sorted(owner for owner, names in labels.items() if names & kinds)
            if chosen:
                return tuple(ride for owner in chosen for ride in self._rides_of(owner))
        return ()

    def _rides_of(self, owner: int) -> Iterator[Ride]:
        """An object, once for each time that it is visible without a break."""
        body = int(np.flatnonzero(self.parts.owners == owner)[0])
        if self._bodies[body].above >= 0:
            return
        times = np.linspace(0.0, self.clock.duration, 1 + round(self.clock.duration / _GLANCE))
        seen = np.array([self._is_seen(body, time) for time in times.tolist()])
        edges = np.flatnonzero(np.diff(np.concatenate(([False], seen, [False]))))
        for first, last in edges.reshape(-1, 2).tolist():
            start, end = times[first], times[last - 1]
            yield Ride(self.paths[owner], start, end, partial(self._middle, body))

    def _is_seen(self, body: int, seconds: float) -> bool:
        if not self._bodies[body].is_timed:
            return True
        code, prim = self.clock.code(seconds), self._prims[body]
        seen = UsdGeom.Imageable(prim).GetVisibilityAttr().Get(code)
        return bool(seen != UsdGeom.Tokens.invisible)

    def _middle(self, body: int, seconds: float) -> FloatArray:
        """From the middle of a body's footprint, with its axes, to the world: 4 x 4."""
        self._xforms.SetTime(self.clock.code(seconds))
        local, resets = self._xforms.GetLocalTransformation(self._prims[body])
        above = self._world if resets else self._bodies[body].place
        placed: FloatArray = above @ column_matrix(local)
        low, high = self._extents[body]
        if (high >= low).all():  # else the body has no mesh of its own
            middle = (low[:2] + high[:2]) / 2.0
            placed[:3, 3] += placed[:3, :2] @ middle
        return placed

    def beside(self, seconds: float | None, step: float = 0.05) -> float:
        """A time near another within the range of the stage, for velocities; seconds.

        Before and after that range nothing moves: the time itself.
        """
        now = seconds or 0.0
        if not -_SAME <= now <= self.clock.duration + _SAME:
            return now
        return now + step if now + step <= self.clock.duration else now - step

    def _placed(self, seconds: float) -> Moment:
        return self._ways.at(seconds, self.clock.code(seconds))

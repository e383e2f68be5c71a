"""What moves on a stage: bodies with their meshes, read once, and their places at any time."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from envgen_usd.errors import Issue
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.limb_motion import PoseSurfaces
from envgen_usd.render.moving_parts import body_extents, overlapping
from envgen_usd.render.render_scene import (
    Geometry,
    Lamps,
    Material,
    Moment,
    MovingParts,
    SceneObject,
    Use,
)
from envgen_usd.render.stage.placed_parts import (
    Context,
    Part,
    Placement,
    column_matrix,
    gathered_lamps,
    gathered_uses,
    unlabelled,
)
from envgen_usd.render.stage.prim_likeness import composed_of
from envgen_usd.render.stage.prim_semantics import is_component
from envgen_usd.render.stage.stage_clock import clock_of, is_animated
from envgen_usd.render.stage.stage_lamps import placed_lamps
from envgen_usd.render.stage.stage_reader import unlabelled_issues
from envgen_usd.render.stage.stage_traversal import Traversal, world_matrix

OWN_VEHICLE = np.array([(-1.0, -0.95, 0.0), (3.8, 0.95, 1.8)])
"""Box of the vehicle that carries the sensors, in its frame, metres; what overlaps it is hidden.

A larger box hides more of the traffic around the vehicle.
"""
_VISIBILITY = str(UsdGeom.Tokens.visibility)
_FLAT = 1e-15
"""Least volume of a body's axes; a body of less is hidden."""


@dataclass(frozen=True)
class _Body:
    """A prim whose transformation or visibility varies, without such prims below it.

    Attributes:
        prim: The prim.
        above: Number of the body that carries it; -1 for the world.
        place: 4 x 4, from its parent prim to that body or the world.
        owner: Number of the object.
        is_timed: True if its visibility is to be asked.
    """

    prim: Usd.Prim
    above: int
    place: FloatArray
    owner: int
    is_timed: bool


@dataclass(frozen=True)
class _Object:
    """Bodies of an object, whose numbers count from its first, and what they hold."""

    path: Sdf.Path
    bodies: tuple[_Body, ...]
    placements: list[list[Placement]]


class MovingObjects:
    """What moves on a stage. The payloads of these prims stay loaded.

    Attributes:
        clock: Times of the stage.
        parts: Meshes and lamps of the bodies.
        materials: Looks: those of what stands still, and further ones.
        scene_objects: Labels: those of what stands still, and further ones.
        issues: Warnings about the prims.
        paths: Path of each object, by its number.
        hidden: Paths of the objects that overlapped the own vehicle so far.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        paths: Sequence[Sdf.Path],
        materials: Sequence[Material],
        scene_objects: Sequence[SceneObject],
    ) -> None:
        """Loads and reads the prims.

        Args:
            stage: The stage.
            paths: Outermost moving prims.
            materials: Looks of what stands still.
            scene_objects: Labels of what stands still.
        """
        stage.LoadAndUnload(set(paths), set())
        self.clock = clock_of(stage, paths)
        traversal = Traversal(stage, Usd.TimeCode.EarliestTime())
        traversal.materials.materials = list(materials)
        traversal.semantics.go_on(scene_objects)
        self.paths: list[str] = []
        self.hidden: dict[str, None] = {}
        self._bodies: list[_Body] = []
        self._known: dict[object, _Object] = {}
        self._world = world_matrix(stage)
        self._xforms = UsdGeom.XformCache()
        found: list[list[Placement]] = []
        for path in paths:
            found += self._read(stage.GetPrimAtPath(path), traversal)
        traversal.finish()
        self._known = {}
        self.parts = self._parts(found, traversal)
        self.materials = tuple(traversal.materials.materials)
        self.scene_objects = tuple(traversal.semantics.scene_objects)
        self._extents = body_extents(self.parts, len(self._bodies))
        counts = np.array([unlabelled(each) for each in found]).reshape(-1, 2).sum(axis=0)
        self.issues: tuple[Issue, ...] = (
            *traversal.issues,
            *traversal.materials.issues,
            *traversal.semantics.issues(),
            *unlabelled_issues(*counts.tolist()),
        )

    @property
    def is_empty(self) -> bool:
        """True if nothing that moves can be drawn."""
        return not self.parts.uses and not len(self.parts.lamp_bodies)

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

    def beside(self, seconds: float | None, step: float = 0.05) -> float:
        """A time near another within the range of the stage, for velocities; seconds."""
        now = min(max(seconds or 0.0, 0.0), self.clock.duration)
        return now + step if now + step <= self.clock.duration else now - step

    def _placed(self, seconds: float) -> Moment:
        code = self.clock.code(seconds)
        self._xforms.SetTime(code)
        count = len(self._bodies)
        matrices, shown = np.empty((count, 4, 4)), np.ones(count, bool)
        for number, body in enumerate(self._bodies):
            local, resets = self._xforms.GetLocalTransformation(body.prim)
            placed = body.place @ column_matrix(local)
            if resets:
                placed = self._world @ column_matrix(local)
            elif body.above >= 0:
                placed = matrices[body.above] @ placed
                shown[number] = shown[body.above]
            if not np.isfinite(placed).all():
                placed, shown[number] = np.eye(4), False
            matrices[number] = placed
            if body.is_timed and shown[number]:
                visibility = UsdGeom.Imageable(body.prim).GetVisibilityAttr().Get(code)
                shown[number] = visibility != UsdGeom.Tokens.invisible
        solid = np.abs(np.linalg.det(matrices[:, :3, :3])) > _FLAT
        return Moment(seconds, matrices, shown & solid)

    def _read(self, root: Usd.Prim, traversal: Traversal) -> list[list[Placement]]:
        """Reads the bodies of an object, or takes those of an equal one."""
        if not root or not root.IsA("Imageable"):
            return []
        above = traversal.context_above(root)
        if above is None:
            return []
        below = (prim for prim in Usd.PrimRange(root) if prim != root and is_animated(prim))
        bodies = [root, *below]
        moved = frozenset(prim.GetPath() for prim in bodies)
        content = composed_of(root, moved) if is_component(root) and not above.firm else None
        key = content and (content, repr(above._replace(matrix=np.empty(0))))
        known = self._known.get(key) if key else None
        if known is None:
            known = self._read_bodies(bodies, above, traversal)
            if key:
                self._known[key] = known
        first, path = len(self._bodies), root.GetPath()
        for each in known.bodies:
            self._bodies.append(
                replace(
                    each,
                    prim=root.GetStage().GetPrimAtPath(_moved_to(each.prim, known.path, path)),
                    above=each.above + first if each.above >= 0 else -1,
                    place=each.place if each.above >= 0 else above.matrix,
                    owner=len(self.paths),
                )
            )
        self.paths.append(str(path))
        if path == known.path:
            return known.placements
        return [[_owned(each, str(path)) for each in body] for body in known.placements]

    def _read_bodies(
        self, prims: Sequence[Usd.Prim], above: Context, traversal: Traversal
    ) -> _Object:
        """Reads the bodies of an object; those that carry others come first."""
        traversal.apart = frozenset(prim.GetPath() for prim in prims)
        traversal.inherited = {prims[0].GetPath(): above}
        numbers: dict[Sdf.Path, int] = {}
        bodies, placements = [], []
        for prim in prims:
            path = prim.GetPath()
            context = traversal.inherited.get(path)
            if context is None:
                continue
            carriers = [number for each, number in numbers.items() if path.HasPrefix(each)]
            is_timed = _VISIBILITY in prim.GetAuthoredPropertyNames()
            bodies.append(_Body(prim, max(carriers, default=-1), context.matrix, 0, is_timed))
            numbers[path] = len(numbers)
            outer, traversal.placements = traversal.placements, []
            traversal.visit(prim, context._replace(matrix=np.eye(4), body=True))
            inner, traversal.placements = traversal.placements, outer
            placements.append(inner)
        return _Object(prims[0].GetPath(), tuple(bodies), placements)

    def _parts(self, found: Sequence[Sequence[Placement]], traversal: Traversal) -> MovingParts:
        """Joins equal meshes: actors of a kind share them."""
        geometries: dict[object, tuple[int, Geometry]] = {}
        contents: dict[int, object] = {}
        joined: dict[tuple[int, object], list[tuple[Use, IntArray]]] = {}
        lamps, lamp_bodies = [], []
        rows: dict[tuple[int, object], int] = {}
        layouts: list[list[tuple[tuple[int, object], int]]] = [[] for _ in found]
        for body, placements in enumerate(found):
            own, uses = gathered_uses(placements, traversal.semantics.scene_object)
            for use in uses:
                geometry = own[use.geometry]
                # Geometries live on in the slots of `found`, so their ids are not used again.
                content = contents.get(id(geometry)) or _content(geometry)
                contents[id(geometry)] = content
                number, _ = geometries.setdefault(content, (len(geometries), geometry))
                carriers = np.full(len(use.matrices), body, np.int64)
                key = number, use.level
                joined.setdefault(key, []).append((use, carriers))
                first = rows.get(key, 0)
                rows[key] = first + len(carriers)
                layouts[body] += [(key, row) for row in range(first, rows[key])]
            placed = placed_lamps(gathered_lamps(placements))
            lamps.append(placed)
            lamp_bodies.append(np.full(len(placed.places), body, np.int64))
        # A mesh with two levels of detail is two meshes: a level belongs to all uses of a mesh.
        keys = {key: place for place, key in enumerate(joined)}
        every = [geometry for _, geometry in geometries.values()]
        return MovingParts(
            geometries=tuple(every[number] for number, _ in keys),
            uses=tuple(_joined(place, joined[key]) for key, place in keys.items()),
            bodies=tuple(np.concatenate([bodies for _, bodies in joined[key]]) for key in keys),
            layouts=tuple(
                np.array([(keys[key], row) for key, row in each], np.int64).reshape(-1, 2)
                for each in layouts
            ),
            owners=np.array([body.owner for body in self._bodies], np.int64),
            lamps=_all_lamps(lamps),
            lamp_bodies=np.concatenate([np.empty(0, np.int64), *lamp_bodies]),
            start=self._placed(0.0),
        )


def _moved_to(prim: Usd.Prim, old: Sdf.Path, new: Sdf.Path) -> Sdf.Path:
    return prim.GetPath().ReplacePrefix(old, new)


def _owned(placement: Placement, owner: str) -> Placement:
    """The placement in another object, which is a component."""
    if isinstance(placement, Part):
        return replace(placement, owner=owner)
    return placement._replace(context=placement.context._replace(owner=owner))


def _content(geometry: Geometry) -> tuple[object, ...]:
    """Equal for equal meshes."""
    digest = sha256()
    for name in ("points", "normals", "uvs", "colours", "triangles"):
        digest.update(np.ascontiguousarray(getattr(geometry, name)).data)
    return geometry.material, geometry.double_sided, digest.digest()


def _joined(number: int, uses: Sequence[tuple[Use, IntArray]]) -> Use:
    matrices = np.concatenate([use.matrices for use, _ in uses])
    objects = np.concatenate([use.scene_objects for use, _ in uses])
    return Use(number, matrices, objects, level=uses[0][0].level)


def _all_lamps(lamps: Iterable[Lamps]) -> Lamps:
    every = [vars(Lamps()), *map(vars, lamps)]
    return Lamps(**{name: np.concatenate([each[name] for each in every]) for name in every[0]})

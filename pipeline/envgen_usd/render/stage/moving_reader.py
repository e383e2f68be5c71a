"""Reads what moves on a stage: each body in its own space, equal objects and meshes once."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from envgen_usd.models.array_types import IntArray
from envgen_usd.render.render_scene import Geometry, Lamps, Material, SceneObject, Use
from envgen_usd.render.stage.moving_content import MovingBody, MovingContent
from envgen_usd.render.stage.placed_parts import (
    Context,
    Part,
    Placement,
    gathered_lamps,
    gathered_uses,
    unlabelled,
)
from envgen_usd.render.stage.prim_likeness import composed_of
from envgen_usd.render.stage.prim_semantics import is_component
from envgen_usd.render.stage.stage_clock import is_animated
from envgen_usd.render.stage.stage_lamps import placed_lamps
from envgen_usd.render.stage.stage_reader import unlabelled_issues
from envgen_usd.render.stage.stage_traversal import Traversal

_VISIBILITY = str(UsdGeom.Tokens.visibility)


@dataclass(frozen=True)
class _Object:
    """Bodies of an object, whose numbers count from its first, and what they hold."""

    path: str
    bodies: tuple[MovingBody, ...]
    placements: list[list[Placement]]


def read_moving(
    stage: Usd.Stage,
    roots: Sequence[Sdf.Path],
    materials: Sequence[Material],
    scene_objects: Sequence[SceneObject],
) -> MovingContent:
    """Reads what moves.

    Args:
        stage: The stage, with the payloads of these prims.
        roots: Outermost moving prims.
        materials: Looks of what stands still.
        scene_objects: Labels of what stands still.
    """
    return _Reader(stage, materials, scene_objects).content(roots)


class _Reader:
    """Bodies and objects so far."""

    def __init__(
        self, stage: Usd.Stage, materials: Sequence[Material], scene_objects: Sequence[SceneObject]
    ) -> None:
        self._stage = stage
        self._still = len(materials), len(scene_objects)
        self._traversal = Traversal(stage, Usd.TimeCode.EarliestTime())
        self._traversal.materials.materials = list(materials)
        self._traversal.semantics.go_on(scene_objects)
        self._paths: list[str] = []
        self._bodies: list[MovingBody] = []
        self._known: dict[object, _Object] = {}

    def content(self, roots: Sequence[Sdf.Path]) -> MovingContent:
        traversal = self._traversal
        found = [each for path in roots for each in self._read(self._stage.GetPrimAtPath(path))]
        traversal.finish()
        counts = np.array([unlabelled(each) for each in found]).reshape(-1, 2).sum(axis=0)
        lamps, lamp_bodies = _lamps_of(found)
        geometries, uses, carriers, layouts = self._joined_meshes(found)
        return MovingContent(
            paths=tuple(self._paths),
            bodies=tuple(self._bodies),
            geometries=geometries,
            uses=uses,
            carriers=carriers,
            layouts=layouts,
            lamps=lamps,
            lamp_bodies=lamp_bodies,
            materials=tuple(traversal.materials.materials[self._still[0] :]),
            scene_objects=tuple(traversal.semantics.scene_objects[self._still[1] :]),
            issues=(
                *traversal.issues,
                *traversal.materials.issues,
                *traversal.semantics.issues(),
                *unlabelled_issues(*counts.tolist()),
            ),
        )

    def _read(self, root: Usd.Prim) -> list[list[Placement]]:
        """Reads the bodies of an object, or takes those of an equal one."""
        if not root or not root.IsA("Imageable"):
            return []
        above = self._traversal.context_above(root)
        if above is None:
            return []
        below = (prim for prim in Usd.PrimRange(root) if prim != root and is_animated(prim))
        bodies = [root, *below]
        moved = frozenset(prim.GetPath() for prim in bodies)
        content = composed_of(root, moved) if is_component(root) and not above.firm else None
        key = content and (content, repr(above._replace(matrix=np.empty(0))))
        known = self._known.get(key) if key else None
        if known is None:
            known = self._read_bodies(bodies, above)
            if key:
                self._known[key] = known
        first, path = len(self._bodies), str(root.GetPath())
        for each in known.bodies:
            self._bodies.append(
                replace(
                    each,
                    path=path + each.path.removeprefix(known.path),
                    above=each.above + first if each.above >= 0 else -1,
                    place=each.place if each.above >= 0 else above.matrix,
                    owner=len(self._paths),
                )
            )
        self._paths.append(path)
        if path == known.path:
            return known.placements
        return [[_owned(each, path) for each in body] for body in known.placements]

    def _read_bodies(self, prims: Sequence[Usd.Prim], above: Context) -> _Object:
        """Reads the bodies of an object; those that carry others come first."""
        traversal = self._traversal
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
            carrier = max(carriers, default=-1)
            bodies.append(MovingBody(str(path), carrier, context.matrix, 0, is_timed))
            numbers[path] = len(numbers)
            outer, traversal.placements = traversal.placements, []
            traversal.visit(prim, context._replace(matrix=np.eye(4), body=True))
            inner, traversal.placements = traversal.placements, outer
            placements.append(inner)
        return _Object(str(prims[0].GetPath()), tuple(bodies), placements)

    def _joined_meshes(
        self, found: Sequence[Sequence[Placement]]
    ) -> tuple[tuple[Geometry, ...], tuple[Use, ...], tuple[IntArray, ...], tuple[IntArray, ...]]:
        """Joins equal meshes: actors of a kind share them.

        Returns:
            Geometries, their uses, and carriers and layouts as in `MovingContent`.
        """
        geometries: dict[object, tuple[int, Geometry]] = {}
        contents: dict[int, object] = {}
        joined: dict[tuple[int, object], list[tuple[Use, IntArray]]] = {}
        rows: dict[tuple[int, object], int] = {}
        layouts: list[list[tuple[tuple[int, object], int]]] = [[] for _ in found]
        for body, placements in enumerate(found):
            own, uses = gathered_uses(placements, self._traversal.semantics.scene_object)
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
        # A mesh with two levels of detail is two meshes: a level belongs to all uses of a mesh.
        keys = {key: place for place, key in enumerate(joined)}
        every = [geometry for _, geometry in geometries.values()]
        return (
            tuple(every[number] for number, _ in keys),
            tuple(_joined(place, joined[key]) for key, place in keys.items()),
            tuple(np.concatenate([bodies for _, bodies in joined[key]]) for key in keys),
            tuple(
                np.array([(keys[key], row) for key, row in each], np.int64).reshape(-1, 2)
                for each in layouts
            ),
        )


def _lamps_of(found: Sequence[Sequence[Placement]]) -> tuple[Lamps, IntArray]:
    """Lamps of all bodies, and the body of each."""
    placed = [placed_lamps(gathered_lamps(placements)) for placements in found]
    bodies = [np.full(len(each.places), body, np.int64) for body, each in enumerate(placed)]
    return _all_lamps(placed), np.concatenate([np.empty(0, np.int64), *bodies])


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

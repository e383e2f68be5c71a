"""What the moving prims of a stage hold, apart from where they are, and as a file of the cache."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.packed_layout import GROUP, VERTEX
from envgen_usd.render.render_scene import Geometry, Lamps, Material, Merged, SceneObject, Use
from envgen_usd.render.stage.scene_cache import SceneCache
from envgen_usd.render.stage.scene_file import SceneSummary, StoredScene
from envgen_usd.render.stage.stage_regions import Content, Region


@dataclass(frozen=True)
class MovingBody:
    """A prim whose transformation or visibility varies, without such prims below it.

    Attributes:
        path: The prim.
        above: Number of the body that carries it; -1 for the world.
        place: 4 x 4, from its parent prim to that body or the world.
        owner: Number of the object.
        is_timed: True if its visibility is to be asked.
    """

    path: str
    above: int
    place: FloatArray
    owner: int
    is_timed: bool


@dataclass(frozen=True)
class MovingContent:
    """All that moves, each body in its own space.

    Attributes:
        paths: Path of each object, by its number.
        bodies: The bodies; those that carry others come first.
        geometries: Meshes by material, one for each use.
        uses: Placements of the geometries; matrices lead to the space of the body.
        carriers: By use, the body of each placement.
        layouts: By body, use and row of each of its placements (M x 2), in the order of the stage.
        lamps: Lamps in the spaces of their bodies.
        lamp_bodies: Body of each lamp.
        materials: Looks that nothing has that stands still; they are counted on from those.
        scene_objects: Labels that nothing has that stands still.
        issues: Warnings about the prims.
    """

    paths: tuple[str, ...]
    bodies: tuple[MovingBody, ...]
    geometries: tuple[Geometry, ...]
    uses: tuple[Use, ...]
    carriers: tuple[IntArray, ...]
    layouts: tuple[IntArray, ...]
    lamps: Lamps
    lamp_bodies: IntArray
    materials: tuple[Material, ...]
    scene_objects: tuple[SceneObject, ...]
    issues: tuple[Issue, ...]

    @property
    def is_empty(self) -> bool:
        """True if nothing that moves can be drawn."""
        return not self.uses and not len(self.lamp_bodies)


NOTHING_MOVES = MovingContent(
    (), (), (), (), (), (), Lamps(), np.empty(0, np.int64), (), (), ()
)  # fmt: skip


@dataclass(frozen=True)
class _Note:
    """What the file of a scene has no place for."""

    paths: tuple[str, ...]
    bodies: tuple[tuple[str, int, bytes, int, bool], ...]
    carriers: tuple[bytes, ...]
    layouts: tuple[bytes, ...]
    lamp_bodies: bytes


class MovingCache:
    """The moving content of a stage in the cache, to find or to store.

    Attributes:
        layers: Layers of the stage without payloads: resolved path and SHA-256 by identifier.
    """

    def __init__(
        self,
        loaded: frozenset[str],
        layers: Mapping[str, tuple[str, bytes]],
        still: SceneSummary,
    ) -> None:
        """Starts with the stage as it is without payloads.

        Args:
            loaded: Identifiers of the layers that the process had opened before the stage.
            layers: As the attribute.
            still: What stands still: numbers of looks and labels count on from there.
        """
        self.layers = layers
        basis = msgspec.msgpack.encode((still.materials, still.scene_objects))
        self._files = SceneCache(loaded, layers, "moving", basis)

    def find(self) -> MovingContent | None:
        """The content, if it is there and nothing has changed; no payload may be open."""
        scene = self._files.find()
        try:
            return _from_file(scene) if scene else None
        except (msgspec.MsgspecError, EnvgenError):
            return None

    def store(self, content: MovingContent, below: Mapping[str, tuple[str, bytes]]) -> None:
        """Stores the content, if it follows from files alone.

        Args:
            content: What was read.
            below: Layers besides `layers` that it was composed of.
        """
        alone = Merged(np.empty(0, VERTEX), np.empty(0, np.uint32), np.empty(0, GROUP))
        meshes = Content(content.geometries, content.uses, known=alone)
        self._files.add(Region(0, np.zeros((2, 3))), meshes)
        note = msgspec.msgpack.encode(_note(content))
        self._files.finish(_summary(content), {**self.layers, **below}, note)


def _summary(content: MovingContent) -> SceneSummary:
    return SceneSummary(
        materials=content.materials,
        scene_objects=content.scene_objects,
        lanes=(),
        lamps=content.lamps,
        issues=content.issues,
    )


def _note(content: MovingContent) -> _Note:
    return _Note(
        paths=content.paths,
        bodies=tuple(
            (each.path, each.above, _packed(each.place, "<f8"), each.owner, each.is_timed)
            for each in content.bodies
        ),
        carriers=tuple(_packed(each, "<i8") for each in content.carriers),
        layouts=tuple(_packed(each, "<i8") for each in content.layouts),
        lamp_bodies=_packed(content.lamp_bodies, "<i8"),
    )


def _from_file(scene: StoredScene) -> MovingContent:
    note, content = msgspec.msgpack.decode(scene.note, type=_Note), scene.content(0)
    return MovingContent(
        paths=note.paths,
        bodies=tuple(
            MovingBody(path, above, np.frombuffer(place).reshape(4, 4), owner, timed)
            for path, above, place, owner, timed in note.bodies
        ),
        # The file holds each mesh once; a level of detail belongs to all uses of a mesh.
        geometries=tuple(content.geometries[use.geometry] for use in content.uses),
        uses=tuple(replace(use, geometry=at) for at, use in enumerate(content.uses)),
        carriers=tuple(np.frombuffer(each, np.int64) for each in note.carriers),
        layouts=tuple(np.frombuffer(each, np.int64).reshape(-1, 2) for each in note.layouts),
        lamps=scene.summary.lamps,
        lamp_bodies=np.frombuffer(note.lamp_bodies, np.int64),
        materials=scene.summary.materials,
        scene_objects=scene.summary.scene_objects,
        issues=scene.summary.issues,
    )


def _packed(values: NDArray[Any], kind: str) -> bytes:
    return np.ascontiguousarray(values, kind).tobytes()

"""Reads a stage chunk by chunk for export: geometry, instances and metadata, in metres."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from envgen_usd.cycle_collection import paused_collection
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.exchange.stage_objects import StageObject, layers_below, objects_below
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Material
from envgen_usd.render.stage.placed_parts import Context, Placement, column_matrix
from envgen_usd.render.stage.stage_clock import moving_paths
from envgen_usd.render.stage.stage_reader import (
    adopt_frame,
    composition_issues,
    open_stage,
    unloaded_payloads,
)
from envgen_usd.render.stage.stage_survey import layers_of
from envgen_usd.render.stage.stage_traversal import Traversal, world_matrix

_TIME = Usd.TimeCode.EarliestTime()
_COMPONENT = "component"
OUTSIDE = "outside"
"""Name of the chunk that holds what lies in no payload, e.g. an artist's own objects."""


@dataclass(frozen=True, eq=False)
class StageChunk:
    """Content of a chunk.

    Attributes:
        name: Name of the prim, e.g. ``chunk_0_0``.
        origin: 3, its local origin in the world, metres, z up.
        placements: What is drawn, relative to the origin, metres, z up.
        objects: Metadata by prim path; matrices relative to the origin, metres, z up.
    """

    name: str
    origin: FloatArray
    placements: tuple[Placement, ...]
    objects: Mapping[str, StageObject]


@dataclass(frozen=True)
class ChunkPlace:
    """A chunk before its payloads are loaded.

    Attributes:
        name: Name of the prim; `OUTSIDE` for the rest of the stage.
        path: Path of the prim.
        payloads: What is loaded for it.
    """

    name: str
    path: Sdf.Path
    payloads: frozenset[Sdf.Path]


class StageChunks:
    """A stage whose payloads are loaded while their chunk is read only.

    Attributes:
        stage: The stage.
        places: Its chunks, in the order of the stage; the last is `OUTSIDE`.
    """

    def __init__(self, path: Path, *, moving: bool = True) -> None:
        """Opens the stage.

        Args:
            path: File of the stage.
            moving: False leaves out what moves; else it stands where it is at the start.

        Raises:
            EnvgenError: The file is no stage.
        """
        self.stage = open_stage(path.absolute(), payloads=False, all_follow=True)
        self._adopted = adopt_frame(self.stage)
        self._composition: dict[Issue, None] = {}
        self._values: dict[Issue, None] = {}
        self._traversal = Traversal(self.stage, _TIME)
        self._layers = layers_of(self.stage)
        self._left_out = frozenset() if moving else frozenset(moving_paths(self.stage)[0])
        loadable: dict[Sdf.Path, set[Sdf.Path]] = {}
        for payload in unloaded_payloads(self.stage):
            if not any(payload.HasPrefix(path) for path in self._left_out):
                loadable.setdefault(_container(self.stage, payload), set()).add(payload)
        self.places = [
            *(ChunkPlace(key.name, key, frozenset(value)) for key, value in loadable.items()),
            ChunkPlace(OUTSIDE, Sdf.Path.absoluteRootPath, frozenset()),
        ]
        names = [place.name for place in self.places]
        if len(set(names)) < len(names):
            raise EnvgenError(f"{path}: two chunks of the stage have the same name")

    @property
    def materials(self) -> list[Material]:
        """Looks of what was read so far."""
        return self._traversal.materials.materials

    @property
    def issues(self) -> tuple[Issue, ...]:
        """Warnings about what was read so far."""
        parts, out = self._traversal, sorted(map(str, self._left_out))
        found = (*parts.issues, *parts.materials.issues, *parts.semantics.issues())
        if out:
            text = f"{len(out)} prims move, and what moves is no part of a map"
            found = (Issue("export.moving", Severity.INFO, out[0], text, "left out"), *found)
        return tuple(dict.fromkeys((*self._adopted, *self._composition, *found, *self._values)))

    def material_names(self) -> dict[int, str]:
        """Name of each look of the stage's materials that are in no payload, by its index.

        Materials that look alike share the first name.
        """
        names: dict[int, str] = {}
        for prim in self.stage.Traverse():
            if prim.IsA("Material"):
                index = self._traversal.materials.index(UsdShade.Material(prim))
                names.setdefault(index, str(prim.GetName()))
        names.pop(0, None)
        return names

    def origin(self, place: ChunkPlace) -> FloatArray:
        """Origin of a chunk in the world: 3, metres, z up; its payloads may be unloaded."""
        return self._world(place)[1]

    def digests(self, place: ChunkPlace) -> list[str]:
        """Hashes of all layers that the chunk follows from, sorted."""
        self.stage.LoadAndUnload(set(place.payloads), set())
        own = layers_of(self.stage, self._layers)
        self.stage.LoadAndUnload(set(), set(place.payloads))
        return sorted(digest.hex() for _, digest in (self._layers | own).values())

    @paused_collection()
    def read(self, place: ChunkPlace) -> StageChunk:
        """Loads a chunk, reads it, and unloads it."""
        self.stage.LoadAndUnload(set(place.payloads), set())
        self._composition |= dict.fromkeys(composition_issues(self.stage))
        found: list[Placement] = []

        def enter(prim: Usd.Prim, context: Context) -> bool:
            path = prim.GetPath()
            if path in self._left_out:
                return True
            if path == place.path:
                visit = self._traversal.visit_children
                found.extend(self._traversal.separately(lambda: visit(prim, context)))
                return True
            # A chunk may lie below another one; what is read on the way to it is dropped.
            return path in elsewhere and not place.path.HasPrefix(path)

        elsewhere = {each.path for each in self.places if each.payloads}
        traversal = self._traversal
        traversal.gate = enter
        world, start = self._world(place)
        traversal.separately(lambda: traversal.visit(self.stage.GetPseudoRoot(), Context(world)))
        objects = self._objects(place, world) if found else {}
        self.stage.LoadAndUnload(set(), set(place.payloads))
        return StageChunk(place.name, start, tuple(found), objects)

    def _world(self, place: ChunkPlace) -> tuple[FloatArray, FloatArray]:
        """From the stage to metres around a chunk's origin (4 x 4, z up), and the origin.

        What lies in no payload takes the origin of the first chunk: float32 is too coarse for
        coordinates of a map projection.
        """
        world = world_matrix(self.stage)
        prim = self.stage.GetPrimAtPath(self.places[0].path if not place.payloads else place.path)
        if not prim or prim.IsPseudoRoot():
            return world, np.zeros(3)
        local = UsdGeom.XformCache(_TIME).GetLocalToWorldTransform(prim)
        origin = (world @ column_matrix(local))[:3, 3]
        shifted = world.copy()
        shifted[:3, 3] -= origin
        return shifted, origin

    def _objects(self, place: ChunkPlace, world: FloatArray) -> dict[str, StageObject]:
        layers = layers_below(self.stage.GetPrimAtPath(place.path))
        objects = objects_below(layers, _TIME, self._values)
        return {path: replace(each, matrix=world @ each.matrix) for path, each in objects.items()}

    def __iter__(self) -> Iterator[ChunkPlace]:
        """The chunks' places."""
        return iter(self.places)


def _container(stage: Usd.Stage, payload: Sdf.Path) -> Sdf.Path:
    """The prim whose chunk a payload belongs to: what is above the outermost object with it.

    Payloads of a build lie below their chunk; those of actors below objects of a group.
    """
    objects = [
        path
        for path in payload.GetPrefixes()
        if str(stage.GetPrimAtPath(path).GetKind()) == _COMPONENT
    ]
    return (objects[0] if objects else payload).GetParentPath()

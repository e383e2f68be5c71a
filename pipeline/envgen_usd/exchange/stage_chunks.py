"""Reads a stage chunk by chunk for export: geometry, instances and metadata, in metres."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from envgen_usd.chunks import is_chunk_name
from envgen_usd.cycle_collection import paused_collection
from envgen_usd.errors import Issue, Severity
from envgen_usd.exchange.stage_objects import StageObject, layers_below, objects_below
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Material
from envgen_usd.render.stage.loading_units import loading_units
from envgen_usd.render.stage.placed_parts import Context, Placement, column_matrix
from envgen_usd.render.stage.stage_clock import moving_paths
from envgen_usd.render.stage.stage_reader import (
    adopt_frame,
    composition_issues,
    open_stage,
)
from envgen_usd.render.stage.stage_survey import layers_of
from envgen_usd.render.stage.stage_traversal import Traversal, world_matrix

_TIME = Usd.TimeCode.EarliestTime()
_COMPONENT, _ASSEMBLY = "component", "assembly"
OUTSIDE = "outside"
"""Name of the chunk for what lies in no group with payloads, e.g. an artist's own objects."""


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
        name: Name of the prim, made unique; `OUTSIDE` for the rest of the stage.
        path: Path of the prim.
        prims: What is read: prims below it, or itself; in `OUTSIDE` all that no other chunk reads.
        payloads: What is loaded for it.
    """

    name: str
    path: Sdf.Path
    prims: tuple[Sdf.Path, ...]
    payloads: frozenset[Sdf.Path]

    @property
    def is_outside(self) -> bool:
        """True for the rest of the stage."""
        return self.path.IsAbsoluteRootPath()


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
        self.places = _places(self.stage, self._left_out)
        grouped = {prim for place in self.places if not place.is_outside for prim in place.prims}
        self._grouped = frozenset(grouped)

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

    @property
    def folder(self) -> Path:
        """Folder of the stage's file."""
        return Path(self.stage.GetRootLayer().realPath).parent

    @property
    def folders(self) -> list[Path]:
        """Folders of the files of its sublayers; one may be that of a build."""
        return [Path(each.realPath).parent for each in self.stage.GetLayerStack() if each.realPath]

    def material_names(self) -> dict[int, str]:
        """Name of each look of the stage's materials, by its index.

        Materials that are in payloads count once their chunk has been read. Materials that look
        alike share the first name.
        """
        for prim in self.stage.Traverse():
            if prim.IsA("Material"):
                self._traversal.materials.index(UsdShade.Material(prim))
        return self._traversal.materials.names

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
        world, start = self._world(place)
        self._traversal.world = world
        found = self._traversal.separately(lambda: self._visit(place, world))
        objects = self._objects(place, world) if found else {}
        self.stage.LoadAndUnload(set(), set(place.payloads))
        return StageChunk(place.name, start, tuple(found), objects)

    def _visit(self, place: ChunkPlace, world: FloatArray) -> None:
        """Collects what is drawn of a chunk, whose payloads are loaded."""
        traversal = self._traversal
        if place.is_outside:
            traversal.apart = self._left_out | self._grouped
            traversal.visit(self.stage.GetPseudoRoot(), Context(world))
            return
        traversal.apart = self._left_out
        holder, own = self.stage.GetPrimAtPath(place.path), frozenset(place.prims)
        inside = holder.GetParent() if place.path in own else holder
        for prim in inside.GetChildren():
            above = traversal.context_above(prim) if prim.GetPath() in own else None
            if above is not None:
                traversal.visit(prim, above)

    def _world(self, place: ChunkPlace) -> tuple[FloatArray, FloatArray]:
        """From the stage to metres around a chunk's origin (4 x 4, z up), and the origin.

        What is no chunk of a build takes the origin of the first one: float32 is too coarse for
        coordinates of a map projection, and a group of an artist may lie at 0.
        """
        world = world_matrix(self.stage)
        places = self.places
        first = next((each for each in places if is_chunk_name(each.path.name)), None)
        if first is None:
            holder = places[0] if place.is_outside else place
        else:
            holder = place if is_chunk_name(place.path.name) else first
        prim = self.stage.GetPrimAtPath(holder.path)
        if not prim or prim.IsPseudoRoot():
            return world, np.zeros(3)
        local = UsdGeom.XformCache(_TIME).GetLocalToWorldTransform(prim)
        origin = (world @ column_matrix(local))[:3, 3]
        shifted = world.copy()
        shifted[:3, 3] -= origin
        return shifted, origin

    def _objects(self, place: ChunkPlace, world: FloatArray) -> dict[str, StageObject]:
        top = self.stage.GetPrimAtPath(place.path)
        # A group that is an instancer or an instance has no layers of its own.
        is_whole = top.IsInstance() or top.IsA("PointInstancer")
        layers = [top] if is_whole else layers_below(top)
        own = frozenset(place.prims)
        if place.is_outside:
            layers = [prim for prim in layers if prim.GetPath() not in self._grouped]
        elif place.path not in own:
            layers = [prim for prim in layers if prim.GetPath() in own]
        objects = objects_below(layers, _TIME, self._values)
        return {path: replace(each, matrix=world @ each.matrix) for path, each in objects.items()}

    def __iter__(self) -> Iterator[ChunkPlace]:
        """The chunks' places."""
        return iter(self.places)


def _places(stage: Usd.Stage, left_out: frozenset[Sdf.Path]) -> list[ChunkPlace]:
    """The chunks of a stage without payloads, and the rest.

    Groups with payloads are chunks: the chunks of a build, its traffic, and groups of an artist.
    """
    groups: dict[Sdf.Path, dict[Sdf.Path, set[Sdf.Path]]] = {Sdf.Path.absoluteRootPath: {}}
    for unit in loading_units(stage, left_out):
        whole = _whole_object(stage, unit.path)
        container = whole.GetParentPath()
        if container.IsAbsoluteRootPath() or _kind(stage, container) == _ASSEMBLY:
            is_object = _kind(stage, whole) == _COMPONENT
            container = Sdf.Path.absoluteRootPath if is_object else whole
        groups.setdefault(container, {}).setdefault(whole, set()).update(unit.payloads)
    outside = groups.pop(Sdf.Path.absoluteRootPath)
    names = _unique_names(list(groups))
    groups[Sdf.Path.absoluteRootPath] = outside
    return [
        ChunkPlace(names.get(key, OUTSIDE), key, tuple(value), frozenset().union(*value.values()))
        for key, value in groups.items()
    ]


def _whole_object(stage: Usd.Stage, path: Sdf.Path) -> Sdf.Path:
    """The outermost object with a prim, or else the prim: an object is in one file."""
    kinds = ((each, _kind(stage, each)) for each in path.GetPrefixes())
    return next((each for each, kind in kinds if kind == _COMPONENT), path)


def _kind(stage: Usd.Stage, path: Sdf.Path) -> str:
    return str(stage.GetPrimAtPath(path).GetKind())


def _unique_names(paths: Sequence[Sdf.Path]) -> dict[Sdf.Path, str]:
    """A name for each group: that of its prim, or of all prims down to it where it is not alone."""
    times = Counter(path.name for path in paths)
    names: dict[Sdf.Path, str] = {}
    taken: set[str] = set()
    for path in paths:
        whole = "_".join(each.name for each in path.GetPrefixes())
        name = path.name if times[path.name] == 1 and path.name != OUTSIDE else whole
        while name in taken:
            name += "_"
        names[path] = name
        taken.add(name)
    return names

"""A stage of any size, read region by region: memory follows what the frames see."""

from collections import OrderedDict
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Usd

from envgen_usd.cycle_collection import paused_collection
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.cameras.camera_clearance import REACH, refused_places
from envgen_usd.render.render_scene import Geometry, Lamps, Scene, Use
from envgen_usd.render.stage.placed_parts import (
    Context,
    Placement,
    Template,
    gathered_lamps,
    gathered_uses,
    templates_of,
    unlabelled,
)
from envgen_usd.render.stage.resolved_files import read_resolved
from envgen_usd.render.stage.stage_lamps import placed_lamps
from envgen_usd.render.stage.stage_reader import (
    adopt_frame,
    bounds_of,
    composition_issues,
    open_stage,
    unlabelled_issues,
)
from envgen_usd.render.stage.stage_season import set_season
from envgen_usd.render.stage.stage_traversal import Traversal, world_matrix
from envgen_usd.render.stage.sun_and_sky import has_light, read_light

RANGE = 1000.0
"""Distance in metres within which things are drawn; a larger value needs more memory.

A house of 10 m is 5 pixels high there (KITTI-360's camera), and the ground ends 1 pixel below the
horizon.
"""
_BEYOND = 128.0
"""Distance in metres of the squares of shadows and heights from the camera, at most."""
_KEPT = 256e6
"""Bytes of the regions that are kept for later frames; a larger value reads regions less often."""
_ROOT = Sdf.Path.emptyPath


@dataclass(frozen=True)
class _Region:
    """A prim whose children are payloads: what they hold is read together.

    Attributes:
        number: Number of the region in the order of the stage; 0 for what is in no payload.
        path: Prim above the payloads.
        payloads: Their prims.
        context: What the prim's children inherit.
        bounds: 2 x 3, minimum and maximum corner, world.
    """

    number: int
    path: Sdf.Path
    payloads: frozenset[Sdf.Path]
    context: Context
    bounds: FloatArray


@dataclass(frozen=True)
class _Content:
    """Geometry of a region; `templates` keeps the prototypes alive that it shares."""

    geometries: tuple[Geometry, ...]
    uses: tuple[Use, ...]
    templates: tuple[Template, ...]

    @cached_property
    def size(self) -> int:
        """Bytes of the arrays; shared prototypes count for each region."""
        arrays = ((each.points, each.normals, each.uvs, each.triangles) for each in self.geometries)
        own = sum(array.nbytes for group in arrays for array in group)
        return own + sum(use.matrices.nbytes for use in self.uses)


class StageScene:
    """A stage, opened once for any number of cameras, lights and trajectories.

    Attributes:
        stage: The stage; payloads are loaded while they are read only.
        scene: Lanes, light, lamps, looks, labels, bounds and issues of the whole stage, without
            geometry.
        digests: Hashes of all layers of the stage.
    """

    stage: Usd.Stage
    scene: Scene
    digests: frozenset[bytes]

    @paused_collection()
    def __init__(self, path: Path | str, season: str = "") -> None:
        """Reads the whole stage once, region by region, and keeps what fits into memory.

        Args:
            path: USD file.
            season: Season of the plants; empty for that of the stage.

        Raises:
            EnvgenError: The file is no stage, or the stage has no drawable prims.
        """
        self.stage = open_stage(Path(path), payloads=False)
        if season:
            set_season(self.stage, season)
        time = Usd.TimeCode.EarliestTime()
        adopted = adopt_frame(self.stage)
        self._payloads = _regions_of(self.stage)
        self._traversal = Traversal(self.stage, time, self._survey)
        self._regions: list[_Region] = []
        self._kept: OrderedDict[int, _Content] = OrderedDict()
        self._layers: dict[str, bytes] = {}
        self._composition: dict[Issue, None] = {}
        self._lamps: list[Lamps] = []
        self._labelled = np.zeros(2, np.int64)
        lit = has_light(self.stage)
        self._light = read_light(self.stage, time) if lit else None
        self._note_layers()
        self._traversal.visit(self.stage.GetPseudoRoot(), Context(world_matrix(self.stage)))
        self._traversal.finish()
        self._base = self._collected(0, self._traversal.placements)
        light, light_issues = self._light or read_light(self.stage, time)
        bounds = [region.bounds for region in self._regions]
        bounds += [bounds_of(self._base.geometries, self._base.uses)] if self._base.uses else []
        if not bounds:
            raise EnvgenError("render: the stage has no drawable prims")
        self.digests = frozenset(self._layers.values())
        self.scene = Scene(
            geometries=(),
            uses=(),
            materials=tuple(self._traversal.materials.materials),
            scene_objects=tuple(self._traversal.semantics.scene_objects),
            light=light,
            lanes=tuple(self._traversal.lanes),
            lamps=_joined_lamps(self._lamps),
            bounds=np.stack(
                (
                    np.min([each[0] for each in bounds], axis=0),
                    np.max([each[1] for each in bounds], axis=0),
                )
            ),
            issues=tuple(
                dict.fromkeys(
                    (
                        *self._composition,
                        *adopted,
                        *light_issues,
                        *self._traversal.issues,
                        *self._traversal.materials.issues,
                        *self._traversal.semantics.issues(),
                        *unlabelled_issues(*self._labelled.tolist()),
                    )
                )
            ),
        )

    def near(self, eyes: FloatArray, reach: float = RANGE) -> Scene:
        """The scene with the geometry of all regions that cameras may see.

        Args:
            eyes: N x 3, positions of the cameras, world, metres.
            reach: Range of what is drawn, metres.

        Raises:
            EnvgenError: The range is not above 0.
        """
        if not reach > 0.0:
            raise EnvgenError(f"render: the range must be above 0 m, not {reach:g}")
        return self._part([r for r in self._regions if _gaps(r, eyes).min() <= reach + _BEYOND])

    def refused(self, eyes: FloatArray) -> BoolArray:
        """Camera positions (N x 3) inside of or close to something; see `refused_places`."""
        inside = np.zeros((len(eyes), len(self._regions)), bool)
        for number, region in enumerate(self._regions):
            inside[:, number] = _gaps(region, eyes, upwards=True) <= 2.0 * REACH
        refused = np.zeros(len(eyes), bool)
        kinds, kind = np.unique(inside, axis=0, return_inverse=True)
        for number, chosen in enumerate(kinds):
            those = np.flatnonzero(kind.reshape(-1) == number)
            part = self._part([self._regions[index] for index in np.flatnonzero(chosen)])
            refused[those] = refused_places(part, eyes[those])
        return refused

    def _survey(self, prim: Usd.Prim, context: Context) -> bool:
        """Reads a region during the first traversal; False for prims that are no region."""
        path = prim.GetPath()
        if path not in self._payloads:
            return False
        payloads = frozenset(self._payloads.pop(path))
        number = len(self._regions) + 1
        content = self._read(number, path, payloads, context)
        if content.uses:
            bounds = bounds_of(content.geometries, content.uses)
            self._regions.append(_Region(number, path, payloads, context, bounds))
            self._keep(number, content)
        return True

    def _read(
        self, number: int, path: Sdf.Path, payloads: frozenset[Sdf.Path], context: Context
    ) -> _Content:
        """Loads a region, reads it, and unloads it."""
        self.stage.LoadAndUnload(set(payloads), set())
        self._note_layers()
        placements = self._traversal.separately(
            lambda: self._traversal.visit_children(self.stage.GetPrimAtPath(path), context)
        )
        content = self._collected(number, placements)
        self.stage.LoadAndUnload(set(), set(payloads))
        return content

    def _collected(self, number: int, placements: list[Placement]) -> _Content:
        geometries, uses = gathered_uses(placements, self._traversal.semantics.scene_object)
        self._lamps.append(placed_lamps(gathered_lamps(placements)))
        self._labelled += unlabelled(placements)
        marked = tuple(replace(use, region=number) for use in uses)
        return _Content(geometries, marked, templates_of(placements))

    def _note_layers(self) -> None:
        """Notes the layers, the composition errors and the light of what is loaded."""
        self._composition |= dict.fromkeys(composition_issues(self.stage))
        for layer in self.stage.GetUsedLayers():
            if layer.identifier not in self._layers:
                self._layers[layer.identifier] = sha256(_layer_bytes(layer)).digest()
        if self._light is None and has_light(self.stage):
            self._light = read_light(self.stage, Usd.TimeCode.EarliestTime())

    def _keep(self, number: int, content: _Content) -> None:
        self._kept[number] = content
        self._kept.move_to_end(number)
        while len(self._kept) > 1 and sum(each.size for each in self._kept.values()) > _KEPT:
            self._kept.popitem(last=False)

    def _content(self, region: _Region) -> _Content:
        if region.number not in self._kept:
            content = self._read(region.number, region.path, region.payloads, region.context)
            self._keep(region.number, content)
        self._kept.move_to_end(region.number)
        return self._kept[region.number]

    def _part(self, regions: list[_Region]) -> Scene:
        contents = [self._base, *(self._content(region) for region in regions)]
        geometries: dict[int, Geometry] = {}
        uses = []
        for content in contents:
            for use in content.uses:
                geometry = content.geometries[use.geometry]
                geometries.setdefault(id(geometry), geometry)
                uses.append((id(geometry), use))
        place = {key: number for number, key in enumerate(geometries)}
        placed = tuple(replace(use, geometry=place[key]) for key, use in uses)
        return replace(self.scene, geometries=tuple(geometries.values()), uses=placed)


def cells(eyes: FloatArray, side: float) -> list[list[int]]:
    """Groups camera positions (N x 3) by squares, whose sides are in metres.

    Neighbouring squares follow each other.
    """
    squares = np.floor(eyes[:, :2] / side).astype(np.int64)
    x, y = squares.T
    order = np.lexsort((np.arange(len(eyes)), np.where(x % 2, -y, y), x))
    changes = np.flatnonzero((np.diff(squares[order], axis=0) != 0).any(axis=1)) + 1
    return [group.tolist() for group in np.split(order, changes) if len(group)]


def _regions_of(stage: Usd.Stage) -> dict[Sdf.Path, set[Sdf.Path]]:
    """Outermost payloads that are not loaded, by the prim above them."""
    regions: dict[Sdf.Path, set[Sdf.Path]] = {}
    for path in stage.FindLoadable():
        regions.setdefault(path.GetParentPath(), set()).add(path)
    return regions


def _gaps(region: _Region, eyes: FloatArray, *, upwards: bool = False) -> FloatArray:
    """Distances of places (N x 3) from a region; `upwards`, in plan."""
    gaps = np.maximum(np.maximum(region.bounds[0] - eyes, eyes - region.bounds[1]), 0.0)
    lengths: FloatArray = np.linalg.norm(gaps[:, :2] if upwards else gaps, axis=1)
    return lengths


def _joined_lamps(lamps: list[Lamps]) -> Lamps:
    names = ("places", "powers", "axes", "flat", "edges")
    return Lamps(
        **{name: np.concatenate([getattr(each, name) for each in lamps]) for name in names}
    )


def _layer_bytes(layer: Any) -> bytes:  # noqa: ANN401 - Sdf.Layer has no stub of its type
    if layer.anonymous or layer.dirty:
        return bytes(layer.ExportToString(), "utf-8")
    return read_resolved(str(layer.resolvedPath))

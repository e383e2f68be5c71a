"""A stage of any size, read region by region: memory follows what the frames see."""

from collections import OrderedDict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pxr import Sdf, Usd

from envgen_usd.assets.stage_guard import refuse_deadly_layers
from envgen_usd.cycle_collection import paused_collection
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.cameras.camera_clearance import REACH, Clearance
from envgen_usd.render.moving_parts import placed_uses
from envgen_usd.render.render_scene import Geometry, MovingParts, Scene
from envgen_usd.render.stage.moving_content import NOTHING_MOVES, MovingCache, MovingContent
from envgen_usd.render.stage.moving_objects import MovingObjects
from envgen_usd.render.stage.moving_reader import read_moving
from envgen_usd.render.stage.scene_cache import SceneCache
from envgen_usd.render.stage.scene_file import SceneSummary, StoredScene
from envgen_usd.render.stage.stage_clock import moving_layers, moving_paths
from envgen_usd.render.stage.stage_reader import adopt_frame, bounds_of, open_stage
from envgen_usd.render.stage.stage_regions import Content, Region
from envgen_usd.render.stage.stage_season import set_season
from envgen_usd.render.stage.stage_survey import StageSurvey, layers_of
from envgen_usd.render.stage.sun_and_sky import read_light
from envgen_usd.render.user_cache import cache_folder

RANGE = 1000.0
"""Distance in metres within which things are drawn; a larger value needs more memory.

A house of 10 m is 5 pixels high there (KITTI-360's camera), and the ground ends 1 pixel below the
horizon.
"""
_CELL = 400.0
"""Side in metres of the squares whose frames are drawn together.

A larger value loads regions less often, and more of them at once.
"""
_TOGETHER = 128e6
"""Bytes of the regions up to which squares are drawn together; a larger value packs them less often
and needs more memory."""
_BEYOND = 128.0
"""Distance in metres of the squares of shadows and heights from the camera, at most."""
_KEPT = 128e6
"""Bytes of the regions that are kept for later frames; a larger value reads regions less often."""


@dataclass(frozen=True)
class _Reading:
    """What was read of a stage, from the stage itself or from the cache.

    Attributes:
        summary: The scene without geometry and light.
        light: Sun and sky, with their issues.
        base: What is in no payload.
        regions: Regions with geometry.
        content: Reads a region.
        layers: All layers: resolved path and SHA-256 by identifier.
        composition: Composition errors.
    """

    summary: SceneSummary
    light: tuple[Atmosphere, list[Issue]]
    base: Content
    regions: tuple[Region, ...]
    content: Callable[[Region], Content]
    layers: Mapping[str, tuple[str, bytes]]
    composition: tuple[Issue, ...] = ()


_Prepared = TypeVar("_Prepared")


class StageScene:
    """A stage, opened once for any number of cameras, lights and trajectories.

    Attributes:
        path: Its file, absolute.
        season: Season of the plants that was asked for; empty for that of the stage.
        stage: The stage; payloads are loaded while they are read only.
        scene: Lanes, light, lamps, looks, labels, bounds and issues of the whole stage, without
            geometry.
        digests: Hashes of all layers of the stage.
        moving: What moves; `None` on a stage without. It stays loaded.
    """

    path: str
    season: str
    stage: Usd.Stage
    scene: Scene
    digests: frozenset[bytes]
    moving: MovingObjects | None

    @paused_collection()
    def __init__(self, path: Path | str, season: str = "", *, cache: bool = True) -> None:
        """Reads the whole stage once, region by region, and keeps what fits into memory.

        Args:
            path: USD file.
            season: Season of the plants; empty for that of the stage.
            cache: True takes what an earlier run read of the same layers, and stores what this one
                reads (`scene_cache`).

        Raises:
            EnvgenError: The file is no stage, or the stage has no drawable prims.
        """
        loaded = frozenset(layer.identifier for layer in Sdf.Layer.GetLoadedLayers())
        self.path, self.season = str(Path(path).absolute()), season
        self.stage = open_stage(Path(self.path), payloads=False)
        if season:
            set_season(self.stage, season)
        adopted = adopt_frame(self.stage)
        layers = layers_of(self.stage)
        moved, samples = moving_paths(self.stage)
        self._kept: OrderedDict[int, Content] = OrderedDict()
        self._last: tuple[object, Scene, Any] | None = None
        alone = moving_layers(self.stage, moved)
        memory = SceneCache(loaded, _without(layers, alone)) if cache else None
        stored = memory.find() if memory else None
        if stored is not None:
            self._reading = _from_cache(self.stage, stored, layers)
        else:
            refuse_deadly_layers(Path(self.path))
            self._reading = self._survey(layers, memory, moved, alone)
        self._regions, self._base = self._reading.regions, self._reading.base
        summary, (light, light_issues) = self._reading.summary, self._reading.light
        known = MovingCache(loaded, layers, summary) if cache and moved else None
        bodies = _moving_content(self.stage, moved, summary, known)
        self.moving = None if bodies.is_empty else MovingObjects(self.stage, moved, bodies)
        parts = self.moving.parts if self.moving else None
        bounds = self._bounds(parts)
        read = dict(self._reading.layers)
        read |= layers_of(self.stage, read) if parts else {}
        self.digests = frozenset(digest for _, digest in read.values())
        issues = (*self._reading.composition, *adopted, *samples, *light_issues, *summary.issues)
        self.scene = Scene(
            geometries=(),
            uses=(),
            materials=summary.materials + bodies.materials,
            scene_objects=summary.scene_objects + bodies.scene_objects,
            light=light,
            lanes=summary.lanes,
            lamps=summary.lamps,
            bounds=bounds,
            issues=tuple(dict.fromkeys((*issues, *bodies.issues))),
            textures=cache_folder("textures") if cache else None,
            moving=parts,
        )

    def _bounds(self, parts: MovingParts | None) -> FloatArray:
        """Corners of what stands still, or else of what moves at the start: 2 x 3."""
        boxes = [region.bounds for region in self._regions]
        boxes += [bounds_of(self._base.geometries, self._base.uses)] if self._base.uses else []
        if parts and not boxes:
            boxes = [bounds_of(parts.geometries, tuple(placed_uses(parts, parts.start)))]
        if not boxes:
            raise EnvgenError("the stage has no drawable prims")
        low = np.min([box[0] for box in boxes], axis=0)
        return np.stack((low, np.max([box[1] for box in boxes], axis=0)))

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
        contents = {0: self._base}
        contents |= {r.number: self._content(r) for r in self._seen(eyes, reach)}
        merged = {number: content.merged for number, content in contents.items()}
        return replace(self._part(contents.values()), merged=merged)

    def prepared(
        self, eyes: FloatArray, reach: float, prepare: Callable[[Scene, float], _Prepared]
    ) -> tuple[Scene, _Prepared]:
        """The scene that cameras may see, and what was prepared of it to draw them.

        The last result is kept until `forget`: batches of frames follow one another in a place.

        Args:
            eyes: As of `near`.
            reach: As of `near`.
            prepare: Called with the scene and `reach`; its result follows from these alone.

        Raises:
            EnvgenError: As of `near`.
        """
        key = prepare, reach, [region.number for region in self._seen(eyes, reach)]
        if self._last is None or self._last[0] != key:
            self.forget()  # both would not fit into memory
            near = self.near(eyes, reach)
            self._last = key, near, prepare(near, reach)
        near, result = self._last[1:]
        return near, result

    def forget(self) -> None:
        """Lets go of what was prepared last."""
        self._last = None

    def _seen(self, eyes: FloatArray, reach: float) -> list[Region]:
        return [r for r in self._regions if _gaps(r, eyes).min() <= reach + _BEYOND]

    def places(self, eyes: FloatArray, reach: float = RANGE) -> list[list[int]]:
        """Groups cameras whose surroundings are in memory together.

        Args:
            eyes: N x 3, positions of the cameras, world, metres.
            reach: Range of what is drawn, metres.

        Returns:
            Numbers of the cameras of each group.
        """
        groups: list[list[int]] = []
        known: set[int] = set()
        sizes = {region.number: region.size for region in self._regions}
        for cell in cells(eyes, _CELL):
            needed = {region.number for region in self._seen(eyes[cell], reach)}
            if groups and sum(sizes[number] for number in known | needed) <= _TOGETHER:
                groups[-1] += cell
                known |= needed
            else:
                groups.append(cell)
                known = needed
        return groups

    def refused(self, eyes: FloatArray) -> BoolArray:
        """Camera positions (N x 3) inside of or close to something; see `refused_places`."""
        clearance = Clearance(eyes)
        clearance.add(self._part([self._base]), np.arange(len(eyes)))
        for region in self._regions:
            near = np.flatnonzero(_gaps(region, eyes, upwards=True) <= 2.0 * REACH)
            if len(near):
                clearance.add(self._part([self._content(region)]), near)
        return clearance.refused

    def _survey(
        self,
        layers: Mapping[str, tuple[str, bytes]],
        memory: SceneCache | None,
        moved: Collection[Sdf.Path],
        alone: Collection[str],
    ) -> _Reading:
        """Reads the stage itself, and stores what stands still; `alone` are layers without."""

        def seen(region: Region, content: Content) -> None:
            self._keep(region.number, content)
            if memory:
                memory.add(region, content)

        try:
            survey = StageSurvey(self.stage, layers, seen, moved)
            summary = SceneSummary(
                materials=tuple(survey.traversal.materials.materials),
                scene_objects=tuple(survey.traversal.semantics.scene_objects),
                lanes=tuple(survey.traversal.lanes),
                lamps=survey.lamps,
                issues=survey.issues,
            )
            stored = None
            if memory and survey.is_lit_outside and not survey.composition:
                memory.add(Region(0, np.zeros((2, 3))), survey.base)
                stored = memory.finish(summary, _without(survey.layers, alone))
        finally:
            if memory:
                memory.drop()
        if stored:
            self._kept.clear()  # the file needs less memory
            return _from_cache(self.stage, stored, layers)
        return _Reading(
            summary=summary,
            light=survey.light or read_light(self.stage, Usd.TimeCode.EarliestTime()),
            base=survey.base,
            regions=tuple(survey.regions),
            content=survey.content,
            layers=survey.layers,
            composition=tuple(survey.composition),
        )

    def _keep(self, number: int, content: Content) -> None:
        self._kept[number] = content
        self._kept.move_to_end(number)
        while len(self._kept) > 1 and sum(each.size for each in self._kept.values()) > _KEPT:
            self._kept.popitem(last=False)

    def _content(self, region: Region) -> Content:
        if region.number not in self._kept:
            self._keep(region.number, self._reading.content(region))
        self._kept.move_to_end(region.number)
        return self._kept[region.number]

    def _part(self, contents: Iterable[Content]) -> Scene:
        geometries: dict[int, Geometry] = {}
        uses = []
        for content in contents:
            for use in content.uses:
                geometry = content.geometries[use.geometry]
                geometries.setdefault(id(geometry), geometry)
                uses.append((id(geometry), use))
        place = {key: number for number, key in enumerate(geometries)}
        return replace(
            self.scene,
            geometries=tuple(geometries.values()),
            uses=tuple(replace(use, geometry=place[key]) for key, use in uses),
        )


def cells(eyes: FloatArray, side: float) -> list[list[int]]:
    """Groups camera positions (N x 3) by squares, whose sides are in metres.

    Neighbouring squares follow each other.
    """
    squares = np.floor(eyes[:, :2] / side).astype(np.int64)
    x, y = squares.T
    order = np.lexsort((np.arange(len(eyes)), np.where(x % 2, -y, y), x))
    changes = np.flatnonzero((np.diff(squares[order], axis=0) != 0).any(axis=1)) + 1
    return [group.tolist() for group in np.split(order, changes) if len(group)]


def _gaps(region: Region, eyes: FloatArray, *, upwards: bool = False) -> FloatArray:
    """Distances of places (N x 3) from a region; `upwards`, in plan."""
    gaps = np.maximum(np.maximum(region.bounds[0] - eyes, eyes - region.bounds[1]), 0.0)
    lengths: FloatArray = np.linalg.norm(gaps[:, :2] if upwards else gaps, axis=1)
    return lengths


def _without(
    layers: Mapping[str, tuple[str, bytes]], left_out: Collection[str]
) -> dict[str, tuple[str, bytes]]:
    return {name: mark for name, mark in layers.items() if name not in left_out}


def _moving_content(
    stage: Usd.Stage, moved: Sequence[Sdf.Path], still: SceneSummary, cache: MovingCache | None
) -> MovingContent:
    """Loads what moves; reads it, or takes it from the cache."""
    if not moved:
        return NOTHING_MOVES
    known = cache.find() if cache else None
    if known is None:
        refuse_deadly_layers(Path(stage.GetRootLayer().realPath))
    stage.LoadAndUnload(set(moved), set())
    if known is not None:
        return known
    content = read_moving(stage, moved, still.materials, still.scene_objects)
    if cache:
        cache.store(content, layers_of(stage, cache.layers))
    return content


def _from_cache(
    stage: Usd.Stage, stored: StoredScene, layers: Mapping[str, tuple[str, bytes]]
) -> _Reading:
    """What the cache holds of a stage; its light is read."""
    below = {mark.identifier: (mark.path, mark.digest) for mark in stored.layers}
    return _Reading(
        summary=stored.summary,
        light=read_light(stage, Usd.TimeCode.EarliestTime()),
        base=stored.content(0),
        regions=stored.regions,
        content=lambda region: stored.content(region.number),
        layers={**layers, **below},
    )

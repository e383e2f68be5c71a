"""Reads a stage region by region: payloads are loaded while they are read only."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Any

import numpy as np
from pxr import Sdf, Usd

from envgen_usd.errors import Issue
from envgen_usd.render.render_scene import Lamps
from envgen_usd.render.stage.loading_units import LoadingUnit, loading_units
from envgen_usd.render.stage.placed_parts import (
    Context,
    Placement,
    gathered_lamps,
    gathered_uses,
    templates_of,
    unlabelled,
)
from envgen_usd.render.stage.resolved_files import read_resolved
from envgen_usd.render.stage.stage_lamps import placed_lamps
from envgen_usd.render.stage.stage_reader import (
    bounds_of,
    composition_issues,
    unlabelled_issues,
)
from envgen_usd.render.stage.stage_regions import Content, Region
from envgen_usd.render.stage.stage_traversal import Traversal, no_gate, world_matrix
from envgen_usd.render.stage.sun_and_sky import has_light, read_light

_TIME = Usd.TimeCode.EarliestTime()


@dataclass(frozen=True)
class _Place:
    """The prim above the units of a region, and what its children inherit."""

    path: Sdf.Path
    units: tuple[LoadingUnit, ...]
    context: Context

    @property
    def prims(self) -> set[Sdf.Path]:
        """Paths of the units."""
        return {unit.path for unit in self.units}

    @property
    def payloads(self) -> set[Sdf.Path]:
        """What is loaded for the region."""
        return {path for unit in self.units for path in unit.payloads}


class StageSurvey:
    """What a stage holds, read once from end to end.

    Attributes:
        traversal: Materials, labels and lanes.
        regions: Regions with geometry.
        base: What is in no payload.
        composition: Composition errors.
        light: Sun and sky with their issues; `None` as long as none is loaded.
        layers: All layers by identifier, with the resolved path and the SHA-256 of each.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        layers: Mapping[str, tuple[str, bytes]],
        seen: Callable[[Region, Content], None],
        moving: Collection[Sdf.Path] = (),
    ) -> None:
        """Reads the stage.

        Args:
            stage: Stage without payloads.
            layers: Its layers, as `layers_of` gives them.
            seen: Called with each region.
            moving: Prims that are left out, with their payloads.
        """
        self.traversal = Traversal(stage, _TIME, self._enter)
        self.traversal.apart = frozenset(moving)
        self.regions: list[Region] = []
        self.composition: dict[Issue, None] = {}
        self.light = read_light(stage, _TIME) if has_light(stage) else None
        self._is_lit = self.light is not None
        self.layers = dict(layers)
        self._stage = stage
        self._seen: Callable[[Region, Content], None] = seen
        self._units = _units_of(stage, moving)
        self._places: dict[int, _Place] = {}
        self._lamps: list[Lamps] = []
        self._labelled = np.zeros(2, np.int64)
        self._note_loaded()
        self.traversal.visit(stage.GetPseudoRoot(), Context(world_matrix(stage)))
        self.traversal.finish()
        self.base = self._collected(0, self.traversal.placements)
        # Without cycles of references, the layers are closed as soon as nobody uses them.
        self.traversal.gate, self._seen = no_gate, _ignore

    @property
    def is_lit_outside(self) -> bool:
        """True if sun and sky are in no payload."""
        return self._is_lit or self.light is None

    @property
    def lamps(self) -> Lamps:
        """All lamps."""
        names = ("places", "powers", "axes", "flat", "edges")
        joined = {name: [getattr(each, name) for each in self._lamps] for name in names}
        return Lamps(**{name: np.concatenate(values) for name, values in joined.items()})

    @property
    def issues(self) -> tuple[Issue, ...]:
        """Warnings about prims."""
        return (
            *self.traversal.issues,
            *self.traversal.materials.issues,
            *self.traversal.semantics.issues(),
            *unlabelled_issues(*self._labelled.tolist()),
        )

    def content(self, region: Region) -> Content:
        """Loads a region, reads it, and unloads it."""
        return self._read(region.number, self._places[region.number])

    def _enter(self, prim: Usd.Prim, context: Context) -> bool:
        """Reads the region below a prim during the first traversal; False if there is none."""
        path = prim.GetPath()
        if path not in self._units:
            return False
        number = len(self.regions) + 1
        place = _Place(path, tuple(self._units.pop(path)), context)
        content = self._read(number, place)
        if content.uses:
            bounds = bounds_of(content.geometries, content.uses)
            region = Region(number, bounds, content.size)
            self.regions.append(region)
            self._places[number] = place
            self._seen(region, content)
        own = place.prims
        for child in prim.GetChildren():
            if child.GetPath() not in own:
                self.traversal.visit(child, context)
        return True

    def _read(self, number: int, place: _Place) -> Content:
        self._stage.LoadAndUnload(place.payloads, set())
        self._note_loaded()

        def visit() -> None:
            own = place.prims
            for child in self._stage.GetPrimAtPath(place.path).GetChildren():
                if child.GetPath() in own:
                    self.traversal.visit(child, place.context)

        content = self._collected(number, self.traversal.separately(visit))
        self._stage.LoadAndUnload(set(), place.payloads)
        return content

    def _collected(self, number: int, placements: list[Placement]) -> Content:
        geometries, uses = gathered_uses(placements, self.traversal.semantics.scene_object)
        self._lamps.append(placed_lamps(gathered_lamps(placements)))
        self._labelled += unlabelled(placements)
        marked = tuple(replace(use, region=number) for use in uses)
        return Content(geometries, marked, templates_of(placements))

    def _note_loaded(self) -> None:
        """Notes the layers, the composition errors and the light of what is loaded."""
        self.composition |= dict.fromkeys(composition_issues(self._stage))
        self.layers |= layers_of(self._stage, self.layers)
        if self.light is None and has_light(self._stage):
            self.light = read_light(self._stage, _TIME)


def _ignore(_region: Region, _content: Content) -> None:
    """For regions that are read again."""


def layers_of(
    stage: Usd.Stage, known: Mapping[str, tuple[str, bytes]] | None = None
) -> dict[str, tuple[str, bytes]]:
    """Layers in use besides the known ones: resolved path and SHA-256 by identifier."""
    found = {}
    for layer in stage.GetUsedLayers():
        if not known or layer.identifier not in known:
            digest = sha256(_layer_bytes(layer)).digest()
            found[layer.identifier] = str(layer.resolvedPath), digest
    return found


def _units_of(stage: Usd.Stage, moving: Collection[Sdf.Path]) -> dict[Sdf.Path, list[LoadingUnit]]:
    """What is loaded together, by the prim above it."""
    regions: dict[Sdf.Path, list[LoadingUnit]] = {}
    for unit in loading_units(stage, moving):
        regions.setdefault(unit.path.GetParentPath(), []).append(unit)
    return regions


def _layer_bytes(layer: Any) -> bytes:  # noqa: ANN401 - Sdf.Layer has no stub of its type
    if layer.anonymous or layer.dirty:
        return bytes(layer.ExportToString(), "utf-8")
    return read_resolved(str(layer.resolvedPath))

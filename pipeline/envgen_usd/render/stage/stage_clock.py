"""Times of a stage: seconds and time codes, and the prims whose place or visibility varies."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from envgen_usd.errors import Issue, Severity

_USUAL_RATE = 24.0
"""Time codes a second of a stage whose own rate is no rate: OpenUSD's default."""
_VISIBILITY = str(UsdGeom.Tokens.visibility)
_SHAPES = ("points", "normals", "positions", "orientations", "scales", "protoIndices")
"""Attributes of shapes, whose time samples are not drawn."""
_SILENT = {"specifier", "typeName", "kind", "documentation", "comment", "customData"}
"""Fields of a prim above moving ones that change nothing of what stands still."""


@dataclass(frozen=True)
class StageClock:
    """Seconds and time codes of a stage.

    Attributes:
        start: First time code.
        end: Last time code.
        rate: Time codes a second.
    """

    start: float
    end: float
    rate: float

    @property
    def duration(self) -> float:
        """Seconds from the first time code to the last."""
        return max(self.end - self.start, 0.0) / self.rate

    def code(self, seconds: float) -> Usd.TimeCode:
        """Time code of a time since the start; the first and the last hold beyond their side."""
        last = max(self.start, self.end)
        return Usd.TimeCode(min(max(self.start + seconds * self.rate, self.start), last))


def moving_paths(stage: Usd.Stage) -> tuple[tuple[Sdf.Path, ...], list[Issue]]:
    """Outermost prims whose transformation or visibility varies in time.

    The layers of the root layer stack are asked for their time samples; the prims of layers that
    they reference are asked one by one, and only if these have samples. Payloads are not loaded for
    that, so what only a payload animates stands still.

    Args:
        stage: Stage without payloads.

    Returns:
        The paths, sorted, and issues of samples that are not drawn.
    """
    stack = stage.GetLayerStack()
    moved: set[Sdf.Path] = set()
    other: dict[str, str] = {}
    for layer in stack:
        if layer.ListAllTimeSamples():
            _note_samples(layer, moved, other)
    referenced = [layer for layer in stage.GetUsedLayers() if layer not in stack]
    if any(layer.ListAllTimeSamples() for layer in referenced):
        moved.update(prim.GetPath() for prim in stage.Traverse() if is_animated(prim))
    moved = {path for path in moved if not _is_inactive(stage, path)}
    world = stage.GetDefaultPrim()
    issues = [_ignored(path, name) for path, name in sorted(other.items())]
    if world and world.GetPath() in moved:
        moved.discard(world.GetPath())
        issues.append(_ignored(str(world.GetPath()), "the transformation of the default prim"))
    outermost: list[Sdf.Path] = []
    for path in sorted(moved):
        if not outermost or not path.HasPrefix(outermost[-1]):
            outermost.append(path)
    return tuple(outermost), issues


def _is_inactive(stage: Usd.Stage, path: Sdf.Path) -> bool:
    """True if a prim or one above it is deactivated; such a prim cannot be loaded."""
    prims = (stage.GetPrimAtPath(each) for each in path.GetPrefixes())
    return any(prim and not prim.IsActive() for prim in prims)


def is_animated(prim: Usd.Prim) -> bool:
    """True if the transformation or the visibility of a prim itself varies in time."""
    if not prim.IsA("Imageable"):
        return False
    if UsdGeom.Imageable(prim).GetVisibilityAttr().ValueMightBeTimeVarying():
        return True
    return bool(prim.IsA("Xformable")) and UsdGeom.Xformable(prim).TransformMightBeTimeVarying()


def clock_of(stage: Usd.Stage, paths: Iterable[Sdf.Path]) -> StageClock:
    """The clock of a stage.

    The range is that of the root layer; else that of the first sublayer with a range; else that of
    the samples of the prims.
    """
    rate = float(stage.GetTimeCodesPerSecond())
    rate = rate if 0.0 < rate < np.inf else _USUAL_RATE
    if stage.HasAuthoredTimeCodeRange():
        return StageClock(stage.GetStartTimeCode(), stage.GetEndTimeCode(), rate)
    for layer in stage.GetLayerStack(includeSessionLayers=False):
        if layer.HasStartTimeCode() and layer.HasEndTimeCode():
            # USD scales the times of a sublayer with a rate of its own.
            scale = rate / layer.timeCodesPerSecond
            return StageClock(layer.startTimeCode * scale, layer.endTimeCode * scale, rate)
    times = [
        time
        for path in paths
        for attribute in stage.GetPrimAtPath(path).GetAuthoredAttributes()
        for time in attribute.GetTimeSamples()
    ]
    return StageClock(min(times, default=0.0), max(times, default=0.0), rate)


def moving_layers(stage: Usd.Stage, paths: Collection[Sdf.Path]) -> frozenset[str]:
    """Identifiers of the layers of the root layer stack that hold moving prims alone.

    What stands still does not follow from them, so a cache of it outlives their changes.

    Args:
        stage: The stage.
        paths: Outermost moving prims.
    """
    stack = stage.GetLayerStack(includeSessionLayers=False)
    frame = UsdGeom.Tokens.upAxis, UsdGeom.Tokens.metersPerUnit
    if not all(stack[0].pseudoRoot.HasInfo(key) for key in frame):
        return frozenset()  # a sublayer gives them to the whole stage
    found = set()
    for layer in stack:
        others = [other for other in stack if other is not layer]
        roots = list(layer.rootPrims)
        if layer.subLayerPaths or not roots or layer is stage.GetRootLayer():
            continue
        if all(_moves_alone(spec, others, frozenset(paths)) for spec in roots):
            found.add(layer.identifier)
    return frozenset(found)


def _moves_alone(
    spec: Sdf.PrimSpec, others: Collection[Sdf.Layer], paths: frozenset[Sdf.Path]
) -> bool:
    """True if a spec is a moving prim of its layer alone, or says nothing but holds such."""
    if spec.path in paths:
        return not any(other.GetPrimAtPath(spec.path) for other in others)
    silent = not spec.properties and set(spec.ListInfoKeys()) <= _SILENT
    return silent and all(_moves_alone(child, others, paths) for child in spec.nameChildren)


def _note_samples(layer: Sdf.Layer, moved: set[Sdf.Path], other: dict[str, str]) -> None:
    """Notes prims with samples of a transformation or a visibility, and other samples."""

    def note(named: Sdf.Path | str) -> None:
        path = Sdf.Path(named)
        if not path.IsPropertyPath() or layer.GetNumTimeSamplesForPath(path) < 2:
            return
        name, prim = path.name, path.GetPrimPath().StripAllVariantSelections()
        if name == _VISIBILITY or name.startswith("xformOp:"):
            moved.add(prim)
        elif name in _SHAPES or name.startswith("primvars:"):
            other.setdefault(str(prim), name)

    layer.Traverse(Sdf.Path.absoluteRootPath, note)


def _ignored(path: str, what: str) -> Issue:
    message = f"{what} has time samples"
    return Issue("stage.time_samples", Severity.WARNING, path, message, "drawn as at the start")

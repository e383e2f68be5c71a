"""Reads a composed stage, whoever made it, into a `Scene`."""

from pathlib import Path

import numpy as np
from pxr import Tf, Usd, UsdGeom

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.arrays import FloatArray
from envgen_usd.render.lights import read_light
from envgen_usd.render.parts import Context, Part
from envgen_usd.render.scene import Geometry, Scene, Use
from envgen_usd.render.semantics import Semantics
from envgen_usd.render.traverse import Traversal, world_matrix


def open_stage(path: Path) -> Usd.Stage:
    """Opens a stage with all its payloads.

    Raises:
        EnvgenError: If there is no such file, or if it is no USD file.
    """
    if not path.is_file():
        raise EnvgenError(f"render: there is no stage {path}; make one with `envgen-usd build`")
    try:
        return Usd.Stage.Open(str(path), Usd.Stage.LoadAll)
    except Tf.ErrorException as error:
        raise EnvgenError(f"render: {path} cannot be opened: it is no USD file") from error


def read_scene(stage: Usd.Stage) -> Scene:
    """Reads everything that is drawn, and the lanes that a camera can follow.

    Draws prims of purpose ``default`` and ``render`` that are visible, at the earliest time
    code. Instances and point instancers are expanded; each prototype's geometry is read once.

    Units and the upward axis of a sublayer hold where the root layer names none, as in a layer
    that only edits another stage: USD itself would take it to be in centimetres, y upwards.

    Raises:
        EnvgenError: If nothing on the stage can be drawn.
    """
    time = Usd.TimeCode.EarliestTime()
    adopted = _adopt_frame(stage)
    found = Traversal(stage, time)
    parts = found.parts(stage.GetPseudoRoot(), Context(matrix=world_matrix(stage)))
    if not parts:
        raise EnvgenError("render: the stage holds nothing that can be drawn")
    uses = _uses(parts, found.semantics)
    return Scene(
        geometries=tuple(found.geometries),
        uses=uses,
        materials=tuple(found.materials.materials),
        things=tuple(found.semantics.things),
        light=read_light(stage, time),
        lanes=tuple(found.lanes),
        bounds=_bounds(found.geometries, uses),
        issues=(
            *_composition_issues(stage),
            *adopted,
            *found.issues,
            *found.materials.issues,
            *found.semantics.issues(),
            *_unlabelled(parts),
        ),
    )


def _adopt_frame(stage: Usd.Stage) -> list[Issue]:
    """Takes over what the root layer does not say of axis and units, for this session."""
    root, *below = stage.GetLayerStack(includeSessionLayers=False)
    issues = []
    for key in (UsdGeom.Tokens.upAxis, UsdGeom.Tokens.metersPerUnit):
        named = [layer for layer in below if layer.pseudoRoot.HasInfo(key)]
        if root.pseudoRoot.HasInfo(key) or not named:
            continue
        value = named[0].pseudoRoot.GetInfo(key)
        stage.GetSessionLayer().pseudoRoot.SetInfo(key, value)
        message = f"names no {key}"
        mended = f"that of {named[0].GetDisplayName()}, {value}, is used"
        issues.append(
            Issue("stage.frame", Severity.WARNING, root.GetDisplayName(), message, mended)
        )
    return issues


def _uses(parts: list[Part], semantics: Semantics) -> tuple[Use, ...]:
    """Brings the places of each geometry together."""
    matrices: dict[int, list[FloatArray]] = {}
    things: dict[int, list[int]] = {}
    for part in parts:
        name = part.label or "void"
        matrices.setdefault(part.geometry, []).append(part.matrices)
        meant = [semantics.thing(name, owner, part.part or "") for owner in part.owners()]
        things.setdefault(part.geometry, []).extend(meant)
    return tuple(
        Use(geometry, np.concatenate(found), np.array(things[geometry], np.uint32))
        for geometry, found in matrices.items()
    )


def _composition_issues(stage: Usd.Stage) -> list[Issue]:
    """Files that were not found, references that lead nowhere, ..."""
    errors = stage.GetCompositionErrors()  # type: ignore[attr-defined] # types-usd lacks it
    places = [(str(error.rootSite.path), str(error)) for error in errors]
    kind = "stage.composition"
    return [Issue(kind, Severity.WARNING, place, text, "left out") for place, text in places]


def _unlabelled(parts: list[Part]) -> list[Issue]:
    count = sum(part.label is None for part in parts)
    if not count:
        return []
    message = f"{count} of {len(parts)} meshes name no class"
    return [Issue("stage.unlabelled", Severity.WARNING, "/", message, "void")]


def _bounds(geometries: list[Geometry], uses: tuple[Use, ...]) -> FloatArray:
    """Least and greatest corner of everything: 2 x 3."""
    found = [geometries[use.geometry].boxes(use.matrices) for use in uses]
    boxes = np.concatenate(found)
    return np.stack((boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)))

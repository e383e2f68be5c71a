"""Reads a composed stage of any program into a `Scene`."""

from collections.abc import Sequence
from math import inf
from pathlib import Path

import numpy as np
from pxr import Tf, Usd, UsdGeom

from envgen_usd.assets.stage_guard import refuse_deadly_layers
from envgen_usd.assets.usd_files import missing_stage, open_without_files, unreadable
from envgen_usd.cycle_collection import paused_collection
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Geometry, Scene, Use, extent
from envgen_usd.render.stage.placed_parts import Context, gathered_lamps, gathered_uses, unlabelled
from envgen_usd.render.stage.stage_lamps import placed_lamps
from envgen_usd.render.stage.stage_traversal import Traversal, world_matrix
from envgen_usd.render.stage.sun_and_sky import read_light


def open_stage(path: Path, *, payloads: bool = True, all_follow: bool = False) -> Usd.Stage:
    """Opens a stage, with all its payloads or without the files of any.

    Args:
        path: File of the stage.
        payloads: False leaves payloads unloaded.
        all_follow: True if they will be loaded: their layers are looked at, too.

    Raises:
        EnvgenError: The file does not exist or is not a USD file, or a layer is damaged so that
            OpenUSD cannot survive it.
    """
    if not path.is_file():
        raise missing_stage(path)
    refuse_deadly_layers(path, payloads=payloads or all_follow)
    try:
        return Usd.Stage.Open(str(path)) if payloads else open_without_files(path)
    except Tf.ErrorException as error:
        raise unreadable(path, "USD stage", error) from error


@paused_collection()
def read_scene(stage: Usd.Stage) -> Scene:
    """Reads all drawable prims, and the lanes for the camera.

    Draws visible prims of purpose ``default`` and ``render`` at the earliest time code. Instances
    and point instancers are expanded; each prototype's geometry is read once.

    If the root layer gives no units or up axis, as in a layer of overrides, those of a sublayer
    hold. USD would assume centimetres and y up.

    Raises:
        EnvgenError: The stage has no drawable prims.
    """
    time = Usd.TimeCode.EarliestTime()
    adopted = adopt_frame(stage)
    traversal = Traversal(stage, time)
    traversal.visit(stage.GetPseudoRoot(), Context(matrix=world_matrix(stage)))
    traversal.finish()
    geometries, uses = gathered_uses(traversal.placements, traversal.semantics.scene_object)
    if not uses:
        raise EnvgenError("the stage has no drawable prims")
    light, light_issues = read_light(stage, time)
    return Scene(
        geometries=geometries,
        uses=uses,
        materials=tuple(traversal.materials.materials),
        scene_objects=tuple(traversal.semantics.scene_objects),
        light=light,
        lanes=tuple(traversal.lanes),
        lamps=placed_lamps(gathered_lamps(traversal.placements)),
        bounds=bounds_of(geometries, uses),
        issues=(
            *composition_issues(stage),
            *adopted,
            *light_issues,
            *traversal.issues,
            *traversal.materials.issues,
            *traversal.semantics.issues(),
            *unlabelled_issues(*unlabelled(traversal.placements)),
        ),
    )


def adopt_frame(stage: Usd.Stage) -> list[Issue]:
    """Adopts missing up axis and units from a sublayer, as opinions of the session layer.

    Raises:
        EnvgenError: The units are no length.
    """
    root, *below = stage.GetLayerStack(includeSessionLayers=False)
    issues = []
    for key in (UsdGeom.Tokens.upAxis, UsdGeom.Tokens.metersPerUnit):
        named = [layer for layer in below if layer.pseudoRoot.HasInfo(key)]
        if root.pseudoRoot.HasInfo(key) or not named:
            continue
        value = named[0].pseudoRoot.GetInfo(key)
        stage.GetSessionLayer().pseudoRoot.SetInfo(key, value)
        message = f"has no {key}"
        repair = f"{value} of sublayer {named[0].GetDisplayName()} is used"
        issues.append(
            Issue("stage.frame", Severity.WARNING, root.GetDisplayName(), message, repair)
        )
    metres = UsdGeom.GetStageMetersPerUnit(stage)
    if not 0.0 < metres < inf:
        name = root.realPath or root.identifier
        raise EnvgenError(f"{name}: metersPerUnit is {metres:g}; give a number above 0")
    return issues


def composition_issues(stage: Usd.Stage) -> list[Issue]:
    """Composition errors: missing files, unresolved references, ..."""
    errors = stage.GetCompositionErrors()  # type: ignore[attr-defined] # types-usd lacks it
    places = [(str(error.rootSite.path), _text(error)) for error in errors]
    kind = "stage.composition"
    return [Issue(kind, Severity.WARNING, place, text, "left out") for place, text in places]


def _text(error: object) -> str:
    """What an error says; its kind where damaged paths make it no text."""
    try:
        return str(error)
    except UnicodeDecodeError:
        return f"{type(error).__name__} about a path that is no text"


def unlabelled_issues(count: int, total: int) -> list[Issue]:
    """An issue if some of the meshes have no class label."""
    if not count:
        return []
    message = f"{count} of {total} meshes have no class label"
    return [Issue("stage.unlabelled", Severity.WARNING, "/", message, "void")]


def bounds_of(geometries: Sequence[Geometry], uses: Sequence[Use]) -> FloatArray:
    """Bounding box of the scene: 2 x 3, minimum and maximum corner."""
    ends = [extent(geometries[use.geometry].points) for use in uses]
    low, high = (np.array(corners) for corners in zip(*ends, strict=True))
    counts = [len(use.matrices) for use in uses]
    matrices = np.concatenate([use.matrices for use in uses])
    middle, half = (np.repeat(v, counts, axis=0) for v in ((low + high) / 2, (high - low) / 2))
    places = np.einsum("nij,nj->ni", matrices[:, :3, :3], middle) + matrices[:, :3, 3]
    reach = np.einsum("nij,nj->ni", np.abs(matrices[:, :3, :3]), half)
    return np.stack(((places - reach).min(axis=0), (places + reach).max(axis=0)))

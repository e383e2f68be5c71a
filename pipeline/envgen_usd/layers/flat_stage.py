"""Flattens a stage into a single file, for readers without composition or instances."""

import os
from pathlib import Path

from pxr import Sdf, Tf, Usd, UsdUtils

from envgen_usd.assets.stage_guard import refuse_deadly_layers
from envgen_usd.assets.usd_files import missing_stage, unreadable, write_layer
from envgen_usd.errors import EnvgenError
from envgen_usd.layers.usdz_package import write_package
from envgen_usd.output_files import check_output_file
from envgen_usd.whole_files import make_folder, refuse_own_input


def flatten_stage(stage: Path, target: Path, *, deinstance: bool = False) -> None:
    """Writes a stage as a single layer without references, payloads, variants and sublayers.

    Args:
        stage: Composed stage.
        target: .usda or .usdc, which references textures by relative paths; or .usdz, which
            contains them.
        deinstance: Also replace each instance by a copy of its prototype (three.js's loader and
            tinyusdz ignore instances).

    Raises:
        EnvgenError: The stage cannot be read, or the target cannot be written or is one of the
            stage's own layers.
    """
    if target.suffix not in {".usda", ".usdc", ".usdz"}:
        raise EnvgenError(f"{target}: choose a name that ends in .usda, .usdc or .usdz")
    check_output_file(target)
    opened = _opened(stage)
    _refuse_own_layer(opened, target)
    layer = _flattened(opened, deinstance)
    if target.suffix != ".usdz":
        UsdUtils.ModifyAssetPaths(layer, lambda path: _relative(path, target.absolute().parent))
        write_layer(layer, target)
        return
    make_folder(target.parent)
    write_package(layer, target)


def _opened(stage: Path) -> Usd.Stage:
    if not stage.is_file():
        raise missing_stage(stage)
    refuse_deadly_layers(stage)
    try:
        return Usd.Stage.Open(str(stage))
    except Tf.ErrorException as error:
        raise unreadable(stage, "USD stage", error) from error


def _refuse_own_layer(stage: Usd.Stage, target: Path) -> None:
    """Refuses to write over a layer that the stage is composed of, also a muted one.

    Raises:
        EnvgenError: The target is such a layer.
    """
    files = {layer.realPath for layer in stage.GetUsedLayers()} | {*stage.GetMutedLayers()}
    refuse_own_input(target, *(Path(file) for file in files if file))


def _flattened(opened: Usd.Stage, deinstance: bool) -> Sdf.Layer:
    if deinstance:
        _deinstance(opened)
    return opened.Flatten(addSourceFileComment=False)


def _deinstance(stage: Usd.Stage) -> None:
    """Switches off all instancing, also nested, with opinions in the session layer."""
    stage.SetEditTarget(stage.GetSessionLayer())
    while True:
        paths = [prim.GetPath() for prim in stage.Traverse() if prim.IsInstance()]
        if not paths:
            return
        with Sdf.ChangeBlock():
            for path in paths:
                Sdf.CreatePrimInLayer(stage.GetSessionLayer(), path).instanceable = False


def _relative(path: str, folder: Path) -> str:
    if not path or not Path(path).is_absolute():
        return path
    return Path(os.path.relpath(path, folder)).as_posix()

"""Reads and writes USD layers."""

import re
from pathlib import Path

from pxr import Sdf, Tf, Usd

from envgen_usd.errors import EnvgenError, error_text
from envgen_usd.output_folder import STAGE_FILE
from envgen_usd.whole_files import make_folder, whole_file

_PLACE = re.compile(r":(\d+):(\d+): (.+?)\s*'\s*$", re.MULTILINE)
"""Line, column and reason in what OpenUSD says of a text that it cannot parse."""


def new_layer(default_prim: str) -> Sdf.Layer:
    """An in-memory layer, in metres and z up."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.defaultPrim = default_prim
    layer.pseudoRoot.SetInfo("metersPerUnit", 1.0)
    layer.pseudoRoot.SetInfo("upAxis", "Z")
    return layer


def write_layer(layer: Sdf.Layer, path: Path) -> None:
    """Writes a layer whole or not at all.

    Args:
        layer: Layer to write.
        path: Target; its suffix (.usda, .usdc) sets the format.

    Raises:
        EnvgenError: The file cannot be written.
    """
    make_folder(path.parent)
    with whole_file(path, Tf.ErrorException) as part:
        layer.Export(str(part))


def read_layer(path: Path) -> Sdf.Layer:
    """Reads a layer from disk, without USD's cache of the path.

    Raises:
        EnvgenError: The file is missing or not a USD layer.
    """
    if not path.is_file():
        raise EnvgenError(f"{path}: no such USD layer")
    try:
        return Sdf.Layer.OpenAsAnonymous(str(path))
    except Tf.ErrorException as error:
        raise unreadable(path, "USD layer", error) from error


def unreadable(path: Path, kind: str, error: Tf.ErrorException, remedy: str = "") -> EnvgenError:
    """What OpenUSD says of a file that it cannot read, as one line; names the place in a text."""
    place = _PLACE.search(error_text(error))
    where = f": line {place[1]}, column {place[2]}: {place[3]}" if place else ""
    return EnvgenError(f"{path}: cannot be read as a {kind}{where}{remedy and '; '}{remedy}")


def missing_stage(path: Path) -> EnvgenError:
    """Says that a file is no stage; of a folder with a stage, which file that is."""
    inner = path / STAGE_FILE
    if inner.is_file():
        return EnvgenError(f"{path}: is a folder; name its stage, {inner}")
    if path.is_dir():
        return EnvgenError(f"{path}: is a folder without {STAGE_FILE}; name the stage of a build")
    if (path.parent / "chunks").is_dir():
        return EnvgenError(f"{path}: is missing, the build is unfinished; run envgen-usd build")
    return EnvgenError(f"{path}: no such stage; build it with `envgen-usd build`")


def open_without_files(path: Path) -> Usd.Stage:
    """Opens a stage without the files of its payloads.

    Payloads that refer to the stage itself are loaded, as they read no file: the children of a
    chunk are then prims with payloads and extents.

    Raises:
        Tf.ErrorException: The file is not a USD file.
    """
    stage = Usd.Stage.Open(str(path), Usd.Stage.LoadNone)
    while inner := {
        path
        for path in {*stage.FindLoadable()} - {*stage.GetLoadSet()}
        if _is_internal(stage, path)
    }:
        stage.LoadAndUnload(inner, set(), Usd.LoadWithoutDescendants)
    return stage


def _is_internal(stage: Usd.Stage, path: Sdf.Path) -> bool:
    """True if all payloads of a prim refer to its own layers."""
    payloads = stage.GetPrimAtPath(path).GetMetadata("payload")
    items = payloads.GetAppliedItems() if payloads else []
    return bool(items) and not any(item.assetPath for item in items)

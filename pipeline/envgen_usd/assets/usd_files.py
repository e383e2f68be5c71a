"""Reads and writes USD layers."""

from pathlib import Path

from pxr import Sdf, Tf

from envgen_usd.errors import EnvgenError
from envgen_usd.whole_files import make_folder, whole_file


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
        raise EnvgenError(f"{path}: cannot be read as a USD layer") from error

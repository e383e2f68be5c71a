"""Reads and writes USD layers."""

import os
from pathlib import Path

from pxr import Sdf, Tf

from envgen_usd.errors import EnvgenError


def new_layer(default_prim: str) -> Sdf.Layer:
    """A layer in memory, in metres and z up."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.defaultPrim = default_prim
    layer.pseudoRoot.SetInfo("metersPerUnit", 1.0)
    layer.pseudoRoot.SetInfo("upAxis", "Z")
    return layer


def write_layer(layer: Sdf.Layer, path: Path) -> None:
    """Writes a layer so that the file is either the old one or the whole new one.

    Args:
        layer: What to write.
        path: Target; its ending (.usda, .usdc) sets the format.

    Raises:
        EnvgenError: The file cannot be written.
    """
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        layer.Export(str(temporary))
        temporary.replace(path)
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be written: {error.strerror}") from error
    except Tf.ErrorException as error:
        raise EnvgenError(f"{path}: cannot be written; is the disk full?") from error
    finally:
        temporary.unlink(missing_ok=True)


def read_layer(path: Path) -> Sdf.Layer:
    """Reads a layer afresh, whatever was read from that path before.

    Raises:
        EnvgenError: The file is missing or no USD layer.
    """
    if not path.is_file():
        raise EnvgenError(f"{path}: no such USD layer")
    try:
        return Sdf.Layer.OpenAsAnonymous(str(path))
    except Tf.ErrorException as error:
        raise EnvgenError(f"{path}: cannot be read as a USD layer") from error

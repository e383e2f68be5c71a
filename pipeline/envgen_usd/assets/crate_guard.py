"""Finds damaged binary layers that end a process, before this process reads them.

OpenUSD trusts binary layers (crate files): a changed bit in one can end the process without an
exception. So another process reads them first, with all their values.
"""

import os
import resource
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from pxr import Sdf, Tf, Usd, UsdUtils

from envgen_usd.errors import EnvgenError

_SECONDS = 60.0
"""Time for a single layer; a larger value forgives slower disks."""
_MEMORY = 3 << 30
"""Bytes that the other process may take; a larger value reads larger layers."""


def deadly_layers(layers: Sequence[Path]) -> frozenset[Path]:
    """The layers that ended a process which read them, or kept it busy for too long.

    Raises:
        EnvgenError: The process could not work for another reason.
    """
    found: set[Path] = set()
    waiting = [path.absolute() for path in layers]
    names = dict(zip(waiting, layers, strict=True))
    while waiting:
        read = _read_by_another(waiting)
        found |= {names[path] for path in waiting[read : read + 1]}
        waiting = waiting[read + 1 :]
    return frozenset(found)


def _read_by_another(layers: Sequence[Path]) -> int:
    """Number of layers that a new process read, one after another, before it ended."""
    # -P: code comes from the installation, and not from the folder in which the command runs.
    command = (sys.executable, "-P", "-m", "envgen_usd.assets.crate_guard")
    asked = b"".join(os.fsencode(path) + b"\0" for path in layers)
    limit = _SECONDS * len(layers)
    try:  # in a folder without layers: one that is read alone finds none by a relative path
        done = subprocess.run(
            command, input=asked, capture_output=True, timeout=limit, check=False, cwd="/"
        )
        said = done.stdout
        last = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        # A signal has a number below 0; the C library ends a process without memory by 127.
        if done.returncode > 0 and done.returncode != 127 and "MemoryError" not in last:
            raise EnvgenError(f"{layers[said.count(b'.')]}: cannot be read: {last}")
    except subprocess.TimeoutExpired as error:
        said = error.stdout or b""
    return said.count(b".")


def _read_all() -> None:
    """Reads the layers that standard input names, and writes a point for each."""
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    limit = _MEMORY if most == resource.RLIM_INFINITY else min(_MEMORY, most)
    resource.setrlimit(resource.RLIMIT_AS, (limit, most))
    for name in sys.stdin.buffer.read().split(b"\0")[:-1]:
        with suppress(Tf.ErrorException):  # is told where the layer is checked
            _read(Sdf.Layer.OpenAsAnonymous(os.fsdecode(name)))
        sys.stdout.write(".")
        sys.stdout.flush()


def _read(layer: Sdf.Layer) -> None:
    """Reads all values, which OpenUSD unpacks no earlier, and composes the layer alone."""

    def visit(path: Sdf.Path | str) -> None:
        spec = layer.GetObjectAtPath(path)
        for key in spec.ListInfoKeys() if spec else ():
            with suppress(TypeError):  # Python knows no offsets of sublayers
                spec.GetInfo(key)
        for time in layer.ListTimeSamplesForPath(path):
            layer.QueryTimeSample(path, time)

    layer.Traverse(Sdf.Path.absoluteRootPath, visit)
    UsdUtils.ModifyAssetPaths(layer, lambda path: path)
    stage = Usd.Stage.Open(layer, Usd.Stage.LoadNone)
    for prim in stage.TraverseAll():
        prim.GetAttributes()


if __name__ == "__main__":
    _read_all()

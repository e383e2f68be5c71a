"""Finds damaged binary layers that end a process, before this process reads them.

OpenUSD trusts binary layers (crate files): a changed bit in one can end the process without an
exception. So another process reads them first, with all their values.
"""

import os
import resource
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from select import select
from subprocess import PIPE, Popen
from tempfile import TemporaryFile

from pxr import Sdf, Tf, Usd, UsdUtils

from envgen_usd.errors import EnvgenError

_SECONDS = 30.0
"""Time for a single layer; a larger value forgives slower disks."""
_MEMORY = 3 << 30
"""Bytes for layers in the other process; a larger value reads larger layers."""
_ONE_THREAD = {"PXR_WORK_THREAD_LIMIT": "1", "OPENBLAS_NUM_THREADS": "1"}
"""Threads of many processors would take the memory that is left for layers."""


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
    with TemporaryFile() as asked, TemporaryFile() as complaint:
        asked.writelines(os.fsencode(path) + b"\0" for path in layers)
        asked.seek(0)
        # In a folder without layers: one that is read alone finds none by a relative path.
        with Popen(
            command,
            stdin=asked,
            stdout=PIPE,
            stderr=complaint,
            cwd="/",
            env=os.environ | _ONE_THREAD,
        ) as process:
            try:
                read = _count(process)
            finally:
                process.kill()
        complaint.seek(0)
        last = complaint.read().decode(errors="replace").strip().rpartition("\n")[2]
    # A signal has a number below 0; the C library ends a process without memory by 127.
    by_itself = process.returncode > 0 and process.returncode != 127 and "MemoryError" not in last
    if by_itself:
        raise EnvgenError(f"{layers[read]}: cannot be read: {last}")
    return read


def _count(process: "Popen[bytes]") -> int:
    """Points that a process writes, until it ends or writes none for too long."""
    assert process.stdout is not None
    read = 0
    while select([process.stdout], [], [], _SECONDS)[0]:
        points = os.read(process.stdout.fileno(), 1 << 16)
        if not points:
            process.wait()
            break
        read += points.count(b".")
    return read


def _read_all() -> None:
    """Reads the layers that standard input names, and writes a point for each."""
    _limit_memory()
    for name in sys.stdin.buffer.read().split(b"\0")[:-1]:
        with suppress(Tf.ErrorException):  # is told where the layer is checked
            _read(Sdf.Layer.OpenAsAnonymous(os.fsdecode(name)))
        sys.stdout.write(".")
        sys.stdout.flush()


def _limit_memory() -> None:
    """Bounds the memory of this process beyond what all imports take."""
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + _MEMORY
    limit = limit if most == resource.RLIM_INFINITY else min(limit, most)
    resource.setrlimit(resource.RLIMIT_AS, (limit, most))


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

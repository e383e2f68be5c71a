"""Work of fixtures that all processes of the tests share."""

import fcntl
import os
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest

Made = TypeVar("Made")


def kept(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], Made]) -> Made:
    """Does the work of a fixture once for all processes, which wait for the first of them.

    Tests of one module run in several processes, and each of them built the same town anew. What
    is made lies in one folder for all: tests read it, and change copies of it.

    Args:
        factory: Knows the folder of this run of the tests.
        name: Of the work; the same in all processes, and of no other work.
        make: Called with a new folder; returns what `pickle` can write.

    Returns:
        What `make` has returned.
    """
    base = factory.getbasetemp()
    of_all = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, result = of_all / f"kept_{name}", of_all / f"kept_{name}.pickle"
    with (of_all / f"kept_{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not result.is_file():
            shutil.rmtree(folder, ignore_errors=True)  # of a process that failed
            folder.mkdir()
            result.write_bytes(pickle.dumps(make(folder)))
    found: Made = pickle.loads(result.read_bytes())
    return found

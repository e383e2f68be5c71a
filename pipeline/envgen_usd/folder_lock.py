"""A lock on a folder, so that two builds never share an output folder."""

import fcntl
import json
import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from envgen_usd.errors import EnvgenError
from envgen_usd.whole_files import make_folder

LOCK_FILE = ".lock"


@contextmanager
def locked(folder: Path, *, wait: bool = False, shared: bool = False) -> Iterator[None]:
    """Locks a folder for this process; creates a missing folder.

    The operating system releases the lock when the process ends. Folders that were created for the
    lock and stay empty are removed again.

    Args:
        folder: The folder.
        wait: Wait for a process that holds the lock, instead of raising an error.
        shared: Others may hold the lock, too, if they share it as well.

    Raises:
        EnvgenError: Another process holds the lock; the message names the process and its age.
    """
    folder = folder.absolute()
    created = [path for path in (folder, *folder.parents) if not path.exists()]
    path = folder / LOCK_FILE
    handle = _acquire(path, wait=wait, shared=shared)
    try:
        yield
    finally:
        # Removed while locked: a waiting process detects the missing file and creates another.
        # Of those that share the lock, the last one gets it alone.
        if not shared or _is_alone(handle):
            path.unlink(missing_ok=True)
        os.close(handle)
        for parent in created:
            _remove_empty(parent)


def _acquire(path: Path, *, wait: bool, shared: bool) -> int:
    while True:
        make_folder(path.parent)  # again if the process before removed an empty folder
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
            fcntl.flock(handle, kind | (0 if wait else fcntl.LOCK_NB))
        except OSError as error:
            os.close(handle)
            raise EnvgenError(_refusal(path)) from error
        if _is_file_of(path, handle):
            owner = {"process": os.getpid(), "host": socket.gethostname(), "begun": time.time()}
            os.truncate(handle, 0)
            os.write(handle, json.dumps(owner).encode())
            return handle
        os.close(handle)


def _is_alone(handle: int) -> bool:
    """Makes a shared lock an exclusive one; False if others hold it, too."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _is_file_of(path: Path, handle: int) -> bool:
    """False if the file was removed between opening and locking it."""
    try:
        return os.path.samestat(path.stat(), os.fstat(handle))
    except FileNotFoundError:
        return False


def _refusal(path: Path) -> str:
    try:
        owner = json.loads(path.read_text("utf-8"))
        minutes = (time.time() - float(owner["begun"])) / 60
        who = f"process {owner['process']} on {owner['host']}, for {minutes:.0f} min"
    except (OSError, ValueError, KeyError, TypeError):
        who = "another process"
    return f"{path.parent}: is being built by {who}; wait for it, or choose another --out"


def _remove_empty(folder: Path) -> None:
    try:
        folder.rmdir()
    except OSError:
        return

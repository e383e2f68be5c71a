"""Writes files whole: readers see the old content or the new, never a part."""

import errno
import os
import shutil
import socket
import stat
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path

from envgen_usd.errors import EnvgenError, error_text
from envgen_usd.interrupts import interrupts_held_back

PART_PREFIX = ".envgen-usd."
"""Begin of the names under which files are written before they are renamed."""
_NO_FOLDER = "Give a path in a folder that exists."
_FULL = "Free space on the disk, or choose another folder."
_REMEDIES = {
    errno.ENOENT: _NO_FOLDER,
    errno.ENOTDIR: _NO_FOLDER,
    errno.EISDIR: "Give the path of a file, not of a folder.",
    errno.EEXIST: "A file is in the way; choose another folder.",
    errno.EACCES: "Choose another folder, or change who may write there.",
    errno.EROFS: "Choose another folder.",
    errno.ENOSPC: _FULL,
    errno.EDQUOT: _FULL,
}


def write_whole(path: Path, content: str | bytes) -> None:
    """Writes a file whole or not at all; text is written as UTF-8.

    Raises:
        EnvgenError: The file cannot be written, e.g. because the disk is full.
    """
    with whole_file(path) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)


@contextmanager
def whole_file(
    path: Path, *failures: type[Exception], within: Path | None = None
) -> Iterator[Path]:
    """Yields the path of a new file that replaces `path` if the block ends without an error.

    The new file has the name of `path` and lies in a temporary folder beside it, so the move is
    atomic. The temporary folder is always removed. Permissions are those of `open`: an existing
    file keeps its mode. A symbolic link stays, and its target is replaced. A device or a pipe is
    written in place.

    Args:
        path: File to write; its folder has to exist.
        failures: Exceptions besides `OSError` with which the block's library reports a failed
            write.
        within: A `shared_part_folder` instead of a folder for this file alone.

    Raises:
        EnvgenError: The file cannot be written, e.g. because the disk is full.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file() and not target.is_dir():
        with _errors_named(path, target, (OSError, *failures)):
            yield target
        return
    with _errors_named(path, target.parent, (OSError, *failures)):
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
        with nullcontext(within) if within else part_folder(target.parent) as folder:
            part = folder / target.name
            mode = _mode(target) if target.exists() else _mode_when_new(part)
            yield part
            part.chmod(mode)  # safetensors creates files that only the owner can read
            part.replace(target)


@contextmanager
def part_folder(beside: Path) -> Iterator[Path]:
    """A folder for unfinished content, whose name tells the process; it is removed at the end.

    Args:
        beside: Folder in which it lies, on the disk of what its content replaces.
    """
    prefix = f"{PART_PREFIX}{socket.gethostname()}.{os.getpid()}."
    with temporary_folder(beside, prefix) as folder:
        yield folder


@contextmanager
def temporary_folder(beside: Path, prefix: str) -> Iterator[Path]:
    """A new folder in another one, with a prefix to its name; it is removed at the end.

    An interrupt comes before the folder or once it is known, and never leaves it behind.
    """
    with ExitStack() as stack:
        with interrupts_held_back():
            folder = tempfile.TemporaryDirectory(dir=beside, prefix=prefix)
            stack.enter_context(folder)
        yield Path(folder.name)


@contextmanager
def shared_part_folder(beside: Path) -> Iterator[Path]:
    """A `part_folder` for many small files, one after another: to remove one takes milliseconds.

    Args:
        beside: Folder at or below which the files lie.

    Raises:
        EnvgenError: The folder takes no files.
    """
    make_folder(beside)
    with _errors_named(beside, beside, (OSError,)), part_folder(beside) as folder:
        yield folder


def remove_abandoned(folder: Path) -> None:
    """Removes what killed processes left of files that they were writing at or below a folder.

    Parts of processes that run, and of other machines, stay: they may be at work.
    """
    for path in folder.rglob(f"{PART_PREFIX}*"):
        _, _, owner = path.name.partition(PART_PREFIX)
        host, _, process = owner.rpartition(".")[0].rpartition(".")
        if host == socket.gethostname() and not _runs(process):
            shutil.rmtree(path, ignore_errors=True)


def _runs(process: str) -> bool:
    """True for the number of a process that runs; one that has ended may wait for its parent."""
    try:
        os.kill(int(process), 0)
    except PermissionError:  # of another user
        return True
    except (ProcessLookupError, ValueError, OverflowError):
        return False
    with suppress(OSError):
        state = Path("/proc", process, "stat").read_text("utf-8", "replace").rpartition(")")[2]
        return state.split()[0] not in {"Z", "X"}
    return True


def refuse_own_input(target: Path, *sources: Path | None) -> None:
    """Refuses to write over a file that the same command reads.

    Raises:
        EnvgenError: The target is one of the sources, also by another name.
    """
    for source in sources:
        if source is not None and target.exists() and source.exists() and target.samefile(source):
            raise EnvgenError(f"{target}: is what the command reads; choose another name")


def make_folder(folder: Path) -> None:
    """Creates a folder and its parents, unless it exists.

    Raises:
        EnvgenError: The folder cannot be created.
    """
    with _errors_named(folder, Path("/"), (OSError,)):
        folder.mkdir(parents=True, exist_ok=True)


def _mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def _mode_when_new(path: Path) -> int:
    """Permissions that `open` gives to a new file."""
    path.touch()
    mode = _mode(path)
    path.unlink()
    return mode


@contextmanager
def _errors_named(path: Path, place: Path, kinds: tuple[type[Exception], ...]) -> Iterator[None]:
    """Turns an OS error at or below a path into an `EnvgenError` that names the path.

    An `OSError` with another path comes from a file that the block reads.
    """
    try:
        yield
    except kinds as error:
        named = getattr(error, "filename", None)
        if isinstance(named, str) and not Path(named).absolute().is_relative_to(place):
            raise
        reason = getattr(error, "strerror", None) or _first_line(error)
        remedy = _REMEDIES.get(getattr(error, "errno", None) or 0, "Is the disk full?")
        raise EnvgenError(f"{path}: cannot be written: {reason}. {remedy}") from error


def _first_line(error: Exception) -> str:
    return next(iter(error_text(error).strip().splitlines()), type(error).__name__).rstrip(".")

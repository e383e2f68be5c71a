"""The folder of an environment: may it be written, its making, and what is removed from it."""

import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.manifest import read_manifest


def check_output(out: Path) -> None:
    """Makes sure that a folder can take an environment without anything being lost.

    Raises:
        EnvgenError: It is a file, cannot be written, or holds something else.
    """
    if out.exists() and not out.is_dir():
        raise EnvgenError(f"{out}: is a file; choose a folder for --out")
    if out.is_dir() and any(out.iterdir()) and not (out / "chunks").is_dir():
        raise EnvgenError(f"{out}: holds other files; choose an empty or a new folder for --out")
    read_manifest(out)
    check_writable(out)
    if (out / "chunks").exists():
        check_writable(out / "chunks")


def check_writable(folder: Path) -> None:
    """Makes sure that files can be made in a folder, or that the folder can be made; leaves none.

    Raises:
        EnvgenError: They cannot.
    """
    parent = next(p for p in (folder.absolute(), *folder.absolute().parents) if p.exists())
    try:
        Path(tempfile.mkdtemp(dir=parent, prefix=".envgen-usd.")).rmdir()
    except OSError as error:
        raise EnvgenError(
            f"{folder}: cannot be written ({error.strerror}); choose another --out"
        ) from error


def create_folder(out: Path) -> Path:
    """Makes the folders of an environment and returns its absolute path."""
    try:
        (out / "chunks").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvgenError(
            f"{out}: cannot be made ({error.strerror}); choose another --out"
        ) from error
    return out.absolute()


def remove_unfinished(folder: Path) -> None:
    """Removes what processes that were ended had begun in the folder of chunks."""
    for path in folder.glob(".*"):
        shutil.rmtree(path, ignore_errors=True)


def remove_other_chunks(folder: Path, chunks: Sequence[Chunk]) -> None:
    """Removes the folders of chunks that an earlier build of another road left."""
    names = {chunk.name for chunk in chunks}
    for path in folder.iterdir():
        if path.name not in names:
            shutil.rmtree(path)

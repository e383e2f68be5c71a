"""The output folder of an environment: names, checks, creation, removal of stale files."""

import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from envgen_usd.build_manifest import NAME as MANIFEST
from envgen_usd.chunks import CITY_FILE, Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.folder_lock import LOCK_FILE
from envgen_usd.whole_files import PART_PREFIX, make_folder

STAGE_FILE = "stage.usda"
"""Name of the composed stage."""
DRAWING_FILE = "map.svg"
"""Name of the drawing of the road network."""
REPORT_FILE = "report.html"
"""Name of the report of a build."""


def check_output(out: Path) -> None:
    """Checks that a folder can take an environment without loss of other files.

    Raises:
        EnvgenError: The path is a file, cannot be written, or holds other files, also among its
            chunks.
    """
    if out.exists() and not out.is_dir():
        raise EnvgenError(f"{out}: is a file; choose a folder for --out")
    others = [p for p in out.iterdir() if p.name != LOCK_FILE] if out.is_dir() else []
    if others and not (out / "chunks").is_dir():
        raise EnvgenError(f"{out}: holds other files; choose an empty or a new folder for --out")
    check_writable(out)
    if (out / "chunks").exists():
        check_writable(out / "chunks")
        _check_chunk_folders(out / "chunks")


def _check_chunk_folders(chunks: Path) -> None:
    """Checks that the folder of the chunks holds nothing but folders and hidden files.

    A chunk could not take the place of a file of its name, and no build removes other files.

    Raises:
        EnvgenError: It holds a file.
    """
    for path in sorted(chunks.iterdir()):
        if not path.is_dir() and not path.name.startswith("."):
            raise EnvgenError(
                f"{path}: is a file among the folders of chunks; remove it, or choose another --out"
            )


def refuse_build(out: Path) -> None:
    """Checks that a folder is none of a build, whose report other commands would overwrite.

    Raises:
        EnvgenError: It holds a build.
    """
    if (out / "chunks").is_dir():
        raise EnvgenError(f"{out}: holds the environment of a build; choose another --out")


def check_writable(folder: Path) -> None:
    """Checks that a folder is writable or can be created; leaves no file.

    Raises:
        EnvgenError: The folder cannot be written.
    """
    parent = next(p for p in (folder.absolute(), *folder.absolute().parents) if p.exists())
    try:
        Path(tempfile.mkdtemp(dir=parent, prefix=".envgen-usd.")).rmdir()
    except OSError as error:
        raise EnvgenError(
            f"{folder}: cannot be written ({error.strerror}); choose another folder"
        ) from error


def create_folder(out: Path) -> Path:
    """Creates the folders of an environment and returns its absolute path."""
    make_folder(out / "chunks")
    return out.absolute()


def remove_unfinished(out: Path) -> None:
    """Removes the unfinished output of killed processes.

    Products are written under a hidden name and then renamed, so that none is half-written.

    Args:
        out: Folder of an environment that this process has locked.
    """
    for path in [*(out / "chunks").glob(".*"), *out.rglob(f"{PART_PREFIX}*")]:
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def remove_unfinished_chunks(out: Path, chunks: Sequence[Chunk]) -> None:
    """Removes the unfinished output of killed processes for some chunks; others may be at work."""
    for chunk in chunks:
        for path in (out / "chunks").glob(f".{chunk.name}.*"):
            shutil.rmtree(path, ignore_errors=True)


def withdraw_stage(out: Path) -> None:
    """Removes what tells of all chunks together, before the first of them changes.

    A build that ends early then leaves an unfinished build, which no command takes for a finished
    one, and not the stage and the manifest of an earlier build over chunks of two.

    Args:
        out: Folder of an environment that this process has locked; other shards may be at work.
    """
    for name in (MANIFEST, STAGE_FILE, CITY_FILE, DRAWING_FILE, REPORT_FILE):
        (out / name).unlink(missing_ok=True)


def remove_other_chunks(folder: Path, chunks: Sequence[Chunk]) -> None:
    """Removes the chunks of an earlier build of another road."""
    names = {chunk.name for chunk in chunks}
    for path in folder.iterdir():
        if path.name not in names:
            shutil.rmtree(path)

"""The files of a data set: their hashes, and whether they are still as they were written."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path

from envgen_usd.build_manifest import hash_files
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.folder_lock import locked
from envgen_usd.recipe.product_files import ProductCheck, file_fault
from envgen_usd.step_clock import Progress
from envgen_usd.whole_files import write_whole

NAME = "files.json"
"""File of a finished data set or shard with the SHA-256 of each file of its frames."""
_FRAMES = "frames"


def check_frames(folder: Path, progress: Progress = lambda *_: None) -> ProductCheck:
    """Compares each file of the frames of a finished data set or shard with its hash.

    Args:
        folder: Folder of the data set.
        progress: Called with the step's name, the files done and their number.

    Raises:
        EnvgenError: The data set is not finished, or its list of files is damaged.
    """
    written = read_file_list(folder)
    if written is None:
        raise EnvgenError(f"{folder}: holds no finished data set; run envgen-usd dataset")
    faults: dict[str, str] = {}
    for number, (name, value) in enumerate(written.items()):
        progress("files", number, len(written))
        if fault := file_fault(folder / name, value):
            faults[name] = fault
    progress("files", len(written), max(len(written), 1))
    present = {path.relative_to(folder).as_posix() for path in _files(folder)}
    unknown = tuple(sorted(present - written.keys()))
    return ProductCheck(len(written) - len(faults), faults, unknown)


def drop_damaged(
    folder: Path, is_own: Callable[[str], bool]
) -> tuple[Mapping[str, str], tuple[Issue, ...]]:
    """Removes damaged files of the frames of a finished data set, so that they are drawn again.

    Args:
        folder: Folder of the data set.
        is_own: Tells by its path whether a file is one of those to be checked.

    Returns:
        Hashes of the whole files by their path, and an issue for each other file; none of a data
        set that is not finished.

    Raises:
        EnvgenError: A file cannot be removed.
    """
    try:
        written = read_file_list(folder) or {}
    except EnvgenError as error:
        text = str(error).partition(": ")[2]
        return {}, (Issue("dataset.damaged", Severity.WARNING, NAME, text, "list written again"),)
    faults = {
        name: fault
        for name, value in written.items()
        if is_own(name) and (fault := file_fault(folder / name, value))
    }
    for name in faults:
        (folder / name).unlink(missing_ok=True)
    issues = tuple(
        Issue("dataset.damaged", Severity.WARNING, name, f"the file {fault}", "made again")
        for name, fault in faults.items()
    )
    whole = {n: value for n, value in written.items() if is_own(n) and n not in faults}
    return whole, issues


def write_file_list(folder: Path, known: Mapping[str, str]) -> None:
    """Writes the hashes of all files of the frames.

    Args:
        folder: Folder of the data set.
        known: Hashes of files that are known to be whole, by their path.

    Raises:
        EnvgenError: The list cannot be written.
    """
    _write(folder, _hashes(folder, known, lambda _: True))


def write_shard_list(folder: Path, known: Mapping[str, str], is_own: Callable[[str], bool]) -> None:
    """Adds the hashes of the files of a shard to those of other shards in its folder.

    Args:
        folder: Folder of the shard, or of several.
        known: Hashes of files that are known to be whole, by their path.
        is_own: Tells by its path whether a file is of the shard.

    Raises:
        EnvgenError: The list cannot be written.
    """
    hashes = _hashes(folder, known, is_own)
    with locked(folder, wait=True):
        try:
            earlier = read_file_list(folder) or {}
        except EnvgenError:
            earlier = {}
        _write(folder, {**earlier, **hashes})


def _hashes(
    folder: Path, known: Mapping[str, str], is_own: Callable[[str], bool]
) -> Mapping[str, str]:
    paths = {path.relative_to(folder).as_posix(): path for path in _files(folder)}
    own = {name: path for name, path in paths.items() if is_own(name)}
    new = hash_files([path for name, path in own.items() if name not in known], folder)
    return {name: known.get(name) or new[name] for name in own}


def _write(folder: Path, hashes: Mapping[str, str]) -> None:
    write_whole(folder / NAME, json.dumps(dict(sorted(hashes.items())), indent=1) + "\n")


def _files(folder: Path) -> list[Path]:
    return [
        path
        for path in (folder / _FRAMES).rglob("*")
        if path.is_file() and not any(part.startswith(".") for part in path.parts[-2:])
    ]


def read_file_list(folder: Path) -> Mapping[str, str] | None:
    """Hashes of the files of the frames; `None` where no list was written.

    Raises:
        EnvgenError: The list is damaged.
    """
    path = folder / NAME
    if not path.exists():
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return {str(name): str(value) for name, value in content.items()}
    except (OSError, ValueError, AttributeError) as error:
        raise EnvgenError(f"{path}: not a list of files ({error})") from error

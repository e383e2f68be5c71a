"""Paths of files and folders that a user names as input: refused where they are something else."""

from pathlib import Path

from envgen_usd.errors import EnvgenError


def check_input_file(path: Path, remedy: str, option: str = "") -> None:
    """Checks that a path names a regular file.

    Args:
        path: The path.
        remedy: What the user can do, e.g. ``name an OpenStreetMap extract``.
        option: Option that names the path, e.g. ``--osm``; empty for an argument.

    Raises:
        EnvgenError: Nothing is there, or a folder, a device or a pipe.
    """
    if path.is_file():
        return
    what = "is a folder, not a file" if path.is_dir() else "is no regular file"
    raise _fault(path, what if path.exists() else "no such file", remedy, option)


def check_input_folder(path: Path, remedy: str, option: str = "") -> None:
    """Checks that a path names a folder.

    Args:
        path: The path.
        remedy: What the user can do.
        option: Option that names the path; empty for an argument.

    Raises:
        EnvgenError: Nothing is there, or a file.
    """
    if not path.is_dir():
        what = "is a file, not a folder" if path.exists() else "no such folder"
        raise _fault(path, what, remedy, option)


def _fault(path: Path, what: str, remedy: str, option: str) -> EnvgenError:
    return EnvgenError(f"{f'{option} {path}'.lstrip()}: {what}; {remedy}")

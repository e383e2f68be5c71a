"""Paths of files and folders that a user names as input: refused at once where they are neither."""

from pathlib import Path

from envgen_usd.errors import EnvgenError


def check_input_file(path: Path, remedy: str, option: str = "") -> None:
    """Checks that a path names a file; a device or a pipe is one, too.

    Args:
        path: The path.
        remedy: What the user can do, e.g. ``name an OpenStreetMap extract``.
        option: Option that names the path, e.g. ``--osm``; empty for an argument.

    Raises:
        EnvgenError: Nothing is there, or a folder.
    """
    named = f"{option} {path}".lstrip()
    if path.is_dir():
        raise EnvgenError(f"{named}: is a folder, not a file; {remedy}")
    if not path.exists():
        raise EnvgenError(f"{named}: no such file; {remedy}")


def check_input_folder(path: Path, remedy: str, option: str = "") -> None:
    """Checks that a path names a folder.

    Args:
        path: The path.
        remedy: What the user can do.
        option: Option that names the path; empty for an argument.

    Raises:
        EnvgenError: Nothing is there, or a file.
    """
    named = f"{option} {path}".lstrip()
    if path.exists() and not path.is_dir():
        raise EnvgenError(f"{named}: is a file, not a folder; {remedy}")
    if not path.exists():
        raise EnvgenError(f"{named}: no such folder; {remedy}")

"""Files and folders of output: refused before the work where they cannot be written."""

from pathlib import Path

from envgen_usd.errors import EnvgenError
from envgen_usd.output_folder import check_writable


def check_output_file(path: Path, *endings: str) -> None:
    """Checks that a file can be written; leaves none.

    Args:
        path: File to write; its folder need not exist.
        endings: Suffixes that its name may have, in lower case; none for any name.

    Raises:
        EnvgenError: The name has another suffix, is that of a folder, or the folder cannot be
            written.
    """
    if endings and path.suffix.lower() not in endings:
        raise EnvgenError(f"{path}: choose a name that ends in {' or '.join(endings)}")
    if path.is_dir():
        raise EnvgenError(f"{path}: is a folder; choose the name of a file")
    if path.is_file() or not path.exists():  # devices and pipes are written in place
        check_writable(path.parent)


def check_output_folder(folder: Path) -> None:
    """Checks that files can be written into a folder; makes none.

    Raises:
        EnvgenError: It is a file, or cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise EnvgenError(f"{folder}: is a file; choose a folder")
    check_writable(folder)

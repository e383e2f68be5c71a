"""States of files, by which a process knows what it has read already."""

from pathlib import Path

FileState = tuple[int, int] | None
"""Time of the last change in nanoseconds, and size in bytes; `None` without the file."""


def file_state(path: Path) -> FileState:
    """Returns the state of a file; it differs after each change of the file."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size

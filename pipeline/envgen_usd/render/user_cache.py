"""The folder in which results of earlier runs are kept for the user, least recently used go first.

``~/.cache/envgen-usd`` (``$XDG_CACHE_HOME``), or the folder that ``$ENVGEN_USD_CACHE`` names.
"""

import os
import shutil
import time
from contextlib import suppress
from pathlib import Path

from envgen_usd.whole_files import PART_PREFIX

FOLDER = "ENVGEN_USD_CACHE"
"""Environment variable: folder of the cache; empty for no cache."""
_UNFINISHED = 86_400.0
"""Seconds after which an entry that was never finished is removed."""


def cache_folder(kind: str) -> Path | None:
    """Folder of a kind of entries, e.g. ``stages``; `None` if the user has no cache."""
    named = os.environ.get(FOLDER)
    if named is not None:
        return Path(named) / kind if named else None
    with suppress(RuntimeError):  # a user without a home
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        return Path(base) / "envgen-usd" / kind
    return None


def trim(folder: Path, most: float) -> None:
    """Removes the entries that were not used for the longest time, and unfinished old ones.

    Args:
        folder: Folder of a kind; its entries are files or folders of files.
        most: Bytes of all entries that stay.
    """
    now = time.time()
    entries = []
    for entry in folder.iterdir():
        with suppress(OSError):
            age = now - entry.stat().st_mtime
            if entry.name.startswith(PART_PREFIX):
                if age > _UNFINISHED:
                    _remove(entry)
                continue
            files = entry.iterdir() if entry.is_dir() else (entry,)
            entries.append((age, sum(file.stat().st_size for file in files), entry))
    total = 0
    for _, size, entry in sorted(entries):
        total += size
        if total > most:
            _remove(entry)


def _remove(entry: Path) -> None:
    if entry.is_dir():
        shutil.rmtree(entry, ignore_errors=True)
    with suppress(OSError):
        entry.unlink(missing_ok=True)

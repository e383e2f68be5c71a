"""The manifest of a build: inputs, versions, and the content hash and time of each product."""

import hashlib
import json
import os
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from envgen_usd.errors import EnvgenError

NAME = "manifest.json"


@dataclass(frozen=True)
class Manifest:
    """What a build was made from, and what it made.

    Attributes:
        inputs: Name to value: road, its hash, country, area, seed, ...
        versions: Package to version.
        products: Path relative to the folder, to its SHA-256.
        keys: Name of a chunk, to the hash of everything that it was made from.
        seconds: Step to wall time.
    """

    inputs: Mapping[str, Any]
    versions: Mapping[str, str]
    products: Mapping[str, str]
    keys: Mapping[str, str]
    seconds: Mapping[str, float]


def hash_bytes(*parts: bytes | str) -> str:
    """SHA-256 over parts, each with its length so that joints matter."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    return digest.hexdigest()


def hash_files(paths: Iterable[Path], root: Path) -> dict[str, str]:
    """SHA-256 of each file by its path relative to a root, sorted."""
    return {
        path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(paths)
    }


def hash_folder(folder: Path, *patterns: str) -> str:
    """SHA-256 over the names and contents of the files below a folder that match a pattern."""
    found = {path for pattern in patterns for path in folder.rglob(pattern) if path.is_file()}
    return hash_bytes(json.dumps(hash_files(found, folder)))


def write_text(path: Path, text: str) -> None:
    """Writes a file at once: readers see the old content or the new, never a part."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def write_manifest(manifest: Manifest, folder: Path) -> Path:
    """Writes `manifest.json` into a folder."""
    path = folder / NAME
    write_text(path, json.dumps(vars(manifest), indent=1, default=dict) + "\n")
    return path


def read_manifest(folder: Path) -> Manifest | None:
    """Reads the manifest of a folder; none if the folder has none.

    Raises:
        EnvgenError: The file is there but is no manifest.
    """
    path = folder / NAME
    if not path.exists():
        return None
    try:
        return Manifest(**json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise EnvgenError(f"{path}: is no manifest ({error}); choose another --out") from error

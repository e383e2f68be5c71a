"""The manifest of a build: inputs, versions, and the content hash and time of each product."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.whole_files import write_whole

NAME = "manifest.json"


@dataclass(frozen=True)
class Manifest:
    """Inputs and products of a build.

    Attributes:
        inputs: Option name to value.
        hashes: Role of an input to the SHA-256 of each of its files, by name.
        versions: Package name to version.
        products: Path relative to the folder to SHA-256.
        keys: Chunk name to the hash of all its inputs.
        seconds: Step name to wall time, seconds.
    """

    inputs: Mapping[str, Any]
    hashes: Mapping[str, Mapping[str, str]]
    versions: Mapping[str, str]
    products: Mapping[str, str]
    keys: Mapping[str, str]
    seconds: Mapping[str, float]


def hash_bytes(*parts: bytes | str) -> str:
    """SHA-256 over parts; each part's length is hashed too, so that boundaries count."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    return digest.hexdigest()


def hash_file(path: Path) -> str:
    """SHA-256 of a file, read block by block."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def hash_files(paths: Iterable[Path], root: Path) -> dict[str, str]:
    """SHA-256 of each file by its path relative to a root, sorted."""
    return {path.relative_to(root).as_posix(): hash_file(path) for path in sorted(paths)}


def hash_folder(folder: Path, *patterns: str) -> str:
    """SHA-256 over the names and contents of the files below a folder that match a pattern."""
    files = {path for pattern in patterns for path in folder.rglob(pattern) if path.is_file()}
    return hash_bytes(json.dumps(hash_files(files, folder)))


def write_manifest(manifest: Manifest, folder: Path) -> Path:
    """Writes `manifest.json` into a folder."""
    path = folder / NAME
    write_whole(path, json.dumps(vars(manifest), indent=1, default=dict) + "\n")
    return path


def read_manifest(folder: Path) -> Manifest | None:
    """Reads the manifest of a folder; `None` where the folder has no manifest.

    Raises:
        EnvgenError: The file exists but is not a manifest.
    """
    path = folder / NAME
    if not path.exists():
        return None
    try:
        return Manifest(**json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise EnvgenError(f"{path}: not a manifest ({error}); build again") from error


def finished_manifest(folder: Path) -> Manifest:
    """Reads the manifest of a finished build.

    Raises:
        EnvgenError: The folder holds no finished build, or a file is named in its place.
    """
    if folder.is_file():
        raise EnvgenError(f"{folder}: is a file; name the folder of the build, {folder.parent}")
    manifest = read_manifest(folder)
    if manifest is None:
        raise EnvgenError(f"{folder}: holds no finished build; run envgen-usd build")
    return manifest


def manifest_issues(folder: Path) -> tuple[Issue, ...]:
    """A warning for a damaged manifest, which a build rewrites."""
    try:
        read_manifest(folder)
    except EnvgenError as error:
        text = str(error).partition(": ")[2]
        return (Issue("build.damaged", Severity.WARNING, NAME, text, "manifest rewritten"),)
    return ()

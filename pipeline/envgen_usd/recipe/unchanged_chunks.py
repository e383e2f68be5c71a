"""Detects unchanged chunks by the key of all their inputs."""

import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from importlib import metadata, resources
from pathlib import Path

import pyproj
import shapely

from envgen_usd.build_manifest import hash_bytes, hash_file, hash_folder
from envgen_usd.chunks import Chunk
from envgen_usd.environment_files import profile_path
from envgen_usd.errors import Issue, Severity
from envgen_usd.executors.executor import code_hash
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.whole_files import write_whole

RECORD = "made.json"
"""File of a chunk with its key and its `ChunkRecord`; it is written last."""
PACKAGES = (
    "lxml",
    "manifold3d",
    "numpy",
    "pillow",
    "pyproj",
    "rasterio",
    "safetensors",
    "scipy",
    "shapely",
    "trimesh",
    "usd-core",
)
"""Libraries whose versions affect the products."""
LEARNED = ("torch",)
"""Libraries that affect the products of a network."""


def content_hashes(
    options: BuildOptions, files: Mapping[str, tuple[Path, ...]]
) -> Mapping[str, Mapping[str, str]]:
    """SHA-256 of all input files of a build.

    Args:
        options: Options of the build.
        files: Role to the user's files, as `Land.files`.

    Returns:
        Role to the hash of each file or folder by name. Paths are relative to the given path, so
        that moved inputs keep their hashes.
    """
    library = options.library or Path(str(resources.files("envgen_usd.asset_library")))
    environment = profile_path(options.country, options.area, options.environments_folder())
    shipped = {"usda": "*.usda", "usdc": "*.usdc", "toml": "*.toml"}
    return {
        **{
            role: {_name(path, paths[0]): hash_file(path) for path in paths}
            for role, paths in files.items()
        },
        "environment": {f"{environment.parent.name}/{environment.name}": hash_file(environment)},
        "library": {library.name: hash_folder(library, *shipped.values())},
    }


def _name(path: Path, first: Path) -> str:
    """Path of a file relative to the first file of its role; the bare name outside that folder."""
    folder, path = first.resolve().parent, path.resolve()
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.name


def library_versions(options: BuildOptions) -> Mapping[str, str]:
    """Versions of Python, the packages, and their native libraries."""
    learned = options.landuse == "network" or options.terrain_network is not None
    packages = (*PACKAGES, *(LEARNED if learned else ()))
    return {
        "envgen-usd": metadata.version("envgen-usd"),
        "python": platform.python_version(),
        "geos": shapely.geos_version_string,
        "proj": pyproj.proj_version_str,
        **{name: metadata.version(name) for name in packages},
    }


def input_key(
    options: BuildOptions,
    hashes: Mapping[str, Mapping[str, str]],
    versions: Mapping[str, str],
) -> str:
    """Hash of all inputs that affect a chunk.

    Args:
        options: Options of the build.
        hashes: As `content_hashes` returns them.
        versions: As `library_versions` returns them.
    """
    choices = {
        field.name: getattr(options, field.name)
        for field in fields(options)
        if field.type in (int, float, bool, tuple[float, ...]) and field.name != "workers"
    }
    landuse = options.landuse if "landuse" not in hashes or options.landuse == "network" else ""
    fill = options.fill if options.osm else ""
    # Assets that are not copied are referenced by their path.
    place = "" if options.embed_assets else str(options.library and options.library.absolute())
    labels = Path(str(resources.files("envgen_usd.schemas")))
    return hash_bytes(
        json.dumps([hashes, versions, choices, landuse, fill, place], sort_keys=True),
        code_hash(),
        hash_folder(labels, "*.toml"),
    )


@dataclass(frozen=True)
class ChunkRecord:
    """Content of a chunk, for the report.

    Attributes:
        counts: Kind of feature to number of features.
        issues: Parts of its buildings without room.
    """

    counts: Mapping[str, int]
    issues: tuple[Issue, ...] = ()


def write_record(folder: Path, key: str, record: ChunkRecord) -> None:
    """Writes the record of a chunk, with its key, and size and hash of each of its files.

    Args:
        folder: Folder of the chunk with all its products.
        key: As `input_key` returns it.
        record: Content of the chunk.
    """
    files = {path.name: _state(path) for path in sorted(folder.iterdir()) if path.is_file()}
    entries = {"key": key, **asdict(record), "files": files}
    write_whole(folder / RECORD, json.dumps(entries, indent=1) + "\n")


def kept_record(
    folder: Path, chunk: Chunk, key: str
) -> tuple[ChunkRecord | None, tuple[Issue, ...]]:
    """Record of a chunk from an earlier build, and damage to its files since.

    Args:
        folder: Parent folder of the chunk folders.
        chunk: Tile.
        key: As `input_key` returns it.

    Returns:
        The record, without issues; or `None` if the chunk has to be built. Each file that changed
        after a build of these inputs gives an issue.
    """
    place = folder / chunk.name
    try:
        entries = json.loads((place / RECORD).read_text(encoding="utf-8"))
        counts = {str(kind): int(number) for kind, number in entries["counts"].items()}
        issues = (
            Issue(**{**issue, "severity": Severity(issue["severity"])})
            for issue in entries["issues"]
        )
        record = ChunkRecord(counts, tuple(issues))
        files = {str(name): tuple(state) for name, state in entries["files"].items()}
        same_inputs = entries["key"] == key
    except FileNotFoundError:
        return None, ()
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None, (_damage(chunk, RECORD, "cannot be read"),)
    if not same_inputs:
        return None, ()
    damaged = tuple(
        _damage(chunk, name, "differs from the written file" if path.exists() else "is missing")
        for name, state in files.items()
        if not _is_whole(path := place / name, state)
    )
    return (None if damaged else record), damaged


def file_hashes(folder: Path, chunk: Chunk) -> Mapping[str, str]:
    """SHA-256 of the files of a finished chunk, by their paths relative to the output folder.

    They are those of the chunk's record, so that no process reads the files of all chunks once
    more; `verify` then notices what changed since a chunk was written.

    Args:
        folder: Parent folder of the chunk folders.
        chunk: Tile.
    """
    entries = json.loads((folder / chunk.name / RECORD).read_text(encoding="utf-8"))
    place = f"{folder.name}/{chunk.name}"
    return {f"{place}/{name}": state[1] for name, state in entries["files"].items()}


def _state(path: Path) -> tuple[int, str]:
    """Size in bytes, and SHA-256."""
    return path.stat().st_size, hash_file(path)


def _is_whole(path: Path, state: tuple[int, str]) -> bool:
    try:
        return path.stat().st_size == state[0] and hash_file(path) == state[1]
    except OSError:
        return False


def _damage(chunk: Chunk, name: str, what: str) -> Issue:
    where = f"chunks/{chunk.name}/{name}"
    return Issue("build.damaged", Severity.WARNING, where, f"the file {what}", "chunk rebuilt")

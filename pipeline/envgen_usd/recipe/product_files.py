"""The files of a build: their hashes for the manifest, and whether they are still as written."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from envgen_usd.build_manifest import NAME, hash_file, read_manifest
from envgen_usd.chunks import CITY_FILE, Chunk
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.output_folder import STAGE_FILE
from envgen_usd.recipe.build_options import ROAD_FILE
from envgen_usd.recipe.unchanged_chunks import file_hashes
from envgen_usd.step_clock import Progress

MOST_FILES = 20
"""Damaged files that a build names; the others are counted."""
_TOP = frozenset({STAGE_FILE, CITY_FILE, ROAD_FILE})
"""Files that a build writes beside its folders; others, e.g. an artist's layer, are not its."""
_PARTS = ("assets", "chunks", "layers", "materials", "skies", "textures")
"""Folders whose files a build writes; what lies in others, e.g. rendered images, is not its."""
_SUFFIXES = frozenset(
    {".exr", ".geojson", ".gml", ".jpg", ".mtlx", ".png", ".tif", ".usda", ".usdc", ".xodr"}
)
"""Suffixes of products; a report and a chunk's own record are none."""


@dataclass(frozen=True)
class ProductCheck:
    """What a check of a build's files found; paths are relative to its folder.

    Attributes:
        whole: Number of files that are as they were written.
        faults: Path of each other file of the manifest, and what is wrong with it.
        unknown: Files beside and among the products that the manifest does not list.
    """

    whole: int
    faults: Mapping[str, str]
    unknown: tuple[str, ...]


def product_hashes(folder: Path, chunks: Sequence[Chunk]) -> Mapping[str, str]:
    """SHA-256 of each product of an environment by its path in the folder.

    Args:
        folder: Folder of an environment.
        chunks: Its chunks; the hashes of their files are those of their records.
    """
    known = dict(chain(*(file_hashes(folder / "chunks", chunk).items() for chunk in chunks)))
    names = {path.relative_to(folder).as_posix(): path for path in sorted(_like_products(folder))}
    names = {name: path for name, path in names.items() if "/" in name or name in _TOP}
    return {name: known.get(name) or hash_file(path) for name, path in names.items()}


def check_products(folder: Path, progress: Progress = lambda *_: None) -> ProductCheck:
    """Compares each file of a build with its hash in the manifest.

    Args:
        folder: Folder of a build.
        progress: Called with the step's name, the files done and their number.

    Raises:
        EnvgenError: The folder has no manifest, or the manifest is damaged.
    """
    manifest = read_manifest(folder)
    if manifest is None:
        raise EnvgenError(f"{folder}: has no {NAME}; give the folder of a finished build")
    faults: dict[str, str] = {}
    for number, (name, written) in enumerate(manifest.products.items()):
        progress("files", number, len(manifest.products))
        fault = file_fault(folder / name, written)
        if fault:
            faults[name] = fault
    progress("files", len(manifest.products), len(manifest.products))
    present = {path.relative_to(folder).as_posix() for path in _like_products(folder)}
    unknown = tuple(sorted(present - manifest.products.keys()))
    return ProductCheck(len(manifest.products) - len(faults), faults, unknown)


def damage_issues(folder: Path) -> tuple[Issue, ...]:
    """Warnings for files outside of the chunks that are not as the last run wrote them.

    A build writes them again, so it tells what it replaces: damage, or what somebody changed. Of
    many files `MOST_FILES` are named.
    """
    try:
        manifest = read_manifest(folder)
    except EnvgenError:
        return ()  # `manifest_issues` tells
    names = manifest.products if manifest else {}
    faults = {
        name: fault
        for name, written in names.items()
        if not name.startswith("chunks/") and (fault := file_fault(folder / name, written))
    }
    issues = [
        Issue("build.damaged", Severity.WARNING, name, f"the file {fault}", "file written again")
        for name, fault in sorted(faults.items())[:MOST_FILES]
    ]
    if len(faults) > MOST_FILES:
        text = f"{len(faults) - MOST_FILES} more files differ or are missing"
        issues.append(Issue("build.damaged", Severity.WARNING, NAME, text, "files written again"))
    return tuple(issues)


def _like_products(folder: Path) -> list[Path]:
    """Files where products lie, with the suffix of one."""
    places = [folder.glob("*"), *((folder / part).rglob("*") for part in _PARTS)]
    return [path for path in chain(*places) if path.is_file() and path.suffix in _SUFFIXES]


def file_fault(path: Path, written: str) -> str:
    """What is wrong with a file of this SHA-256; empty for a whole one."""
    try:
        return "" if hash_file(path) == written else "differs from the written file"
    except FileNotFoundError:
        return "is missing"
    except OSError as error:
        return f"cannot be read ({error.strerror})"

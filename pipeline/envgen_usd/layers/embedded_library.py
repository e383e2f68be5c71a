"""Copies the used part of the asset library beside a stage."""

import filecmp
import os
import shutil
from collections.abc import Iterable
from pathlib import Path

from pxr import Sdf, UsdUtils

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.errors import EnvgenError
from envgen_usd.file_states import FileState, file_state
from envgen_usd.layers.payload_roots import PayloadFile
from envgen_usd.whole_files import make_folder, shared_part_folder, whole_file

_DEPENDENCIES: dict[Path, dict[str, FileState]] = {}
"""States of the files that a file of a library needs, by the path of that file."""


def library_files(catalogue: Catalogue, payloads: Iterable[PayloadFile]) -> frozenset[str]:
    """Returns the files of the library that a stage uses, relative to the library's folder.

    Args:
        catalogue: Library that the chunks' files reference.
        payloads: Files of the chunks.

    Raises:
        EnvgenError: The library lacks a material, or a file refers to a missing file.
    """
    prefix = f"{catalogue.prefix}/"
    used: set[str] = set()
    for payload in payloads:
        inside = (path for path in payload.references if path.startswith(prefix))
        used.update(path.removeprefix(prefix) for path in inside)
        used.update(catalogue.material(name, "stage").path for name in payload.materials)
    return frozenset(_with_dependencies(catalogue.folder, used))


def asset_files(catalogue: Catalogue, paths: Iterable[str]) -> frozenset[str]:
    """Returns files of assets and of all that they refer to, relative to the library's folder.

    Args:
        catalogue: Library.
        paths: Interfaces of the assets, relative to the library's folder.

    Raises:
        EnvgenError: A file refers to a missing file.
    """
    return frozenset(_with_dependencies(catalogue.folder, set(paths)))


def embed_library(catalogue: Catalogue, folder: Path, files: Iterable[str]) -> None:
    """Copies assets, materials and textures into the folder layout of the library.

    Args:
        catalogue: Library that the files reference.
        folder: Output folder; gets ``assets``, ``materials`` and ``textures``.
        files: Files of the library, relative to its folder.

    Raises:
        EnvgenError: A file cannot be copied.
    """
    with shared_part_folder(folder) as parts:
        for path in sorted(files):
            _copy(catalogue.folder / path, folder / path, parts)


def _with_dependencies(library: Path, used: set[str]) -> set[str]:
    """Paths relative to the library of the used files and of all their dependencies."""
    root = library.resolve()
    needed = {path for name in sorted(used) for path in _dependencies(library / name)}
    return {os.path.relpath(path, root) for path in needed}


def _dependencies(path: Path) -> Iterable[str]:
    """Paths of a file and of all files that it refers to; an unchanged one is read once."""
    known = _DEPENDENCIES.get(path)
    if known is None or any(file_state(Path(name)) != state for name, state in known.items()):
        layers, assets, missing = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(path)))
        if missing:
            raise EnvgenError(f"{path}: refers to missing files: {', '.join(missing)}")
        names = (*(layer.realPath for layer in layers), *assets)
        known = _DEPENDENCIES[path] = {name: file_state(Path(name)) for name in names}
    return known


def _copy(source: Path, target: Path, parts: Path) -> None:
    """Copies a file unless the same file exists; parts of it lie in a folder meanwhile."""
    if target.exists() and filecmp.cmp(source, target, shallow=False):
        return
    make_folder(target.parent)
    with whole_file(target, within=parts) as part:
        shutil.copyfile(source, part)

"""Copies the used part of the asset library beside a stage."""

import filecmp
import os
import shutil
from collections.abc import Sequence
from pathlib import Path

from pxr import Sdf, UsdUtils

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.usd_files import read_layer
from envgen_usd.errors import EnvgenError
from envgen_usd.whole_files import make_folder, whole_file


def embed_library(catalogue: Catalogue, folder: Path, files: Sequence[Path]) -> None:
    """Copies assets, materials and textures into the folder layout of the library.

    Args:
        catalogue: Library that the files reference.
        folder: Output folder; gets ``assets``, ``materials`` and ``textures``.
        files: Files of the chunks that reference the library.

    Raises:
        EnvgenError: A file cannot be copied.
    """
    prefix = f"{catalogue.prefix}/"
    used = {
        reference.removeprefix(prefix)
        for file in files
        for reference in read_layer(file).GetCompositionAssetDependencies()
        if reference.startswith(prefix)
    }
    for path in sorted(_with_dependencies(catalogue.folder, used)):
        _copy(catalogue.folder / path, folder / path)


def _with_dependencies(library: Path, used: set[str]) -> set[str]:
    """Paths relative to the library of the used files and of all their dependencies."""
    files: set[str] = set()
    for name in sorted(used):
        layers, assets, missing = UsdUtils.ComputeAllDependencies(
            Sdf.AssetPath(str(library / name))
        )
        if missing:
            raise EnvgenError(f"{library / name}: refers to missing files: {', '.join(missing)}")
        paths = [layer.realPath for layer in layers] + list(assets)
        files.update(os.path.relpath(path, library.resolve()) for path in paths)
    return files


def _copy(source: Path, target: Path) -> None:
    """Copies a file unless the same file exists; never leaves a partial file."""
    if target.exists() and filecmp.cmp(source, target, shallow=False):
        return
    make_folder(target.parent)
    with whole_file(target) as part:
        shutil.copyfile(source, part)

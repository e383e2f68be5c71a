"""Copies what a stage uses of the asset library beside it."""

import filecmp
import os
import shutil
from collections.abc import Sequence
from pathlib import Path

from pxr import Sdf, UsdUtils

from envgen_usd.assets.catalogue import Catalogue
from envgen_usd.assets.files import read_layer
from envgen_usd.errors import EnvgenError


def embed_library(catalogue: Catalogue, folder: Path, files: Sequence[Path]) -> None:
    """Copies assets, materials and textures into folders of the library's own layout.

    Args:
        catalogue: The library that the files were written with.
        folder: Output folder; gets ``assets``, ``materials`` and ``textures``.
        files: The chunks' files that refer to the library.

    Raises:
        EnvgenError: Something cannot be copied.
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
    """Paths relative to the library of all files that these need, themselves included."""
    found: set[str] = set()
    for name in sorted(used):
        layers, assets, missing = UsdUtils.ComputeAllDependencies(
            Sdf.AssetPath(str(library / name))
        )
        if missing:
            raise EnvgenError(f"{library / name}: refers to missing files: {', '.join(missing)}")
        paths = [layer.realPath for layer in layers] + list(assets)
        found.update(os.path.relpath(path, library.resolve()) for path in paths)
    return found


def _copy(source: Path, target: Path) -> None:
    """Copies a file unless the same one is there; never leaves half a file."""
    if target.exists() and filecmp.cmp(source, target, shallow=False):
        return
    temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, temporary)
        temporary.replace(target)
    except OSError as error:
        raise EnvgenError(f"{target}: cannot be written: {error.strerror}") from error

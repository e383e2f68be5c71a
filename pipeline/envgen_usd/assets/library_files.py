"""Checks the files of an asset library: their units, their up axis, and what they refer to."""

import os
from collections.abc import Iterator
from pathlib import Path

from pxr import Sdf, UsdUtils

from envgen_usd.assets.usd_files import read_layer
from envgen_usd.errors import EnvgenError, Issue, Severity

UNREADABLE = "library.unreadable"
"""Kind of the issues about files without which an asset cannot be composed."""
_STAGE_METADATA = {"metersPerUnit": 1.0, "upAxis": "Z"}
_LAYERS = {".usd", ".usda", ".usdc"}


def check_files(library: Path, name: str) -> Iterator[Issue]:
    """Checks a layer, and all layers of the library that it refers to.

    1. Layers exist and can be read.
    2. Layers are in metres with z up, as references convert neither.
    3. No path leaves the library: a build copies what it uses, and a moved library breaks.

    Args:
        library: Folder of the library.
        name: Path of the layer, relative to the library.
    """
    waiting, seen = [name], {name}
    while waiting:
        name = waiting.pop(0)
        layer = read_layer(library / name)
        yield from _check_metadata(layer, name)
        for path in asset_paths(layer):
            target = _inside(library, name, path)
            if target is None:
                text = f"path {path} leaves the library; copy the file into it"
                yield Issue("library.outside", Severity.ERROR, name, text)
            elif target.suffix in _LAYERS and target.as_posix() not in seen:
                seen.add(target.as_posix())
                if fault := _unreadable(library / target):
                    yield Issue(UNREADABLE, Severity.ERROR, name, f"{path} {fault}")
                else:
                    waiting.append(target.as_posix())


def _unreadable(path: Path) -> str:
    """Says why a layer cannot be read; empty for a readable layer."""
    if not path.is_file():
        return "does not exist"
    try:
        read_layer(path)
    except EnvgenError:
        return "cannot be read as a USD layer"
    return ""


def _check_metadata(layer: Sdf.Layer, name: str) -> Iterator[Issue]:
    for key, needed in _STAGE_METADATA.items():
        stated = layer.pseudoRoot.HasInfo(key)
        value = layer.pseudoRoot.GetInfo(key)
        if not stated or value != needed:
            text = f"{key} must be {needed}, but is {value if stated else 'missing'}"
            yield Issue("library.units", Severity.ERROR, name, text)


def asset_paths(layer: Sdf.Layer) -> tuple[str, ...]:
    """All paths of files in a layer: sublayers, references, payloads, textures; sorted."""
    paths: set[str] = set()

    def note(path: str) -> str:
        paths.add(path)
        return path

    UsdUtils.ModifyAssetPaths(layer, note)
    return tuple(sorted(paths - {""}))


def _inside(library: Path, name: str, path: str) -> Path | None:
    """A path of a layer relative to the library; `None` if it leaves the library.

    A link to a file elsewhere leaves the library too.
    """
    if Path(path).is_absolute() or ":" in path:
        return None
    root = library.resolve()
    lexical = Path(os.path.normpath(root / Path(name).parent / path))
    try:
        target = lexical.resolve()
    except (RuntimeError, OSError, ValueError):  # links in a circle, or no name of a file
        return None
    if not (lexical.is_relative_to(root) and target.is_relative_to(root)):
        return None
    return lexical.relative_to(root)

"""Refuses a stage with a damaged binary layer, before OpenUSD reads it and ends the process."""

import os
from collections.abc import Iterator
from pathlib import Path

from pxr import Tf, UsdUtils

from envgen_usd.assets.crate_guard import deadly_layers
from envgen_usd.build_manifest import hash_file, read_manifest
from envgen_usd.errors import EnvgenError

_BINARY = (b"PXR-USDC", b"PK\x03\x04")
"""Begins of crate files and of packages (.usdz)."""
_SUFFIXES = {".usd", ".usda", ".usdc", ".usdz"}


def refuse_deadly_layers(stage: Path, *, payloads: bool = True) -> None:
    """Lets another process read the binary layers of a stage that no manifest vouches for.

    A layer of an environment has the hash that its manifest gives, and is not read twice. Layers
    that lie in packages or are found by a search path are not looked at.

    Args:
        stage: The file of the stage.
        payloads: False leaves out the layers of payloads.

    Raises:
        EnvgenError: A layer ends the process that reads it, or takes too long or too much memory.
    """
    guard = _Guard(payloads=payloads)
    known: set[Path] = set()
    waiting = [stage.absolute()] if stage.is_file() else []
    while waiting:
        deadly = sorted(deadly_layers([each for each in waiting if guard.suspects(each)]))
        if deadly:
            raise EnvgenError(
                f"{deadly[0]}: a damaged layer, at which OpenUSD ends the process. Write it anew; "
                "for an environment, run its build again"
            )
        known.update(waiting)
        used = {path for each in waiting for path in guard.used_by(each)}
        waiting = sorted(path for path in used - known if path.is_file())


class _Guard:
    """Which layers to look at, and what the manifests say of them."""

    def __init__(self, *, payloads: bool) -> None:
        self._payloads = payloads
        self._listed: dict[Path, dict[str, str]] = {}
        self._whole: set[Path] = set()
        self._folders: dict[Path, Path | None] = {}

    def suspects(self, layer: Path) -> bool:
        """True for a binary layer that is not as its manifest says."""
        return _is_binary(layer) and self._folder_of(layer) is None

    def used_by(self, layer: Path) -> Iterator[Path]:
        """Layers that a layer names; once for an environment, all of its layers."""
        folder = self._folder_of(layer)
        if folder is None or not self._payloads:
            yield from _named_in(layer, payloads=self._payloads)
        elif folder not in self._whole:
            self._whole.add(folder)
            for name in self._listed[folder]:
                if Path(name).suffix in _SUFFIXES:
                    yield folder / name

    def _folder_of(self, layer: Path) -> Path | None:
        """The folder whose manifest gives the hash of a layer, or `None`."""
        if layer not in self._folders:
            self._folders[layer] = self._found_folder(layer)
        return self._folders[layer]

    def _found_folder(self, layer: Path) -> Path | None:
        for folder in layer.parents:
            name = layer.relative_to(folder).as_posix()
            expected = self._products(folder).get(name)
            if expected is not None:
                return folder if hash_file(layer) == expected else None
        return None

    def _products(self, folder: Path) -> dict[str, str]:
        """Products of an environment; none without a manifest, or with a damaged one."""
        if folder not in self._listed:
            try:
                manifest = read_manifest(folder)
            except EnvgenError:
                manifest = None
            self._listed[folder] = dict(manifest.products) if manifest else {}
        return self._listed[folder]


def _is_binary(layer: Path) -> bool:
    with layer.open("rb") as file:
        return file.read(8).startswith(_BINARY)


def _named_in(layer: Path, *, payloads: bool) -> Iterator[Path]:
    """Layers that a layer names by paths relative to it; it names textures, too."""
    try:
        sublayers, references, lazy = UsdUtils.ExtractExternalReferences(str(layer))
    except Tf.ErrorException:  # is told where the stage is opened
        return
    for name in (*sublayers, *references, *(lazy if payloads else ())):
        if Path(name).suffix in _SUFFIXES:
            yield Path(os.path.normpath(layer.parent / name))

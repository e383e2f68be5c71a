"""The images that an exported file shows: their sources, and the copies beside it."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from envgen_usd.build_manifest import hash_bytes
from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.gltf.gltf_materials import texture_digest
from envgen_usd.render.stage.resolved_files import read_resolved


class SourceImages:
    """What is known of images; each is read once, since most files show the same."""

    def __init__(self, folder: Path) -> None:
        """Starts empty.

        Args:
            folder: Folder of the stage; paths are noted relative to it, so that both can be moved.
        """
        self._folder = folder.absolute()
        self._known: dict[str, str] = {}
        self._whole: dict[Path, bool] = {}

    def facts(self, paths: Iterable[str]) -> dict[str, str]:
        """Hash of each image, by its path relative to the folder."""
        return {os.path.relpath(path, self._folder): self._hash(path) for path in sorted(paths)}

    def are_unchanged(self, facts: Any) -> bool:  # noqa: ANN401 - from a file
        """True if the images of a file are what they were."""
        if not isinstance(facts, dict):
            return False
        known = {os.path.normpath(self._folder / name): value for name, value in facts.items()}
        return all(self._hash(path) == value for path, value in known.items())

    def is_whole(self, texture: Path) -> bool:
        """True for a texture file of an export that has the content which its name says."""
        if not self._whole.get(texture):
            digest = texture.stem.rpartition("_")[2]
            self._whole[texture] = (
                texture.is_file() and texture_digest(texture.read_bytes()) == digest
            )
        return self._whole[texture]

    def _hash(self, path: str) -> str:
        """Hash of an image; empty for one that is gone."""
        if path not in self._known:
            try:
                self._known[path] = hash_bytes(read_resolved(path))
            except EnvgenError:
                self._known[path] = ""
        return self._known[path]

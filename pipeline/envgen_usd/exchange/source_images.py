"""The images that an exported file shows: which they were, and whether they still are."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from envgen_usd.build_manifest import hash_bytes
from envgen_usd.errors import EnvgenError
from envgen_usd.render.stage.resolved_files import read_resolved


class SourceImages:
    """Hashes of images, each read once."""

    def __init__(self, folder: Path) -> None:
        """Starts empty.

        Args:
            folder: Folder of the stage; paths are noted relative to it, so that both can be moved.
        """
        self._folder = folder.absolute()
        self._known: dict[str, str] = {}

    def facts(self, paths: Iterable[str]) -> dict[str, str]:
        """Hash of each image, by its path relative to the folder."""
        return {os.path.relpath(path, self._folder): self._hash(path) for path in sorted(paths)}

    def are_unchanged(self, facts: Any) -> bool:  # noqa: ANN401 - from a file
        """True if the images of a file are what they were."""
        if not isinstance(facts, dict):
            return False
        known = {os.path.normpath(self._folder / name): value for name, value in facts.items()}
        return all(self._hash(path) == value for path, value in known.items())

    def _hash(self, path: str) -> str:
        """Hash of an image; empty for one that is gone."""
        if path not in self._known:
            try:
                self._known[path] = hash_bytes(read_resolved(path))
            except EnvgenError:
                self._known[path] = ""
        return self._known[path]

"""Scenes of stages that were read before, kept in a folder of the user.

A scene is found again if all layers that it was composed of have the same content at the same
paths, and if code and libraries are the same. Every layer is hashed each time.
"""

import os
import platform
import shutil
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib import metadata, resources
from pathlib import Path

import msgspec
from pxr import Sdf, Usd

from envgen_usd.build_manifest import hash_bytes
from envgen_usd.errors import EnvgenError
from envgen_usd.render.stage.resolved_files import read_resolved
from envgen_usd.render.stage.scene_file import LayerMark, SceneSummary, SceneWriter, StoredScene
from envgen_usd.render.stage.stage_regions import Content, Region
from envgen_usd.render.user_cache import cache_folder, trim
from envgen_usd.whole_files import PART_PREFIX

_MOST = 4e9
"""Bytes of all scenes in the cache; a larger value keeps more stages."""
_LIBRARIES = ("manifold3d", "numpy", "scipy", "trimesh", "usd-core")
_SEARCH_PATH, _PLUGINS = "PXR_AR_DEFAULT_SEARCH_PATH", "PXR_PLUGINPATH_NAME"
_UNSTABLE = ("stage.composition", "material.texture")
"""Issues that may vanish although no layer changes: a file that was missing appears."""


class SceneCache:
    """The scene of a stage in the cache, to find or to store.

    A scene is stored if it follows from the content of files alone. It is not stored if a file was
    missing, if it was written while it was read, or if this process had opened it before.
    """

    def __init__(
        self,
        loaded: frozenset[str],
        layers: Mapping[str, tuple[str, bytes]],
        kind: str = "stages",
        basis: bytes = b"",
    ) -> None:
        """Starts with the stage as it is without payloads.

        Args:
            loaded: Identifiers of the layers that the process had opened before the stage.
            layers: Layers of the stage: resolved path and SHA-256 by identifier.
            kind: Folder of the cache.
            basis: What else the scene follows from.
        """
        self._loaded, self._own, self._basis = loaded, layers, basis
        self._start = time.time()
        self._folder = cache_folder(kind)
        self._writer: SceneWriter | None = None
        self._part = Path()
        self._usable = self._folder is not None and not os.environ.get(_SEARCH_PATH)
        self._usable &= all(self._is_plain(name) for name, (path, _) in layers.items() if path)

    def find(self) -> StoredScene | None:
        """The scene, if it is there."""
        if not self._usable or self._folder is None:
            return None
        for folder in sorted(self._folder.glob(f"{self._key()}-*")):
            scene = _opened(folder)
            if scene is not None and self._is_current(scene):
                return scene
        return None

    def add(self, region: Region, content: Content) -> None:
        """Writes a region of a scene that is being read."""
        if not self._usable or self._folder is None:
            return
        try:
            if self._writer is None:
                self._folder.mkdir(parents=True, exist_ok=True)
                self._part = Path(tempfile.mkdtemp(dir=self._folder, prefix=PART_PREFIX))
                self._writer = SceneWriter(self._part)
            self._writer.add(region, content)
        except OSError:
            self.drop()

    def finish(
        self, summary: SceneSummary, layers: Mapping[str, tuple[str, bytes]], note: bytes = b""
    ) -> StoredScene | None:
        """Stores the scene, if it follows from the content of its layers alone.

        Args:
            summary: All but geometry and light.
            layers: All layers of the stage; without any, nothing is stored.
            note: What the file of a scene has no place for.

        Returns:
            The stored scene, or `None`.
        """
        marks = [LayerMark(name, path, digest) for name, (path, digest) in layers.items()]
        below = [mark for mark in marks if mark.identifier not in self._own]
        stable = layers and not any(issue.kind in _UNSTABLE for issue in summary.issues)
        if not stable or not all(map(self._is_settled, (mark for mark in marks if mark.path))):
            self.drop()
        if self._writer is None or self._folder is None:
            return None
        digest = hash_bytes(*(mark.digest for mark in below))
        target = self._folder / f"{self._key()}-{digest[:16]}"
        with suppress(OSError):
            self._writer.finish(summary, below, note)
            with suppress(OSError):  # another process was faster
                self._part.rename(target)
            trim(self._folder, _MOST)
        self.drop()
        return _opened(target)

    def drop(self) -> None:
        """Removes what was written of a scene; nothing more is stored."""
        if self._writer is not None:
            self._writer.close()
            shutil.rmtree(self._part, ignore_errors=True)
        self._writer, self._usable = None, False

    def _key(self) -> str:
        own = sorted((path and name, digest) for name, (path, digest) in self._own.items())
        plugins = os.environ.get(_PLUGINS, "")
        parts = (part for pair in own for part in pair)
        return hash_bytes(_reader_key(), plugins, self._basis, *parts)[:32]

    def _is_plain(self, identifier: str) -> bool:
        """True for a file that a path names alone, and that was not open before."""
        named = Path(identifier).is_absolute() and ":SDF_FORMAT_ARGS:" not in identifier
        return named and identifier not in self._loaded

    def _is_settled(self, mark: LayerMark) -> bool:
        """True if a layer is a file of before the stage was opened."""
        with suppress(OSError):
            return (
                self._is_plain(mark.identifier) and _file(mark.path).stat().st_mtime < self._start
            )
        return False

    def _is_current(self, scene: StoredScene) -> bool:
        """True if all layers and textures of a scene are as they were."""
        for mark in scene.layers:
            if not self._is_plain(mark.identifier) or Sdf.Layer.Find(mark.identifier):
                return False
            try:
                if sha256(read_resolved(mark.path)).digest() != mark.digest:
                    return False
            except EnvgenError:
                return False
        textures = {t.path for look in scene.summary.materials for t in look.textures.values()}
        return all(_file(path).exists() for path in textures)


def _opened(folder: Path) -> StoredScene | None:
    """A scene of the cache, noted as used; a damaged one is removed."""
    try:
        scene = StoredScene(folder)
        os.utime(folder)
    except (OSError, msgspec.MsgspecError, EnvgenError):
        shutil.rmtree(folder, ignore_errors=True)
        return None
    return scene


def _file(path: str) -> Path:
    """The file of a resolved path, perhaps inside a package (``a.usdz[b.png]``)."""
    return Path(path.partition("[")[0])


@cache
def _reader_key() -> str:
    """Hash of the code and the versions that a scene follows from."""
    package = resources.files("envgen_usd")
    files = list((package / "render" / "stage").iterdir())
    files += [package / "render" / name for name in ("render_scene.py", "packed_layout.py")]
    files += [package / "label_taxonomy.py"]
    files += [resources.files("envgen_usd.schemas") / "labels.toml"]
    code = [file.read_bytes() for file in sorted(files, key=str) if file.is_file()]
    versions = [metadata.version(name) for name in _LIBRARIES]
    return hash_bytes(*code, *versions, str(Usd.GetVersion()), platform.python_version())

"""Textures as the GPU takes them, with all mipmaps, kept in a folder of the user.

To decode an image and to make its mipmaps takes ten times as long as to read the result.
"""

import math
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from importlib import metadata, resources
from pathlib import Path

import numpy as np

from envgen_usd.build_manifest import hash_bytes
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.render_scene import Texture
from envgen_usd.render.stage.resolved_files import read_resolved
from envgen_usd.render.user_cache import trim
from envgen_usd.whole_files import write_whole

_MOST = 1e9
"""Bytes of all textures that are kept; a larger value keeps those of more libraries."""
_HEAD = np.dtype("<u4")


class TextureStore:
    """Mipmaps by what they follow from: content of files, use, code and renderer."""

    def __init__(self, folder: Path | None, renderer: str) -> None:
        """Opens the store.

        Args:
            folder: Folder of the files; `None` keeps nothing.
            renderer: Name and version of the renderer that makes mipmaps.
        """
        self._folder, self._renderer = folder, renderer
        self._digests: dict[str, str] = {}
        self._has_new = False

    def place(self, use: str, textures: Sequence[Texture | None], *figures: float) -> Path | None:
        """File of a texture for a use; `None` if nothing is kept.

        Args:
            use: Name of the use.
            textures: Images that it is made of.
            figures: What else it follows from.

        Raises:
            EnvgenError: An image is missing.
        """
        if self._folder is None:
            return None
        sources = [each and replace(each, path=self._digest(each.path)) for each in textures]
        return self._folder / hash_bytes(_code_key(), self._renderer, repr((use, sources, figures)))

    def find(self, place: Path | None) -> list[ByteArray] | None:
        """The mipmaps of a file, from the whole image to a single pixel: H x W x 4 each."""
        if place is None:
            return None
        try:
            data = np.memmap(place, np.uint8, "r")
            os.utime(place)
        except (OSError, ValueError):
            return None
        head, first = data[: 2 * _HEAD.itemsize], 2 * _HEAD.itemsize
        if len(head) < first:
            return None
        height, width = head.view(_HEAD).tolist()
        levels = []
        for number in range(max(height, width).bit_length()):
            shape = max(height >> number, 1), max(width >> number, 1), 4
            level = np.asarray(data[first : first + math.prod(shape)])
            if len(level) < math.prod(shape):
                return None
            levels.append(level.reshape(shape))
            first += len(level)
        return levels

    def keep(self, place: Path | None, levels: Sequence[ByteArray]) -> None:
        """Writes mipmaps; a folder that cannot be written is left alone."""
        if place is None:
            return
        head = np.array(levels[0].shape[:2], _HEAD).tobytes()
        with suppress(OSError, EnvgenError):
            place.parent.mkdir(parents=True, exist_ok=True)
            write_whole(place, b"".join((head, *(level.tobytes() for level in levels))))
            self._has_new = True

    def close(self) -> None:
        """Removes the textures that were not used for the longest time, if there are new ones."""
        if self._has_new and self._folder is not None:
            with suppress(OSError):
                trim(self._folder, _MOST)

    def _digest(self, path: str) -> str:
        if path not in self._digests:
            self._digests[path] = hash_bytes(read_resolved(path))
        return self._digests[path]


@cache
def _code_key() -> str:
    """Hash of the code and the versions that mipmaps follow from."""
    package = resources.files("envgen_usd")
    parts = ("opengl/gpu_textures.py", "opengl/texture_store.py", "stage/texture_images.py")
    names = (*(f"render/{part}" for part in parts), "image_pixels.py")
    versions = [metadata.version(name) for name in ("numpy", "pillow")]
    return hash_bytes(*((package / name).read_bytes() for name in names), *versions)

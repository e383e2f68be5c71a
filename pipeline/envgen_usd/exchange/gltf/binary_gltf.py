"""A binary glTF file (glTF 2.0, 4.4): JSON, and a single buffer with all arrays."""

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray

_MAGIC, _VERSION = 0x46546C67, 2
_JSON, _BIN = 0x4E4F534A, 0x004E4942
_COMPONENTS = {"u1": 5121, "u2": 5123, "u4": 5125, "f4": 5126}
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
"""Targets of buffer views with vertices and with indices."""


class BinaryGltf:
    """A document that grows: lists of nodes, meshes, ... and the bytes of its buffer."""

    def __init__(self, extras: dict[str, Any]) -> None:
        """Starts with an empty scene.

        Args:
            extras: Facts of the whole file, under ``asset.extras``; ``chunk`` is its name.
        """
        self._lists: dict[str, list[dict[str, Any]]] = {}
        self._chunks: list[bytes] = []
        self._length = 0
        self._extras = extras
        self._extensions: set[str] = set()

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        """Appends an entry to a list such as ``nodes``, without its empty values; its index."""
        entries = self._lists.setdefault(kind, [])
        entries.append({key: value for key, value in entry.items() if value not in (None, {}, [])})
        return len(entries) - 1

    def use_extension(self, name: str) -> None:
        """Notes an extension that readers may ignore."""
        self._extensions.add(name)

    def accessor(self, values: NDArray[Any], target: int | None = None, **more: Any) -> int:  # noqa: ANN401
        """Stores an array (N or N x k), and returns its accessor.

        Args:
            values: Numbers of type ``u1``, ``u2``, ``u4`` or ``f4``.
            target: What a buffer view holds.
            more: Further properties, e.g. ``normalized``.

        Raises:
            EnvgenError: A number is not finite.
        """
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise EnvgenError(
                f"{self._extras['chunk']}: a place or a size is beyond the numbers of glTF; look "
                "for prims with coordinates of more than 1e38 m"
            )
        values = np.ascontiguousarray(values)
        view = {
            "buffer": 0,
            "byteOffset": self._length,
            "byteLength": values.nbytes,
            "target": target,
        }
        self._append(values.tobytes())
        width = 1 if values.ndim == 1 else values.shape[1]
        return self.add(
            "accessors",
            {
                "bufferView": self.add("bufferViews", view),
                "componentType": _COMPONENTS[values.dtype.str[1:]],
                "count": len(values),
                "type": _TYPES[width],
                **more,
            },
        )

    def positions(self, values: NDArray[np.float32]) -> int:
        """Stores positions (N x 3) with their bounds, which glTF demands."""
        low, high = values.min(axis=0).tolist(), values.max(axis=0).tolist()
        return self.accessor(values, ARRAY_BUFFER, min=low, max=high)

    def mesh_bounds(self, mesh: int) -> FloatArray:
        """Minimum and maximum corner of a mesh: 2 x 3."""
        accessors = self._lists["accessors"]
        places = [
            accessors[primitive["attributes"]["POSITION"]]
            for primitive in self._lists["meshes"][mesh]["primitives"]
        ]
        low = np.min([place["min"] for place in places], axis=0)
        return np.stack((low, np.max([place["max"] for place in places], axis=0)))

    def to_bytes(self, roots: list[int]) -> bytes:
        """The file, with the given root nodes in its scene."""
        content: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "envgen-usd", "extras": self._extras},
            "scene": 0,
            "scenes": [{"nodes": roots}],
            **self._lists,
        }
        if self._length:
            content["buffers"] = [{"byteLength": self._length}]
        if self._extensions:
            content["extensionsUsed"] = sorted(self._extensions)
        text = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        parts = [struct.pack("<II", len(text), _JSON), text]
        if self._length:
            parts += [struct.pack("<II", self._length, _BIN), *self._chunks]
        size = 12 + sum(map(len, parts))
        return b"".join([struct.pack("<III", _MAGIC, _VERSION, size), *parts])

    def _append(self, data: bytes) -> None:
        """Adds bytes; each array begins at a multiple of four."""
        data += b"\0" * (-len(data) % 4)
        self._chunks.append(data)
        self._length += len(data)

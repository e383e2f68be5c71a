"""Reads back what an export wrote: the facts of a chunk's file, and the list of the chunks."""

import json
import struct
from pathlib import Path
from typing import Any

from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.gltf.gltf_materials import TEXTURES
from envgen_usd.exchange.source_images import SourceImages

INDEX = "tiles.json"
"""File that lists the chunks."""


def file_facts(path: Path) -> dict[str, Any]:
    """Facts of a chunk's .glb or .json file; empty for a file that is missing or not ours."""
    try:
        if path.suffix == ".json":
            facts = json.loads(path.read_text(encoding="utf-8"))
            return {key: facts[key] for key in ("key", "chunk", "origin", "textures")}
        facts = gltf_header(path)["asset"]["extras"]
        return facts if {"key", "chunk", "textures"} <= facts.keys() else {}
    except (OSError, ValueError, KeyError, TypeError, struct.error):
        return {}


def kept_facts(path: Path, key: str, images: SourceImages) -> dict[str, Any]:
    """Facts of a chunk's file that follows from a key and from images as they are.

    Empty for another file, and for one whose textures are not whole.
    """
    facts = file_facts(path)
    textures = [path.parent / TEXTURES / str(name) for name in facts.get("textures", ())]
    holds = (
        facts.get("key") == key
        and images.are_unchanged(facts.get("images", {}))
        and all(map(images.is_whole, textures))
    )
    return facts if holds else {}


def gltf_header(path: Path) -> dict[str, Any]:
    """The JSON of a binary glTF file, without its buffer.

    Raises:
        ValueError: The file is no binary glTF 2.0.
    """
    with path.open("rb") as file:
        magic, version, size, length, kind = struct.unpack("<4sIII4s", file.read(20))
        if (magic, version, kind) != (b"glTF", 2, b"JSON") or size != path.stat().st_size:
            raise ValueError(f"{path}: is no whole glTF file")
        content: dict[str, Any] = json.loads(file.read(length))
    return content


def read_index(folder: Path) -> dict[str, Any]:
    """The list of an export's chunks.

    Raises:
        EnvgenError: The folder holds no export.
    """
    path = folder / INDEX
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(content["chunks"], list):
            raise TypeError("chunks is no list")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise EnvgenError(
            f"{path}: is no list of an export's chunks; run `envgen-usd export OUT --gltf`"
        ) from error
    return dict(content)

"""Looks as glTF materials, with texture files that all chunks share."""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from PIL import Image

from envgen_usd.build_manifest import hash_bytes
from envgen_usd.errors import EnvgenError, one_line
from envgen_usd.exchange.gltf.binary_gltf import BinaryGltf
from envgen_usd.image_pixels import UNREADABLE
from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.render_scene import Material, Texture
from envgen_usd.render.stage.resolved_files import read_resolved
from envgen_usd.render.stage.texture_images import read_texture

TEXTURES = "textures"
"""Folder of the texture files beside the chunks' files."""
_DIGITS = 12
"""Of the hash in a texture's name."""
_OURS = re.compile(rf".*_[0-9a-f]{{{_DIGITS}}}\.[a-zA-Z]+")
_KINDS = {".jpg": "JPEG", ".jpeg": "JPEG", ".png": "PNG"}
_REPEAT, _CLAMP = 10497, 33071
_NORMAL = ((2.0, 2.0, 2.0, 1.0), (-1.0, -1.0, -1.0, 0.0))
_PLAIN = ((1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0))


@dataclass
class TextureFiles:
    """Texture files of an export: content by name.

    A file is copied where glTF can say all that the look says; else its values are changed. Its
    name holds the hash of its content, so that a file of an earlier run never gets another image.
    """

    files: dict[str, bytes] = field(default_factory=dict)
    _names: dict[object, str] = field(default_factory=dict)

    def copied(self, texture: Texture) -> str:
        """Name of the file of a texture whose values stay as they are."""
        if texture.path not in self._names:
            name = PurePath(texture.path.rstrip("]").rpartition("[")[2]).name
            self._names[texture.path] = self._stored(name, read_resolved(texture.path))
        return self._names[texture.path]

    def changed(self, key: tuple[object, ...], stem: str, pixels: ByteArray) -> str:
        """Name of a new file with the pixels (H x W x 3 or 4, top row first)."""
        if key not in self._names:
            stream = BytesIO()
            Image.fromarray(pixels).save(stream, "PNG")
            self._names[key] = self._stored(f"{stem}.png", stream.getvalue())
        return self._names[key]

    def has(self, key: tuple[object, ...]) -> str | None:
        """Name of a changed file that exists already."""
        return self._names.get(key)

    def _stored(self, name: str, content: bytes) -> str:
        path = PurePath(name)
        file = f"{path.stem}_{texture_digest(content)}{path.suffix}"
        self.files[file] = content
        return file


def remove_textures(folder: Path, used: Collection[str]) -> None:
    """Removes texture files of earlier exports that no file uses any more."""
    for path in folder.glob("*"):
        if path.name not in used and _OURS.fullmatch(path.name):
            path.unlink()


def texture_digest(content: bytes) -> str:
    """The hash in the name of a texture file."""
    return hash_bytes(content)[:_DIGITS]


@dataclass(frozen=True)
class StageLooks:
    """Looks of a stage, and the files of their textures.

    Attributes:
        materials: Looks; may grow while the stage is read.
        names: Name of each look by its index.
        textures: Takes the texture files.
    """

    materials: list[Material]
    names: Mapping[int, str]
    textures: TextureFiles = field(default_factory=TextureFiles)


class GltfMaterials:
    """Materials of a document; each look becomes a material at its first use."""

    def __init__(self, document: BinaryGltf, looks: StageLooks) -> None:
        """Starts empty; the document takes materials, textures and images."""
        self._document, self._looks = document, looks
        self._textures = looks.textures
        self._known: dict[tuple[int, bool], int] = {}
        self._images: dict[tuple[str, tuple[bool, bool]], int] = {}
        self._samplers: dict[tuple[bool, bool], int] = {}
        self._sources = set[str]()

    def look(self, number: int) -> Material:
        """A look of the stage."""
        return self._looks.materials[number]

    @property
    def files(self) -> list[str]:
        """Names of the texture files in use, sorted."""
        return sorted({file for file, _ in self._images})

    @property
    def sources(self) -> frozenset[str]:
        """Paths of the images of the looks in use."""
        return frozenset(self._sources)

    def index(self, look: int, *, double_sided: bool) -> int:
        """Index of a look's material in the document."""
        key = (look, double_sided)
        if key not in self._known:
            entry = self._material(look, double_sided)
            self._known[key] = self._document.add("materials", entry)
        return self._known[key]

    def _material(self, number: int, double_sided: bool) -> dict[str, Any]:
        look = self.look(number)
        self._sources |= {texture.path for texture in look.textures.values()}
        name = self._looks.names.get(number, f"look_{number}" if number else "unbound")
        surface: dict[str, Any] = {"metallicFactor": look.metallic}
        surface["roughnessFactor"] = 1.0 if "roughness" in look.textures else look.roughness
        surface |= self._colour(look, name)
        if "roughness" in look.textures:
            surface["metallicRoughnessTexture"] = self._roughness(look, name)
        entry: dict[str, Any] = {
            # Materials are shared by name among the files of an export.
            "name": f"{name}_double_sided" if double_sided else name,
            "pbrMetallicRoughness": surface,
            "doubleSided": double_sided or None,
            "extras": {"texture_size": look.size} if look.textures else None,
            **_opacity(look),
            **self._emission(look, name),
        }
        if "normal" in look.textures:
            entry["normalTexture"] = {"index": self._normal(look.textures["normal"], name)}
        return entry

    def _colour(self, look: Material, name: str) -> dict[str, Any]:
        texture = look.textures.get("diffuse")
        factor = [1.0, 1.0, 1.0] if look.vertex_colour else list(np.clip(look.diffuse, 0.0, 1.0))
        if texture is None:
            return {"baseColorFactor": [float(v) for v in (*factor, look.opacity)]}
        opacity = look.textures.get("opacity")
        same = opacity is None or (opacity.path == texture.path and opacity.channel == 3)
        fits = texture.bias == _PLAIN[1] and max(texture.scale) <= 1.0 and min(texture.scale) >= 0.0
        if same and fits and texture.srgb and _is_usual(texture):
            image = self._image(self._textures.copied(texture), texture)
            rgb = [*texture.scale[:3], look.opacity]
            return {"baseColorTexture": {"index": image}, "baseColorFactor": rgb}
        image = self._image(self._changed_colour(texture, opacity, name), texture)
        return {
            "baseColorTexture": {"index": image},
            "baseColorFactor": [1.0, 1.0, 1.0, look.opacity],
        }

    def _changed_colour(self, texture: Texture, opacity: Texture | None, name: str) -> str:
        """File with the scaled colours, sRGB-encoded, and the opacity of another file as alpha."""
        key = ("colour", texture, opacity)
        known = self._textures.has(key)
        if known:
            return known
        pixels = read_texture(texture)[::-1].copy()
        if not texture.srgb:
            linear = pixels[..., :3] / 255.0
            low, high = 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055
            pixels[..., :3] = np.round(255 * np.where(linear <= 0.0031308, low, high))
        if opacity is not None:
            cut = Image.fromarray(read_texture(opacity)[::-1])
            size = (pixels.shape[1], pixels.shape[0])
            pixels[..., 3] = np.asarray(cut.resize(size))[..., opacity.channel]
        return self._textures.changed(key, f"{name}_base", pixels)

    def _roughness(self, look: Material, name: str) -> dict[str, Any]:
        """Roughness is green and metalness blue; a grey file says both of a non-metal."""
        texture = look.textures["roughness"]
        plain = (texture.scale, texture.bias) == _PLAIN and _is_usual(texture)
        if plain and look.metallic == 0.0 and _is_grey(texture):
            return {"index": self._image(self._textures.copied(texture), texture)}
        key = ("roughness", texture)
        file = self._textures.has(key)
        if not file:
            values = read_texture(texture)[::-1][..., texture.channel]
            full = np.full_like(values, 255)
            pixels = np.stack((full, values, full), axis=-1)
            file = self._textures.changed(key, f"{name}_rough", pixels)
        return {"index": self._image(file, texture)}

    def _normal(self, texture: Texture, name: str) -> int:
        if (texture.scale, texture.bias) in (_NORMAL, _PLAIN) and _is_usual(texture):
            return self._image(self._textures.copied(texture), texture)
        key = ("normal", texture)
        file = self._textures.has(key)
        if not file:
            vectors = read_texture(texture)[::-1][..., :3]
            file = self._textures.changed(key, f"{name}_normal", vectors)
        return self._image(file, texture)

    def _emission(self, look: Material, name: str) -> dict[str, Any]:
        strength = max(look.emissive)
        if strength <= 0.0:
            return {}
        entry: dict[str, Any] = {
            "emissiveFactor": [value / max(strength, 1.0) for value in look.emissive]
        }
        glow = look.textures.get("emissive")
        if glow is not None:
            usual = glow.srgb and _is_usual(glow)
            file = (
                self._textures.copied(glow)
                if usual
                else self._changed_colour(glow, None, f"{name}_glow")
            )
            entry["emissiveTexture"] = {"index": self._image(file, glow)}
        if strength <= 1.0:
            return entry
        self._document.use_extension("KHR_materials_emissive_strength")
        extension = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
        return {**entry, "extensions": extension}

    def _glow(self, texture: Texture, name: str) -> int:
        if texture.srgb and _is_usual(texture):
            return self._image(self._textures.copied(texture), texture)
        return self._image(self._changed_colour(texture, None, f"{name}_glow"), texture)

    def _image(self, file: str, texture: Texture) -> int:
        """Index of the texture of a file."""
        key = (file, texture.repeat)
        if key not in self._images:
            path, uri = PurePath(file), f"{TEXTURES}/{file}"
            name = path.stem.rpartition("_")[0] + path.suffix
            source = self._document.add("images", {"uri": uri, "name": name})
            entry = {"source": source, "sampler": self._sampler(texture.repeat)}
            self._images[key] = self._document.add("textures", entry)
        return self._images[key]

    def _sampler(self, repeat: tuple[bool, bool]) -> int:
        if repeat not in self._samplers:
            s, t = (_REPEAT if each else _CLAMP for each in repeat)
            entry = {"magFilter": 9729, "minFilter": 9987, "wrapS": s, "wrapT": t}
            self._samplers[repeat] = self._document.add("samplers", entry)
        return self._samplers[repeat]


def _opacity(look: Material) -> dict[str, Any]:
    if look.opacity_threshold > 0.0:
        return {"alphaMode": "MASK", "alphaCutoff": look.opacity_threshold}
    return {"alphaMode": "BLEND"} if look.opacity < 1.0 or "opacity" in look.textures else {}


def _is_usual(texture: Texture) -> bool:
    """True for files that glTF allows."""
    return PurePath(texture.path.rstrip("]")).suffix.lower() in _KINDS


def _is_grey(texture: Texture) -> bool:
    """True if the first channel of a file is also its second."""
    try:
        with Image.open(BytesIO(read_resolved(texture.path))) as image:
            return image.mode == "L" or (texture.channel == 1 and image.mode in {"RGB", "RGBA"})
    except UNREADABLE as error:
        raise EnvgenError(f"{texture.path}: is no image: {one_line(error)}") from error

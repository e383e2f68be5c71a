"""Writes materials of another program as materials of the library, with their textures."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image

from envgen_usd.assets.imports.source_model import SourceMaterial
from envgen_usd.assets.material_layers import MaterialLook, material_layer
from envgen_usd.assets.prim_authoring import prim_names
from envgen_usd.assets.usd_files import write_layer
from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.whole_files import make_folder, whole_file

_QUALITY = 90
_WHITE = 0.999
"""Least factor of an image that leaves it unchanged."""


def write_materials(
    materials: Mapping[str, SourceMaterial], asset: str, library: Path
) -> dict[str, str]:
    """Writes ``materials/<asset>_<name>.usda`` and its textures.

    Args:
        materials: Materials by their name in the file.
        asset: Name of the asset, which begins the names of its materials.
        library: Folder of the library.

    Returns:
        Name in the library of each material.
    """
    textures = library / "textures"
    make_folder(textures)
    make_folder(library / "materials")
    names = prim_names(f"{asset}_{name}" for name in materials)
    written = {}
    for name, material in materials.items():
        written[name] = names[f"{asset}_{name}"]
        look = _look(material, written[name])
        _write_textures(material, look, textures)
        path = library / "materials" / f"{look.name}.usda"
        write_layer(material_layer(look, "../textures"), path)
    return written


def _look(material: SourceMaterial, name: str) -> MaterialLook:
    image = material.colour_image
    clear = image is not None and material.cut_out > 0.0 and bool((image[..., 3] < 255).any())
    maps = {
        "normal": material.normal_image is not None,
        "roughness": material.roughness_image is not None,
        "opacity": clear,
    }
    return MaterialLook(
        name,
        colour=material.colour,
        roughness=material.roughness,
        metallic=round(material.metallic, 3),
        emission=material.emission,
        # A relief without a colour needs texture coordinates, which come with a texture.
        texture=name if image is not None or any(maps.values()) else "",
        relief=name,
        maps=tuple(key for key, there in maps.items() if there),
        cut_out=material.cut_out if clear else 0.0,
        lossless=False,
    )


def _write_textures(material: SourceMaterial, look: MaterialLook, folder: Path) -> None:
    """Writes images with the names that `material_layers.material_layer` refers to."""
    if not look.texture:
        return
    image = material.colour_image
    if image is None:
        image = np.full((4, 4, 4), 255, dtype=np.uint8)
    tinted = _tinted(image, np.array(material.colour))
    if "opacity" in look.maps:
        _write(np.concatenate([tinted, image[..., 3:]], axis=2), folder / f"{look.name}_colour.png")
    else:
        _write(tinted, folder / f"{look.name}_colour.jpg")
    if material.normal_image is not None:
        _write(material.normal_image, folder / f"{look.name}_normal.jpg")
    if material.roughness_image is not None:
        scaled = material.roughness_image * np.clip(material.roughness, 0.0, 1.0)
        _write(np.round(scaled).astype(np.uint8), folder / f"{look.name}_roughness.jpg")


def _tinted(image: ByteArray, colour: FloatArray) -> ByteArray:
    """An sRGB image (H x W x 4) times a linear colour, H x W x 3."""
    plain = np.ascontiguousarray(image[..., :3])
    if (colour >= _WHITE).all():
        return plain
    levels = np.arange(256) / 255.0
    linear = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
    product = np.clip(linear[plain] * colour, 0.0, 1.0)
    encoded = np.where(product <= 0.0031308, product * 12.92, 1.055 * product ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255.0).astype(np.uint8)


def _write(pixels: ByteArray, path: Path) -> None:
    with whole_file(path) as part:
        Image.fromarray(pixels).save(part, quality=_QUALITY, optimize=True)

"""Makes the package's own library: ``python -m envgen_usd.assets.author [FOLDER]``."""

import sys
from importlib import resources
from pathlib import Path

import numpy as np
from PIL import Image

from envgen_usd.assets.asset_layers import write_asset
from envgen_usd.assets.designs import designs
from envgen_usd.assets.files import write_layer
from envgen_usd.assets.looks import TEXTURED, UNIFORM, textured_look
from envgen_usd.assets.materials import material_layer
from envgen_usd.assets.textures.texture import Texture, to_normals, to_srgb
from envgen_usd.models.arrays import ByteArray
from envgen_usd.seeds import generator

QUALITY = 88


def author_library(folder: Path) -> None:
    """Writes all textures, materials and assets; the same source gives the same pictures.

    Args:
        folder: The library's folder; files of the same name are replaced, others are kept.
    """
    for part in ("textures", "materials"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    looks = list(UNIFORM)
    for name, (recipe, roughness) in TEXTURED.items():
        texture = recipe(generator(0, "texture", name))
        _write_texture(texture, folder / "textures", name)
        looks.append(textured_look(name, texture, roughness))
    for look in looks:
        layer = material_layer(look, "../textures")
        write_layer(layer, folder / "materials" / f"{look.name}.usda")
    for design in designs():
        write_asset(design, folder)


def _write_texture(texture: Texture, folder: Path, name: str) -> None:
    colour = to_srgb(texture.albedo)
    if texture.opacity is None:
        _write_picture(colour, folder / f"{name}_colour.jpg")
    else:
        alpha = np.round(texture.opacity * 255).astype(np.uint8)[..., None]
        _write_picture(np.concatenate([colour, alpha], axis=2), folder / f"{name}_colour.png")
    if texture.height is not None:
        _write_picture(to_normals(texture.height, texture.size), folder / f"{name}_normal.jpg")
    if texture.roughness is not None:
        rough = np.round(np.clip(texture.roughness, 0, 1) * 255).astype(np.uint8)
        _write_picture(rough, folder / f"{name}_roughness.jpg")


def _write_picture(pixels: ByteArray, path: Path) -> None:
    """Writes a picture whose first row is the lower edge."""
    Image.fromarray(np.ascontiguousarray(pixels[::-1])).save(path, quality=QUALITY, optimize=True)


if __name__ == "__main__":
    author_library(
        Path(sys.argv[1])
        if len(sys.argv) > 1
        else Path(str(resources.files("envgen_usd.asset_library")))
    )

"""Writes the shipped library: ``python -m envgen_usd.assets.library_author [FOLDER [KIND...]]``.

With kinds, only the assets of these kinds and the materials of uniform colour are written.
"""

import sys
from collections.abc import Collection, Iterable
from importlib import resources
from pathlib import Path

import numpy as np
from PIL import Image

from envgen_usd.assets.asset_design import AssetDesign
from envgen_usd.assets.asset_layers import write_asset
from envgen_usd.assets.coarse_pieces import with_far_pieces
from envgen_usd.assets.material_layers import MaterialLook, material_layer
from envgen_usd.assets.materialx_files import has_materialx, materialx_document
from envgen_usd.assets.shapes.printed_faces import PrintedFaces, sign_material
from envgen_usd.assets.shapes.printed_shapes import printed_designs
from envgen_usd.assets.shapes.sign_face_shapes import shop_sign_design, sign_design
from envgen_usd.assets.shipped_assets import designs
from envgen_usd.assets.shipped_looks import (
    CLOTHING,
    TEXTURED,
    UNIFORM,
    make_texture,
    room_looks,
    textured_look,
)
from envgen_usd.assets.signs.sign_atlas import atlas
from envgen_usd.assets.signs.sign_drawing import read_drawing_kit
from envgen_usd.assets.signs.sign_sheets import (
    read_displays,
    read_prints,
    read_shop_names,
    read_sign_sheets,
)
from envgen_usd.assets.textures.procedural_texture import Texture, to_normals, to_srgb
from envgen_usd.assets.usd_files import write_layer
from envgen_usd.assets.vehicle_assets import vehicle_designs
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.whole_files import make_folder, whole_file, write_whole

QUALITY = 88
SMALLEST = True
"""Whether images are packed as small as they get; else they take a fifth of the time."""
_AMBER = (0.015, 0.015, 0.015)
"""Radiance of the brightest channel of displays, of which their glow takes its share; 300 cd/m²."""
_DARK = 0.05
"""Reflectance of the brightest channel up to which a display is dark."""
SHIPPED = Path(str(resources.files("envgen_usd.asset_library")))
"""The shipped library; it holds the sheets of signs."""


def author_library(folder: Path) -> None:
    """Writes all textures, materials and assets; the same source gives the same images.

    Args:
        folder: Folder of the library; files of the same name are replaced, others are kept.
    """
    for part in ("textures", "materials"):
        make_folder(folder / part)
    _write_looks((*UNIFORM, *CLOTHING), folder)
    for name, made in TEXTURED.items():
        texture = make_texture(name)
        _write_colour(texture, folder / "textures", name)
        if texture.glow is not None:
            _write_glow(texture.glow, folder / "textures", name)
        if made.relief == name:
            _write_relief(texture, folder / "textures", name)
        _write_looks((textured_look(name, texture), *room_looks(name, texture)), folder)
    for design in (*designs(), *author_signs(folder), *_vehicles()):
        write_asset(design, folder)


def author_kinds(folder: Path, kinds: Collection[str]) -> None:
    """Writes the assets of some kinds, and the materials of uniform colour; textures stay.

    Args:
        folder: Folder of the library.
        kinds: Kinds of assets, e.g. ``car``.

    Raises:
        EnvgenError: No asset is of one of the kinds.
    """
    make_folder(folder / "materials")
    _write_looks((*UNIFORM, *CLOTHING), folder)
    found = [design for design in _vehicles() if design.kind in kinds]
    if {design.kind for design in found} != set(kinds):
        found += [design for design in (*designs(), *sheet_designs()) if design.kind in kinds]
    missing = sorted(set(kinds) - {design.kind for design in found})
    if missing:
        raise EnvgenError(f"no shipped asset is of the kind {', '.join(missing)}")
    for design in found:
        write_asset(design, folder)


def _write_looks(looks: Iterable[MaterialLook], folder: Path) -> None:
    for look in looks:
        layer = material_layer(look, "../textures")
        write_layer(layer, folder / "materials" / f"{look.name}.usda")
        if has_materialx(look):
            document = folder / "materials" / f"{look.name}.mtlx"
            write_whole(document, materialx_document(look, "../textures"))


def _vehicles() -> tuple[AssetDesign, ...]:
    prints, displays = read_prints(SHIPPED), read_displays(SHIPPED)
    return vehicle_designs(PrintedFaces(prints), PrintedFaces(displays))


def author_signs(folder: Path) -> tuple[AssetDesign, ...]:
    """Writes atlas and material of each sheet of faces; returns the assets that show them."""
    kit = read_drawing_kit(SHIPPED)
    sheets = read_sign_sheets(SHIPPED)
    shops, prints = read_shop_names(SHIPPED), read_prints(SHIPPED)
    for sheet in (*sheets, shops, prints):
        name = sign_material(sheet)
        _write_picture(to_srgb(atlas(sheet, kit)), folder / "textures" / f"{name}_colour.png")
        look = MaterialLook(name, roughness=0.4, texture=name, lossless=True)
        write_layer(material_layer(look, "../textures"), folder / "materials" / f"{name}.usda")
    author_displays(folder)
    return sheet_designs()


def author_displays(folder: Path) -> None:
    """Writes atlas, glow and material of the displays: what is not black shines."""
    sheet = read_displays(SHIPPED)
    name, drawn = sign_material(sheet), atlas(sheet, read_drawing_kit(SHIPPED))
    glow = np.where(drawn.max(axis=2, keepdims=True) > _DARK, drawn, 0.0)
    _write_picture(to_srgb(drawn), folder / "textures" / f"{name}_colour.png")
    _write_glow(glow, folder / "textures", name)
    look = MaterialLook(name, roughness=0.4, texture=name, lossless=True, emission=_AMBER,
                        maps=("emission",))  # fmt: skip
    write_layer(material_layer(look, "../textures"), folder / "materials" / f"{name}.usda")


def sheet_designs() -> tuple[AssetDesign, ...]:
    """The assets that show the faces of a sheet, besides vehicles."""
    sheets = read_sign_sheets(SHIPPED)
    shops, prints = read_shop_names(SHIPPED), read_prints(SHIPPED)
    signs = (sign_design(sheet) for sheet in sheets)
    printed = map(with_far_pieces, printed_designs(prints))
    return (*signs, shop_sign_design(shops), *printed)


def _write_colour(texture: Texture, folder: Path, name: str) -> None:
    colour = to_srgb(texture.albedo)
    if texture.opacity is None:
        _write_picture(colour, folder / f"{name}_colour.jpg")
    else:
        alpha = np.round(texture.opacity * 255).astype(np.uint8)[..., None]
        _write_picture(np.concatenate([colour, alpha], axis=2), folder / f"{name}_colour.png")


def _write_glow(glow: FloatArray, folder: Path, name: str) -> None:
    _write_picture(to_srgb(glow / glow.max()), folder / f"{name}_emission.jpg")


def _write_relief(texture: Texture, folder: Path, name: str) -> None:
    """Writes the normals, and the roughness with half their side: it is smoother."""
    if texture.height is not None:
        _write_picture(to_normals(texture.height, texture.size), folder / f"{name}_normal.jpg")
    if texture.roughness is not None:
        half = len(texture.roughness) // 2
        blocks = texture.roughness.reshape(half, 2, half, 2).mean(axis=(1, 3))
        rough = np.round(np.clip(blocks, 0, 1) * 255).astype(np.uint8)
        _write_picture(rough, folder / f"{name}_roughness.jpg")


def _write_picture(pixels: ByteArray, path: Path) -> None:
    """Writes an image whose first row is the lower edge."""
    image = Image.fromarray(np.ascontiguousarray(pixels[::-1]))
    with whole_file(path) as part:
        image.save(part, quality=QUALITY, optimize=SMALLEST, compress_level=9 if SMALLEST else 1)


if __name__ == "__main__":
    if len(sys.argv) > 2:
        author_kinds(Path(sys.argv[1]), sys.argv[2:])
    else:
        author_library(Path(sys.argv[1]) if len(sys.argv) > 1 else SHIPPED)

"""All materials of the shipped library."""

from collections.abc import Callable

import numpy as np

from envgen_usd.assets.material_layers import MaterialLook
from envgen_usd.assets.textures import (
    covering_textures,
    foliage_textures,
    ground_textures,
    masonry_textures,
)
from envgen_usd.assets.textures.procedural_texture import Texture

Recipe = Callable[[np.random.Generator], Texture]

TEXTURED: dict[str, tuple[Recipe, float]] = {
    "asphalt": (ground_textures.asphalt, 0.90),
    "asphalt_worn": (ground_textures.asphalt_worn, 0.92),
    "bark": (covering_textures.bark, 0.95),
    "bitumen": (covering_textures.bitumen, 0.90),
    "brick_red": (masonry_textures.brick_red, 0.88),
    "concrete": (masonry_textures.concrete, 0.85),
    "curb_stone": (masonry_textures.curb_stone, 0.80),
    "flagstone": (masonry_textures.flagstone, 0.88),
    "forest_floor": (ground_textures.forest_floor, 0.97),
    "grass": (ground_textures.grass, 0.95),
    "grass_verge": (ground_textures.grass_verge, 0.95),
    "gravel": (ground_textures.gravel, 0.95),
    "lawn": (ground_textures.lawn, 0.93),
    "leaves": (foliage_textures.leaves, 0.75),
    "leaves_autumn": (foliage_textures.leaves_autumn, 0.80),
    "marking_white": (ground_textures.marking_white, 0.75),
    "marking_yellow": (ground_textures.marking_yellow, 0.75),
    "needles": (foliage_textures.needles, 0.80),
    "paving": (masonry_textures.paving, 0.85),
    "plaster": (masonry_textures.plaster, 0.92),
    "roof_shingles": (covering_textures.roof_shingles, 0.92),
    "roof_slate": (covering_textures.roof_slate, 0.65),
    "roof_tiles_red": (covering_textures.roof_tiles_red, 0.85),
    "rubble": (ground_textures.rubble, 0.95),
    "sheet_metal": (covering_textures.sheet_metal, 0.50),
    "sheet_metal_roof": (covering_textures.sheet_metal_roof, 0.45),
    "wood": (covering_textures.wood, 0.80),
}
"""Texture recipe and roughness of each textured material."""

_ROOM, _DRAPED = (0.0041, 0.0028, 0.0015), (0.00095, 0.0006, 0.0003)
"""Luminance of a window of a lit room: 60 cd/m², and 13 cd/m² behind curtains."""
_GLOBE = (0.20, 0.14, 0.075)
"""Luminance of a lamp's globe: 3 kcd/m²."""

UNIFORM = (
    MaterialLook("glass", (0.028, 0.034, 0.038), roughness=0.06, specular=1.52),
    MaterialLook("glass_lit", (0.028, 0.034, 0.038), roughness=0.06, specular=1.52, emission=_ROOM),
    MaterialLook(
        "glass_draped", (0.028, 0.034, 0.038), roughness=0.06, specular=1.52, emission=_DRAPED
    ),
    MaterialLook("lamp", (0.80, 0.78, 0.72), roughness=0.35, emission=_GLOBE),
    MaterialLook("lens_amber", (0.32, 0.14, 0.01), roughness=0.25),
    MaterialLook("lens_green", (0.02, 0.20, 0.09), roughness=0.25),
    MaterialLook("lens_red", (0.30, 0.02, 0.015), roughness=0.25),
    MaterialLook("metal_dark", (0.045, 0.046, 0.048), roughness=0.45),
    MaterialLook("metal_galvanised", (0.34, 0.35, 0.36), roughness=0.45),
    MaterialLook("paint_black", (0.016, 0.016, 0.017), roughness=0.40),
    MaterialLook("paint_blue", (0.030, 0.070, 0.170), roughness=0.45),
    MaterialLook("paint_brown", (0.090, 0.045, 0.024), roughness=0.50),
    MaterialLook("paint_green", (0.018, 0.062, 0.034), roughness=0.45),
    MaterialLook("paint_grey", (0.215, 0.225, 0.230), roughness=0.45),
    MaterialLook("paint_orange", (0.560, 0.120, 0.010), roughness=0.45),
    MaterialLook("paint_red", (0.290, 0.022, 0.018), roughness=0.45),
    MaterialLook("paint_white", (0.66, 0.66, 0.64), roughness=0.45),
    MaterialLook("paint_yellow", (0.58, 0.36, 0.02), roughness=0.45),
)
"""Materials of uniform colour."""


def textured_look(name: str, texture: Texture, roughness: float) -> MaterialLook:
    """The material of a texture."""
    maps = {
        "normal": texture.height is not None,
        "roughness": texture.roughness is not None,
        "opacity": texture.opacity is not None,
    }
    # Distant opacity tends to its mean; the threshold is lower, so that distant trees keep their
    # leaves.
    return MaterialLook(
        name,
        roughness=roughness,
        texture=name,
        size=texture.size,
        maps=tuple(key for key, there in maps.items() if there),
        cut_out=0.0 if texture.opacity is None else round(0.75 * float(texture.opacity.mean()), 2),
    )

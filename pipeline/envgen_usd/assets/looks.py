"""What materials the library that comes with the package has."""

from collections.abc import Callable

import numpy as np

from envgen_usd.assets.materials import MaterialLook
from envgen_usd.assets.textures import coverings, foliage, grounds, masonry
from envgen_usd.assets.textures.texture import Texture

Recipe = Callable[[np.random.Generator], Texture]

TEXTURED: dict[str, tuple[Recipe, float]] = {
    "asphalt": (grounds.asphalt, 0.90),
    "asphalt_worn": (grounds.asphalt_worn, 0.92),
    "bark": (coverings.bark, 0.95),
    "bitumen": (coverings.bitumen, 0.90),
    "brick_red": (masonry.brick_red, 0.88),
    "concrete": (masonry.concrete, 0.85),
    "curb_stone": (masonry.curb_stone, 0.80),
    "flagstone": (masonry.flagstone, 0.88),
    "forest_floor": (grounds.forest_floor, 0.97),
    "grass": (grounds.grass, 0.95),
    "grass_verge": (grounds.grass_verge, 0.95),
    "gravel": (grounds.gravel, 0.95),
    "lawn": (grounds.lawn, 0.93),
    "leaves": (foliage.leaves, 0.75),
    "leaves_autumn": (foliage.leaves_autumn, 0.80),
    "marking_white": (grounds.marking_white, 0.75),
    "marking_yellow": (grounds.marking_yellow, 0.75),
    "needles": (foliage.needles, 0.80),
    "paving": (masonry.paving, 0.85),
    "plaster": (masonry.plaster, 0.92),
    "roof_shingles": (coverings.roof_shingles, 0.92),
    "roof_slate": (coverings.roof_slate, 0.65),
    "roof_tiles_red": (coverings.roof_tiles_red, 0.85),
    "rubble": (grounds.rubble, 0.95),
    "sheet_metal": (coverings.sheet_metal, 0.50),
    "sheet_metal_roof": (coverings.sheet_metal_roof, 0.45),
    "wood": (coverings.wood, 0.80),
}
"""Recipe of the texture and roughness of each textured material."""

UNIFORM = (
    MaterialLook("glass", (0.028, 0.034, 0.038), roughness=0.06, specular=1.52),
    MaterialLook("lamp", (0.80, 0.78, 0.72), roughness=0.35),
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
"""Materials of one colour."""


def textured_look(name: str, texture: Texture, roughness: float) -> MaterialLook:
    """The material that shows a texture."""
    maps = {
        "normal": texture.height is not None,
        "roughness": texture.roughness is not None,
        "opacity": texture.opacity is not None,
    }
    # Far away opacity tends to its mean: above the threshold, so that a far tree keeps its leaves.
    return MaterialLook(
        name,
        roughness=roughness,
        texture=name,
        size=texture.size,
        maps=tuple(key for key, there in maps.items() if there),
        cut_out=0.0 if texture.opacity is None else round(0.75 * float(texture.opacity.mean()), 2),
    )

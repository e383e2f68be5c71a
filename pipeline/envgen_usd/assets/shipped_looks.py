"""All materials of the shipped library."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from envgen_usd.assets.material_layers import Colour, MaterialLook, Pattern
from envgen_usd.assets.textures import (
    brick_textures,
    cabin_texture,
    covering_textures,
    flower_textures,
    foliage_textures,
    ground_textures,
    hedge_textures,
    masonry_textures,
    pane_textures,
    road_textures,
)
from envgen_usd.assets.textures.procedural_texture import Texture
from envgen_usd.models.array_types import FloatArray
from envgen_usd.seeds import generator

L = TypeVar("L")
Recipe = Callable[[np.random.Generator], Texture]


@dataclass(frozen=True)
class Textured:
    """How a material's textures are made.

    Attributes:
        recipe: Function of a random generator.
        roughness: 0 to 1, for tools that read no roughness map.
        relief: Material whose normals and roughness it shares.
        emission: Emitted radiance, the mean of its texture if there is one.
    """

    recipe: Recipe
    roughness: float
    relief: str
    emission: Colour = (0.0, 0.0, 0.0)


def _family(
    recipe: Callable[[np.random.Generator, L], Texture], roughness: float, looks: Mapping[str, L]
) -> dict[str, Textured]:
    """Materials of a recipe that differ in colour; all have the relief of the first."""
    return {
        name: Textured(_with_look(recipe, look), roughness, next(iter(looks)))
        for name, look in looks.items()
    }


def _each(
    recipe: Callable[[np.random.Generator, L], Texture], roughness: float, looks: Mapping[str, L]
) -> dict[str, Textured]:
    """Materials of a recipe that differ in relief too."""
    return {
        name: Textured(_with_look(recipe, look), roughness, name) for name, look in looks.items()
    }


def _with_look(recipe: Callable[[np.random.Generator, L], Texture], look: L) -> Recipe:
    return lambda rng: recipe(rng, look)


def _alone(roughness: float, name: str, recipe: Recipe) -> dict[str, Textured]:
    return {name: Textured(recipe, roughness, name)}


_BRICKS = {
    "brick_red": brick_textures.RED,
    "brick_orange": brick_textures.ORANGE,
    "brick_brown": brick_textures.BROWN,
    "brick_yellow": brick_textures.YELLOW,
    "brick_sooted": brick_textures.SOOTED,
    "brick_painted": brick_textures.PAINTED,
}
_ASPHALTS = {
    "asphalt": road_textures.ROLLED,
    "asphalt_fresh": road_textures.FRESH,
    "asphalt_worn": road_textures.WORN,
    "asphalt_old": road_textures.OLD,
    "asphalt_patched": road_textures.PATCHED,
    "paving_asphalt": road_textures.FOOTWAY,
}
_PAVINGS = {
    "paving": masonry_textures.FLAGS,
    "paving_setts": masonry_textures.SETTS,
    "paving_pale": masonry_textures.PALE_SLABS,
}
_KERBS = {"curb_stone": masonry_textures.GRANITE, "curb_concrete": masonry_textures.CAST_KERB}
_STONES = {
    "flagstone": masonry_textures.TAN,
    "flagstone_grey": masonry_textures.GREY,
    "flagstone_red": masonry_textures.SANDSTONE,
}
_RUBBLES = {
    "rubble": ground_textures.DUSTY,
    "rubble_brick": ground_textures.BROKEN_BRICK,
    "rubble_concrete": ground_textures.CRUSHED_CONCRETE,
}
_GRASSES = {
    "grass": ground_textures.GRASS,
    "grass_lush": ground_textures.LUSH,
    "grass_dry": ground_textures.DRY,
    "grass_verge": ground_textures.VERGE,
    "lawn": ground_textures.LAWN,
    "meadow": ground_textures.MEADOW,
}
_ROWS = {"soil_ploughed": ground_textures.FURROWS, "crop_rows": ground_textures.SOWN}
_HEDGES = {"hedge_privet": hedge_textures.PRIVET, "hedge_beech": hedge_textures.BEECH}
_TILES = {
    "roof_tiles_red": covering_textures.RED_TILES,
    "roof_tiles_brown": covering_textures.BROWN_TILES,
    "roof_tiles_grey": covering_textures.GREY_TILES,
    "roof_tiles_weathered": covering_textures.WEATHERED_TILES,
}
_PAINTS = {
    "marking_white": road_textures.WHITE_PAINT,
    "marking_yellow": road_textures.YELLOW_PAINT,
}


def _shining(candelas: float, tint: Colour) -> Colour:
    """Emission of a mean luminance in cd/m²; an emission of 1 is 20 kcd/m² (docs/render.md)."""
    luminance = 0.2126 * tint[0] + 0.7152 * tint[1] + 0.0722 * tint[2]
    red, green, blue = (candelas / 20_000.0 / luminance * part for part in tint)
    return red, green, blue


_ROOM, _DRAPED = _shining(5.0, (1.0, 0.58, 0.25)), _shining(2.5, (1.0, 0.53, 0.20))
"""A lit room has 30 lx on walls of 0.5 in the evening; a net halves it."""
_DISPLAY = _shining(6.0, (1.0, 0.88, 0.69))
"""A display window after hours: 100 lx on goods of 0.2."""
ROOMS: dict[str, tuple[str, Colour]] = {
    "glass_dim": ("glass_draped", _shining(0.8, (1.0, 0.45, 0.13))),
    "glass_cool": ("glass_lit", _shining(4.0, (1.0, 0.95, 0.95))),
}
"""Other lamps behind the panes of a material: its name, and what they emit. One warm lamp behind
drawn curtains; cool tubes."""

TEXTURED: dict[str, Textured] = {
    **_family(road_textures.asphalt, 0.90, _ASPHALTS),
    **_family(covering_textures.bark, 0.95, covering_textures.BARKS),
    **_alone(0.90, "bitumen", covering_textures.bitumen),
    **_family(brick_textures.brick, 0.88, _BRICKS),
    **_alone(0.04, "car_cabin", cabin_texture.car_cabin),
    **_alone(0.80, "cobble", masonry_textures.cobble),
    **_alone(0.85, "concrete", masonry_textures.concrete),
    **_family(masonry_textures.kerb, 0.80, _KERBS),
    **_family(masonry_textures.flagstone, 0.88, _STONES),
    **_alone(0.70, "flowers", flower_textures.flowers),
    **_alone(0.97, "forest_floor", ground_textures.forest_floor),
    "glass_lit": Textured(pane_textures.lit_room, 0.06, "glass_lit", _ROOM),
    "glass_shop": Textured(pane_textures.shop, 0.06, "glass_shop", _DISPLAY),
    "glass_draped": Textured(pane_textures.draped, 0.06, "glass_draped", _DRAPED),
    **_each(ground_textures.grass, 0.95, _GRASSES),
    **_each(ground_textures.rows, 0.97, _ROWS),
    **_alone(0.95, "gravel", ground_textures.gravel),
    **_each(hedge_textures.hedge, 0.75, _HEDGES),
    **_alone(0.75, "leaves", foliage_textures.leaves),
    **_alone(0.80, "leaves_autumn", foliage_textures.leaves_autumn),
    **_alone(0.70, "leaves_evergreen", foliage_textures.leaves_evergreen),
    **_family(road_textures.marking, 0.75, _PAINTS),
    **_alone(0.80, "needles", foliage_textures.needles),
    **_each(masonry_textures.paving, 0.85, _PAVINGS),
    **_family(masonry_textures.plaster, 0.92, masonry_textures.PLASTERS),
    **_alone(0.95, "render_cast", masonry_textures.rough_cast),
    **_alone(0.92, "roof_shingles", covering_textures.roof_shingles),
    **_alone(0.65, "roof_slate", covering_textures.roof_slate),
    **_family(covering_textures.roof_tiles, 0.85, _TILES),
    **_family(ground_textures.rubble, 0.95, _RUBBLES),
    **_family(covering_textures.sheet_metal, 0.50, covering_textures.SHEETS),
    **_alone(0.45, "sheet_metal_roof", covering_textures.sheet_metal_roof),
    **_alone(0.97, "soil", ground_textures.soil),
    **_alone(0.90, "stone", masonry_textures.ashlar),
    **_alone(0.90, "twigs", foliage_textures.twigs),
    **_alone(0.80, "wood", covering_textures.wood),
}
"""How each textured material is made."""

_LOOSE = Pattern(patch=0.5, turn=180.0)
_ROAD = Pattern(patch=0.5, turn=180.0, lanes=0.6, stains=0.6)
_WALL = Pattern(foot=0.8, streaks=0.7, tinted=True)
PATTERNS: dict[str, Pattern] = {
    "asphalt": _ROAD,
    "asphalt_fresh": replace(_ROAD, lanes=0.25, stains=0.35),
    "asphalt_worn": replace(_ROAD, lanes=0.8, stains=0.8),
    "asphalt_old": replace(_ROAD, lanes=0.9, stains=0.9),
    "asphalt_patched": replace(_ROAD, lanes=1.0, stains=0.8),
    "paving_asphalt": replace(_ROAD, lanes=0.0, stains=0.8),
    "marking_white": replace(_ROAD, lanes=0.5, stains=0.4, paint=0.6),
    "grass": _LOOSE,
    "grass_lush": _LOOSE,
    "grass_dry": _LOOSE,
    "grass_verge": _LOOSE,
    "lawn": _LOOSE,
    "meadow": _LOOSE,
    "gravel": replace(_LOOSE, stains=0.5),
    "rubble": replace(_LOOSE, stains=0.7),
    "forest_floor": _LOOSE,
    "soil": _LOOSE,
    "soil_ploughed": Pattern(0.5, unit=(1 / 16, 1 / 7)),
    "crop_rows": Pattern(0.5, unit=(1 / 16, 1 / 5)),
    "paving": Pattern(0.25, unit=(1 / 6, 1 / 8), bond=0.5, stains=0.9),
    "paving_setts": Pattern(0.25, unit=(1 / 20, 1 / 40), bond=0.5, stains=0.7),
    "paving_pale": Pattern(0.25, unit=(1 / 8, 1 / 8), bond=0.5, stains=0.9),
    "cobble": replace(_ROAD, lanes=0.2, stains=0.8),
    "curb_stone": Pattern(0.5, unit=(1 / 2, 1.0), stains=0.7),
    "brick_red": replace(_WALL, patch=0.25, unit=(1 / 16, 1 / 48), bond=0.5),
    "plaster": replace(_WALL, patch=0.5, foot=1.0, streaks=0.9),
    "render_cast": replace(_WALL, patch=0.5, turn=180.0, foot=1.0, streaks=0.9),
    "flagstone": _WALL,
    "stone": replace(_WALL, patch=0.25, unit=(1 / 6, 1 / 12), bond=0.5),
    "concrete": replace(_WALL, tinted=False),
    "sheet_metal": replace(_WALL, foot=0.5, patch=0.5, unit=(1 / 10, 1.0)),
    "roof_tiles_red": Pattern(0.5, unit=(1 / 10, 1 / 6), tinted=True),
    "roof_slate": Pattern(0.5, unit=(1 / 8, 1 / 10), bond=0.5, tinted=True),
    "roof_shingles": Pattern(0.5, unit=(1 / 6, 1 / 14), bond=0.5, tinted=True),
    "wood": replace(_WALL, foot=0.4, streaks=0.5),
}
"""Texture bombing and wear by material; others have those of the material of their relief."""

_GLOBE = (0.20, 0.14, 0.075)
"""Luminance of a lamp's globe: 3 kcd/m²."""

_VEHICLES = (
    MaterialLook("car_white", (0.68, 0.68, 0.67), roughness=0.12),
    MaterialLook("car_silver", (0.42, 0.43, 0.44), roughness=0.25, metallic=0.45),
    MaterialLook("car_grey", (0.085, 0.090, 0.097), roughness=0.16, metallic=0.25),
    MaterialLook("car_black", (0.008, 0.008, 0.009), roughness=0.10),
    MaterialLook("car_blue", (0.012, 0.035, 0.125), roughness=0.14, metallic=0.2),
    MaterialLook("car_red", (0.250, 0.009, 0.010), roughness=0.12),
    MaterialLook("car_green", (0.014, 0.055, 0.035), roughness=0.14, metallic=0.15),
    MaterialLook("car_beige", (0.300, 0.250, 0.180), roughness=0.18, metallic=0.2),
    MaterialLook("car_brown", (0.060, 0.034, 0.020), roughness=0.16, metallic=0.25),
    MaterialLook("car_yellow", (0.620, 0.400, 0.030), roughness=0.12),
    MaterialLook("car_ivory", (0.680, 0.600, 0.410), roughness=0.14),
    MaterialLook("car_police", (0.006, 0.045, 0.230), roughness=0.14),
    MaterialLook("lens_blue", (0.006, 0.030, 0.200), roughness=0.12),
    MaterialLook("car_glass", (0.012, 0.014, 0.015), roughness=0.04, specular=1.52),
    MaterialLook("car_trim", (0.010, 0.010, 0.010), roughness=0.22),
    MaterialLook("car_plastic", (0.022, 0.022, 0.023), roughness=0.60),
    MaterialLook("car_underbody", (0.006, 0.006, 0.006), roughness=0.95),
    MaterialLook("car_tyre", (0.018, 0.018, 0.018), roughness=0.85),
    MaterialLook("car_rim", (0.36, 0.36, 0.37), roughness=0.32, metallic=0.6),
    MaterialLook("lens_housing", (0.030, 0.032, 0.035), roughness=0.06),
    MaterialLook("lens_clear", (0.52, 0.53, 0.54), roughness=0.12, metallic=0.5),
    MaterialLook("lens_clear_lit", (0.60, 0.60, 0.60), roughness=0.10, emission=(1.3, 1.25, 1.15)),
    MaterialLook(
        "lens_tail_lit", (0.25, 0.012, 0.01), roughness=0.15, emission=(0.15, 0.0001, 0.00005)
    ),
)
"""Paints and parts of vehicles.

A head lamp on low beam has some 500 cd towards the eye from 200 cm², a tail lamp 4 to 17 cd (UN
Regulation 7) from 150 cm².
"""

# A lit lens: 6 to 7 kcd/m², 200 cd from 200 mm (EN 12368, class 2/1); an unlit one is dark.
UNIFORM = (
    MaterialLook("glass", (0.028, 0.034, 0.038), roughness=0.06, specular=1.52),
    MaterialLook("lamp", (0.80, 0.78, 0.72), roughness=0.35, emission=_GLOBE),
    MaterialLook("lens_amber", (0.13, 0.055, 0.006), roughness=0.25),
    MaterialLook("lens_green", (0.01, 0.07, 0.035), roughness=0.25),
    MaterialLook("lens_red", (0.10, 0.008, 0.006), roughness=0.25),
    MaterialLook("lens_amber_lit", (0.32, 0.14, 0.01), roughness=0.25, emission=(0.75, 0.24, 0.0)),
    MaterialLook("lens_green_lit", (0.02, 0.20, 0.09), roughness=0.25, emission=(0.0, 0.42, 0.24)),
    MaterialLook("lens_red_lit", (0.30, 0.02, 0.015), roughness=0.25, emission=(1.35, 0.03, 0.01)),
    MaterialLook("cardboard", (0.330, 0.215, 0.120), roughness=0.90),
    *_VEHICLES,
    MaterialLook("metal_cast", (0.065, 0.062, 0.058), roughness=0.55),
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
    MaterialLook("terracotta", (0.330, 0.135, 0.075), roughness=0.85),
    MaterialLook("water", (0.012, 0.020, 0.019), roughness=0.05, specular=1.33),
    MaterialLook("trim_stone", (0.330, 0.305, 0.260), roughness=0.90),
    MaterialLook("paint_yellow", (0.58, 0.36, 0.02), roughness=0.45),
)
"""Materials of uniform colour."""

CLOTHING = (
    *(
        MaterialLook(f"cloth_{name}", colour, roughness=0.92)
        for name, colour in {
            "black": (0.018, 0.018, 0.020),
            "charcoal": (0.045, 0.046, 0.050),
            "grey": (0.135, 0.138, 0.145),
            "pale": (0.330, 0.325, 0.310),
            "white": (0.600, 0.595, 0.575),
            "navy": (0.017, 0.022, 0.046),
            "denim": (0.042, 0.066, 0.118),
            "faded": (0.125, 0.180, 0.255),
            "sky": (0.230, 0.320, 0.440),
            "olive": (0.062, 0.066, 0.040),
            "beige": (0.330, 0.265, 0.180),
            "brown": (0.078, 0.050, 0.033),
            "red": (0.200, 0.024, 0.026),
            "wine": (0.068, 0.014, 0.022),
            "teal": (0.026, 0.062, 0.062),
        }.items()
    ),
    *(
        MaterialLook(f"skin_{name}", colour, roughness=0.55)
        for name, colour in {
            "light": (0.480, 0.300, 0.220),
            "tan": (0.340, 0.195, 0.130),
            "brown": (0.160, 0.085, 0.052),
            "dark": (0.068, 0.038, 0.026),
        }.items()
    ),
    *(
        MaterialLook(f"hair_{name}", colour, roughness=0.60)
        for name, colour in {
            "black": (0.012, 0.011, 0.010),
            "brown": (0.048, 0.028, 0.017),
            "blond": (0.230, 0.150, 0.075),
            "grey": (0.260, 0.255, 0.245),
        }.items()
    ),
    MaterialLook("leather_black", (0.020, 0.019, 0.018), roughness=0.45),
    MaterialLook("leather_brown", (0.085, 0.045, 0.024), roughness=0.50),
    MaterialLook("headlamp_clear", (0.42, 0.43, 0.44), roughness=0.10),
    MaterialLook("rubber", (0.022, 0.022, 0.023), roughness=0.80),
)
"""Cloth, skin, hair, leather, and what two-wheelers need beside the paints."""


def make_texture(name: str) -> Texture:
    """The texture of a material; materials with one relief have the same structure."""
    made = TEXTURED[name]
    return made.recipe(generator(0, "texture", made.relief))


def textured_look(name: str, texture: Texture) -> MaterialLook:
    """The material of a texture."""
    flags = {
        "normal": texture.height is not None,
        "roughness": texture.roughness is not None,
        "opacity": texture.opacity is not None,
        "emission": texture.glow is not None,
    }
    return MaterialLook(
        name,
        roughness=TEXTURED[name].roughness,
        emission=_brightest(TEXTURED[name].emission, texture.glow),
        texture=name,
        relief=TEXTURED[name].relief,
        size=texture.size,
        maps=tuple(flag for flag, given in flags.items() if given),
        cut_out=0.0 if texture.opacity is None else _threshold(texture.opacity),
        pattern=PATTERNS.get(name, PATTERNS.get(TEXTURED[name].relief, Pattern())),
    )


def room_looks(name: str, texture: Texture) -> tuple[MaterialLook, ...]:
    """The materials that show a texture of panes by other lamps."""
    look = textured_look(name, texture)
    return tuple(
        replace(look, name=room, emission=_brightest(emission, texture.glow))
        for room, (panes, emission) in ROOMS.items()
        if panes == name
    )


def _threshold(opacity: FloatArray) -> float:
    """Opacity that a share of the pixels as large as the mean opacity reaches."""
    return round(float(np.clip(np.quantile(opacity, 1.0 - opacity.mean()), 0.1, 0.9)), 2)


def _brightest(mean: Colour, glow: FloatArray | None) -> Colour:
    """Radiance of the brightest texel of a texture with a mean radiance."""
    if glow is None:
        return mean
    factor = float(glow.max() / glow.mean())
    return mean[0] * factor, mean[1] * factor, mean[2] * factor

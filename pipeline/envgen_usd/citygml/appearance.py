"""Surface materials as an appearance: an X3DMaterial for each material of a feature."""

from collections.abc import Iterator

from envgen_usd.models.city_model import CityObject, ThematicSurface

THEME = "material"
"""Theme of the appearance; each X3DMaterial has the name of its library material."""
_COLOURS = {
    "asphalt": (0.34, 0.34, 0.34),
    "asphalt_fresh": (0.27, 0.27, 0.27),
    "asphalt_old": (0.43, 0.42, 0.41),
    "asphalt_patched": (0.36, 0.36, 0.35),
    "asphalt_worn": (0.40, 0.39, 0.38),
    "bitumen": (0.30, 0.30, 0.30),
    "brick_brown": (0.51, 0.44, 0.39),
    "brick_orange": (0.64, 0.49, 0.41),
    "brick_painted": (0.84, 0.84, 0.82),
    "brick_red": (0.57, 0.43, 0.38),
    "brick_sooted": (0.33, 0.29, 0.27),
    "brick_yellow": (0.66, 0.61, 0.52),
    "cobble": (0.53, 0.51, 0.49),
    "concrete": (0.60, 0.59, 0.58),
    "crop_rows": (0.28, 0.29, 0.19),
    "curb_concrete": (0.45, 0.44, 0.43),
    "curb_stone": (0.51, 0.50, 0.50),
    "flagstone": (0.57, 0.54, 0.50),
    "flagstone_grey": (0.54, 0.54, 0.53),
    "flagstone_red": (0.59, 0.50, 0.44),
    "forest_floor": (0.28, 0.30, 0.18),
    "glass": (0.40, 0.50, 0.58),
    "grass": (0.32, 0.37, 0.22),
    "grass_dry": (0.39, 0.39, 0.26),
    "grass_lush": (0.27, 0.36, 0.18),
    "grass_verge": (0.32, 0.35, 0.22),
    "gravel": (0.51, 0.49, 0.47),
    "hedge_beech": (0.36, 0.32, 0.24),
    "hedge_privet": (0.29, 0.33, 0.22),
    "lawn": (0.30, 0.37, 0.21),
    "marking_white": (0.77, 0.77, 0.75),
    "marking_yellow": (0.75, 0.60, 0.22),
    "meadow": (0.38, 0.40, 0.25),
    "metal_dark": (0.23, 0.24, 0.24),
    "paving": (0.46, 0.45, 0.44),
    "paving_asphalt": (0.33, 0.33, 0.32),
    "paving_pale": (0.57, 0.56, 0.54),
    "paving_setts": (0.40, 0.40, 0.39),
    "plaster": (0.78, 0.77, 0.72),
    "plaster_blue": (0.66, 0.70, 0.74),
    "plaster_cream": (0.81, 0.76, 0.67),
    "plaster_green": (0.64, 0.67, 0.60),
    "plaster_grey": (0.59, 0.59, 0.59),
    "plaster_ochre": (0.72, 0.63, 0.46),
    "plaster_pink": (0.74, 0.63, 0.58),
    "plaster_white": (0.86, 0.86, 0.84),
    "render_cast": (0.70, 0.68, 0.64),
    "roof_shingles": (0.38, 0.34, 0.31),
    "roof_slate": (0.31, 0.32, 0.34),
    "roof_tiles_brown": (0.40, 0.32, 0.28),
    "roof_tiles_grey": (0.38, 0.38, 0.39),
    "roof_tiles_red": (0.53, 0.35, 0.27),
    "roof_tiles_weathered": (0.47, 0.38, 0.31),
    "rubble": (0.48, 0.45, 0.42),
    "rubble_brick": (0.50, 0.42, 0.37),
    "rubble_concrete": (0.55, 0.55, 0.53),
    "sheet_metal": (0.63, 0.65, 0.66),
    "sheet_metal_blue": (0.32, 0.40, 0.51),
    "sheet_metal_green": (0.35, 0.45, 0.40),
    "sheet_metal_roof": (0.50, 0.51, 0.52),
    "sheet_metal_white": (0.76, 0.76, 0.75),
    "soil": (0.345, 0.302, 0.255),
    "soil_ploughed": (0.31, 0.27, 0.23),
    "stone": (0.58, 0.56, 0.51),
    "water": (0.12, 0.16, 0.15),
    "wood": (0.46, 0.35, 0.26),
}
"""Mean colour (sRGB) of each material, for viewers without the asset library."""
_UNKNOWN = (0.8, 0.8, 0.8)
_TAGS = ("appearance", "app:surfaceData")


def appearance_text(feature: CityObject, *, old: bool = False) -> str:
    """Returns the ``appearance`` property of a top-level feature; empty without materials.

    Args:
        feature: Top-level feature with its parts.
        old: True for CityGML 2.0, whose properties have other names.
    """
    targets: dict[str, list[str]] = {}
    for part in feature.walk():
        for surface in _with_openings(part.surfaces):
            if surface.material:
                targets.setdefault(surface.material, []).append(surface.id)
    if not targets:
        return ""
    tag, member = ("app:appearance", "app:surfaceDataMember") if old else _TAGS
    data = "".join(f"<{member}>{_material(name, ids)}</{member}>" for name, ids in targets.items())
    return f"<{tag}><app:Appearance><app:theme>{THEME}</app:theme>{data}</app:Appearance></{tag}>"


def _with_openings(surfaces: tuple[ThematicSurface, ...]) -> Iterator[ThematicSurface]:
    for surface in surfaces:
        yield surface
        yield from _with_openings(surface.openings)


def _material(name: str, ids: list[str]) -> str:
    red, green, blue = _COLOURS.get(name, _UNKNOWN)
    targets = "".join(f"<app:target>#{surface}.ms</app:target>" for surface in ids)
    return (
        f"<app:X3DMaterial><gml:name>{name}</gml:name>"
        f"<app:diffuseColor>{red} {green} {blue}</app:diffuseColor>{targets}</app:X3DMaterial>"
    )

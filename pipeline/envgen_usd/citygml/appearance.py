"""Surface materials as an appearance: an X3DMaterial for each material of a feature."""

from collections.abc import Iterator

from envgen_usd.models.city_model import CityObject, ThematicSurface

THEME = "material"
"""Theme of the appearance; each X3DMaterial has the name of its library material."""
_COLOURS = {
    "asphalt": (0.22, 0.22, 0.23),
    "asphalt_worn": (0.30, 0.30, 0.30),
    "bitumen": (0.20, 0.20, 0.21),
    "brick_red": (0.55, 0.25, 0.19),
    "concrete": (0.62, 0.62, 0.60),
    "curb_stone": (0.58, 0.57, 0.55),
    "flagstone": (0.60, 0.55, 0.46),
    "forest_floor": (0.29, 0.25, 0.16),
    "glass": (0.40, 0.50, 0.58),
    "grass": (0.31, 0.43, 0.20),
    "grass_verge": (0.38, 0.46, 0.24),
    "gravel": (0.52, 0.50, 0.47),
    "lawn": (0.27, 0.46, 0.19),
    "marking_white": (0.92, 0.92, 0.90),
    "marking_yellow": (0.90, 0.72, 0.15),
    "metal_dark": (0.16, 0.17, 0.18),
    "paving": (0.60, 0.59, 0.57),
    "plaster": (0.84, 0.81, 0.74),
    "roof_shingles": (0.33, 0.29, 0.27),
    "roof_slate": (0.26, 0.28, 0.31),
    "roof_tiles_red": (0.60, 0.27, 0.20),
    "rubble": (0.48, 0.45, 0.41),
    "sheet_metal": (0.66, 0.69, 0.72),
    "sheet_metal_roof": (0.52, 0.55, 0.58),
    "wood": (0.43, 0.30, 0.19),
}
"""Mean linear colour of each material, for viewers without the asset library."""
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

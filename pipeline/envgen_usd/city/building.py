"""One building as a CityGML feature, in any level of detail."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from envgen_usd.city.design import Design
from envgen_usd.city.faces import Face
from envgen_usd.city.garage import make_garage
from envgen_usd.city.installations import make_installations
from envgen_usd.city.interior import make_rooms
from envgen_usd.city.levels import FINEST, Level
from envgen_usd.city.outline import blocks, footprint
from envgen_usd.city.shell import build_shell
from envgen_usd.city.surfaces import Site, SurfaceMaker
from envgen_usd.models.city import Attribute, CityObject
from envgen_usd.models.polygons import Polygons

_BELOW_GROUND = 0.5
"""How far the foundation reaches below the lowest ground, metres."""
# SIG3D code lists _AbstractBuilding_roofType, ..._class and ..._function.
_ROOF_TYPES = {
    "flat": "1000",
    "shed": "1010",
    "gabled": "1030",
    "hipped": "1040",
    "mansard": "1060",
    "pyramidal": "1070",
    "sawtooth": "1100",
    "barrel": "1110",
}
_CLASSES = {"residential": "1000", "industrial": "1160"}
_FUNCTIONS = {"residential": "1000", "industrial": "1310"}
_CONCRETE = frozenset(("coping", "steps", "balcony", "ground"))


@dataclass(frozen=True)
class Modelling:
    """How a building is modelled.

    Attributes:
        level: The finest level.
        lower: True if footprint (LoD0) and block (LoD1) are there besides.
        lod1_top: Height of the block as a share of the roof, 0 at the eaves, 1 at the ridge.
        rooms: True if storeys are there as rooms.
    """

    level: Level = FINEST
    lower: bool = True
    lod1_top: float = 0.5
    rooms: bool = False


FINEST_MODELLING = Modelling()
"""All of LoD3.3, with footprint and block."""


def make_building(
    name: str, design: Design, site: Site, modelling: Modelling = FINEST_MODELLING
) -> CityObject:
    """Returns a building; from LoD2 on its surfaces form a closed solid.

    The floor lies a plinth above the highest ground under the footprint, and the walls reach
    below the lowest, so that nothing floats and no door is buried.

    Args:
        name: gml:id; the ids of its parts and surfaces begin with it.
        design: What it looks like.
        site: Where it stands.
        modelling: Levels of detail.
    """
    level = modelling.level
    floor = round(site.highest + design.plinth, 3)
    base = site.lowest - _BELOW_GROUND - floor
    shown = level.simplify(design)
    maker = SurfaceMaker(name, site, floor, level.lod, _materials(design), shown.extras.embrasure)
    geometry = _lower_levels(design, base, maker, modelling)
    attributes: dict[str, Attribute] = {
        "class": _CLASSES[design.function],
        "function": _FUNCTIONS[design.function],
        "roofType": _ROOF_TYPES[design.roof],
        "storeysAboveGround": design.storeys,
        "floorHeight": floor,
        "style": design.style,
    }
    if level.lod < 2:
        return CityObject(name, "Building", attributes, geometry=geometry)
    shell = build_shell(shown, base, level.openings)
    shown = shell.design
    attributes["height"] = round(shell.top - base, 3)
    children = make_installations(maker, shown, base) if level.fine else ()
    if modelling.rooms:
        children = (*children, *make_rooms(maker, shown))
    if shown.extras.garage:
        children = (*children, _garage(maker, shown, base, level))
    return CityObject(
        id=name,
        kind="Building",
        attributes=attributes,
        surfaces=maker.surfaces(_shown(shell.faces, level)),
        solid_lod=level.lod,
        geometry=geometry,
        children=children,
    )


def _lower_levels(
    design: Design, base: float, maker: SurfaceMaker, modelling: Modelling
) -> dict[str, Polygons]:
    """Footprint and block, as far as they are wanted."""
    level, lower = modelling.level, modelling.lower
    plain = level.simplify(design)
    found: dict[str, Polygons] = {}
    wants_block = (lower and level.lod > 0) or level.lod == 1
    outline = footprint(plain, 0.0) if lower or level.lod < 2 else []
    if lower or level.lod == 0:
        rings = [outline]
        if level.lod == 0 and level.heights:
            rings.append(footprint(plain, design.eaves, design.overhang))
        found["lod0MultiSurface"] = maker.polygons(rings)
    if wants_block:
        own_heights = level.lod == 1 and level.heights
        faces = blocks(plain, outline, base, modelling.lod1_top, own_heights)
        found["lod1Solid"] = maker.polygons([face.ring for face in faces])
    return found


def _shown(faces: list[Face], level: Level) -> list[Face]:
    """Faces with those openings that the level has."""

    def has_openings(face: Face) -> bool:
        on_roof = face.kind == "RoofSurface" or face.part == "dormer"
        return level.roof_openings if on_roof else level.openings

    return [
        replace(face, openings=[]) if face.openings and not has_openings(face) else face
        for face in faces
    ]


def _garage(maker: SurfaceMaker, design: Design, base: float, level: Level) -> CityObject:
    own = SurfaceMaker(
        f"{maker.name}_garage", maker.site, maker.floor, maker.lod, maker.material, maker.embrasure
    )
    faces = _shown(make_garage(design, base), level)
    return CityObject(
        id=own.name,
        kind="BuildingPart",
        attributes={"function": "1000", "roofType": _ROOF_TYPES["flat"], "storeysAboveGround": 1},
        surfaces=own.surfaces(faces),
        solid_lod=level.lod,
    )


def _materials(design: Design) -> Callable[[str, str], str]:
    """Function that says what a face is made of, by its class and part."""
    doors = "sheet_metal" if design.style == "hall" else "wood"
    soffit = design.wall_material if design.style == "hall" else "wood"

    by_part = {
        **dict.fromkeys(_CONCRETE, "concrete"),
        "porch": "metal_dark" if design.style == "hall" else "wood",
        "riser": "glass",
        "room": "plaster",
    }
    by_kind = {
        "WindowSurface": "glass",
        "DoorSurface": doors,
        "RoofSurface": design.roof_material,
        "OuterCeilingSurface": soffit,
    }

    def material(kind: str, part: str) -> str:
        if part == "chimney" and kind == "RoofSurface":
            return "concrete"
        return by_part.get(part) or by_kind.get(kind, design.wall_material)

    return material

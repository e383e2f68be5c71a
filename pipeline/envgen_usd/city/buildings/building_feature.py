"""A building as a CityGML feature, in any level of detail."""

from collections.abc import Callable
from dataclasses import replace

from envgen_usd.city.buildings.building_design import Design
from envgen_usd.city.buildings.building_faces import Face
from envgen_usd.city.buildings.building_outline import blocks, footprint
from envgen_usd.city.buildings.building_shell import build_shell
from envgen_usd.city.buildings.facade_fixtures import make_fittings
from envgen_usd.city.buildings.garages import make_garage
from envgen_usd.city.buildings.installations import make_installations
from envgen_usd.city.buildings.level_of_detail import FINEST_MODELLING, Level, Modelling
from envgen_usd.city.buildings.rooms import make_rooms
from envgen_usd.city.buildings.thematic_surfaces import Site, SurfaceMaker
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.polygon_arrays import Polygons

BELOW_GROUND = 0.5
"""Depth of the foundation below the lowest ground, metres; a larger value deepens foundations."""
# SIG3D code lists _AbstractBuilding_roofType, ..._class and ..._function.
ROOF_TYPES = {
    "flat": "1000",
    "shed": "1010",
    "gabled": "1030",
    "hipped": "1040",
    "mansard": "1060",
    "pyramidal": "1070",
    "dome": "1090",
    "onion": "1090",
    "sawtooth": "1100",
    "barrel": "1110",
}
"""Code of each kind of roof."""
CLASSES = {
    "residential": "1000",
    "industrial": "1160",
    "school": "1100",
    "shop": "1030",
    "garages": "1170",
    "barn": "1090",
}
"""Code of a building's class by its function."""
FUNCTIONS = {
    "residential": "1000",
    "industrial": "1310",
    "school": "2080",
    "shop": "1150",
    "garages": "1630",
}
"""Code of a building's function; barns have a class alone."""
_CONCRETE = frozenset(("coping", "steps", "balcony", "ground"))


def use_codes(design: Design) -> dict[str, Attribute]:
    """Class and function of a building, as attributes."""
    codes = {"class": CLASSES.get(design.function), "function": FUNCTIONS.get(design.function)}
    return {name: code for name, code in codes.items() if code is not None}


def floor_and_base(design: Design, site: Site) -> tuple[float, float]:
    """Height of the floor in the road frame, and of the underside above the floor, metres."""
    floor = round(site.highest + design.plinth + design.raised, 3)
    return floor, 0.0 if design.raised else site.lowest - BELOW_GROUND - floor


def with_soffit(faces: list[Face], design: Design) -> list[Face]:
    """Faces whose ground is a ceiling over the open, where the building is raised."""
    if not design.raised:
        return faces
    return [
        replace(face, kind="OuterCeilingSurface") if face.kind == "GroundSurface" else face
        for face in faces
    ]


def make_building(
    name: str, design: Design, site: Site, modelling: Modelling = FINEST_MODELLING
) -> tuple[CityObject, tuple[str, ...]]:
    """Returns a building, and what of its design had no room (see `Shell`).

    From LoD2 on its surfaces form a closed solid.

    The floor lies a plinth above the highest ground under the footprint, and the walls reach below
    the lowest ground. So no building floats, and no door is buried.

    Args:
        name: gml:id; the ids of its parts and surfaces begin with it.
        design: Design of the building.
        site: Position and ground heights of the building.
        modelling: Levels of detail.
    """
    level = modelling.level
    floor, base = floor_and_base(design, site)
    shown = level.simplify(design)
    maker = SurfaceMaker(name, site, floor, level.lod, material_of(design), shown.extras.embrasure)
    geometry = _lower_levels(design, base, maker, modelling)
    attributes: dict[str, Attribute] = {
        **use_codes(design),
        "roofType": ROOF_TYPES[design.roof],
        "storeysAboveGround": design.storeys,
        "floorHeight": floor,
        "style": design.style,
    }
    if level.lod < 2:
        return CityObject(name, "Building", attributes, geometry=geometry), ()
    shell = build_shell(shown, base, level.openings)
    shown = shell.design
    attributes["height"] = round(shell.top - base, 3)
    children = make_installations(maker, shown, base) if level.fine and not shown.raised else ()
    if level.fine:
        children = (*children, *make_fittings(maker, shell))
    if modelling.rooms:
        children = (*children, *make_rooms(maker, shown))
    if shown.extras.garage:
        children = (*children, _garage(maker, shown, base, level))
    building = CityObject(
        id=name,
        kind="Building",
        attributes=attributes,
        surfaces=maker.surfaces(with_soffit(_shown(shell.faces, level), shown)),
        solid_lod=level.lod,
        geometry=geometry,
        children=children,
    )
    return building, shell.left_out


def _lower_levels(
    design: Design, base: float, maker: SurfaceMaker, modelling: Modelling
) -> dict[str, Polygons]:
    """Footprint and block, if requested."""
    level, lower = modelling.level, modelling.lower
    plain = level.simplify(design)
    geometry: dict[str, Polygons] = {}
    wants_block = (lower and level.lod > 0) or level.lod == 1
    outline = footprint(plain, 0.0) if lower or level.lod < 2 else []
    if lower or level.lod == 0:
        rings = [outline]
        if level.lod == 0 and level.heights:
            rings.append(footprint(plain, design.eaves, design.overhang))
        geometry["lod0MultiSurface"] = maker.polygons(rings)
    if wants_block:
        own_heights = level.lod == 1 and level.heights
        faces = blocks(plain, outline, base, modelling.lod1_top, own_heights)
        geometry["lod1Solid"] = maker.polygons([face.ring for face in faces])
    return geometry


def _shown(faces: list[Face], level: Level) -> list[Face]:
    """Faces with the openings of the level."""

    def has_openings(face: Face) -> bool:
        on_roof = face.kind == "RoofSurface" or face.part == "dormer"
        return level.roof_openings if on_roof else level.openings

    return [
        replace(face, openings=[]) if face.openings and not has_openings(face) else face
        for face in faces
    ]


def _garage(maker: SurfaceMaker, design: Design, base: float, level: Level) -> CityObject:
    garage_maker = SurfaceMaker(
        f"{maker.name}_garage", maker.site, maker.floor, maker.lod, maker.material, maker.embrasure
    )
    faces = _shown(make_garage(design, base), level)
    return CityObject(
        id=garage_maker.name,
        kind="BuildingPart",
        attributes={"function": "1000", "roofType": ROOF_TYPES["flat"], "storeysAboveGround": 1},
        surfaces=garage_maker.surfaces(faces),
        solid_lod=level.lod,
    )


def material_of(design: Design) -> Callable[[str, str], str]:
    """Returns the function from class and part of a face to its material."""
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

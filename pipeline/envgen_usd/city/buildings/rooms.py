"""Rooms inside a building: a room for each storey of each part."""

from envgen_usd.city.buildings.building_design import Design
from envgen_usd.city.buildings.building_faces import Face, box
from envgen_usd.city.buildings.building_outline import parts_in_plan
from envgen_usd.city.buildings.thematic_surfaces import SurfaceMaker
from envgen_usd.models.city_model import CityObject

_WALL = 0.3
"""Thickness of outer walls, metres; half of it between two parts."""
_SLAB = 0.25
"""Thickness of floors, metres."""
_LEAST = 1.0
_KINDS = ("InteriorWallSurface",) * 4 + ("FloorSurface", "CeilingSurface")


def make_rooms(maker: SurfaceMaker, design: Design) -> tuple[CityObject, ...]:
    """Returns the rooms of a building as ``BuildingRoom``, each a closed solid.

    Args:
        maker: Builds the surfaces of the building.
        design: Design of the building; rooms end below the roof.
    """
    rooms = []
    for part, ((x0, y0, x1, y1), eaves) in enumerate(parts_in_plan(design)):
        if min(x1 - x0, y1 - y0) < 2 * _WALL + _LEAST:
            continue
        for storey in range(max(round(eaves / design.storey_height), 1)):
            low = storey * design.storey_height
            corner = (x0 + _WALL, y0 + _WALL, low)
            opposite = (x1 - _WALL, y1 - _WALL, low + design.storey_height - _SLAB)
            faces = [
                Face(kind, "room", face.ring)
                for kind, face in zip(_KINDS, box(corner, opposite, "", ""), strict=True)
            ]
            name = f"{maker.name}_room_{part}_{storey}"
            room_maker = SurfaceMaker(name, maker.site, maker.floor, maker.lod, maker.material)
            rooms.append(
                CityObject(
                    name,
                    "BuildingRoom",
                    {"storey": storey},
                    room_maker.surfaces(faces),
                    solid_lod=maker.lod,
                )
            )
    return tuple(rooms)

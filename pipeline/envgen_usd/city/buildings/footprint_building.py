"""A building over any footprint: straight walls like those of rows, and a flat or hipped roof."""

import numpy as np
import shapely

from envgen_usd.city.buildings.building_design import Design
from envgen_usd.city.buildings.building_feature import (
    BELOW_GROUND,
    CLASSES,
    FUNCTIONS,
    ROOF_TYPES,
    material_of,
)
from envgen_usd.city.buildings.footprint_roofs import flat_roof, level_face, sloped_roof
from envgen_usd.city.buildings.footprint_walls import Surroundings, make_wall_parts, walls_of
from envgen_usd.city.buildings.thematic_surfaces import Site, SurfaceMaker
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject

_PITCHED = frozenset({"gabled", "hipped", "pyramidal", "mansard", "shed", "barrel", "sawtooth"})
"""Roofs that become hipped over a footprint that is no rectangle."""


def make_footprint_building(
    name: str,
    design: Design,
    footprint: shapely.Polygon,
    ground: tuple[float, float],
    beside: Surroundings,
) -> CityObject:
    """Returns a building whose walls stand on a polygon, which may have courts.

    A pitched roof slopes up from all walls by the same angle, as far as its inner border keeps the
    corners of the footprint, and is level inside. Its top is flat where that leaves no height.
    Walls at streets look like houses of a row, each with a door.

    Args:
        name: gml:id; the ids of its surfaces begin with it.
        design: Figures and materials; width, depth and wings do not count.
        footprint: Outline of the walls, metres.
        ground: Lowest and highest ground below it, metres.
        beside: What it stands beside.
    """
    origin = np.floor(np.array(footprint.centroid.coords[0]))
    site = Site(origin, np.array([1.0, 0.0]), *ground)
    floor = round(ground[1] + design.plinth, 3)
    base = ground[0] - BELOW_GROUND - floor
    rings = _rings(footprint, origin)
    sloped = sloped_roof(rings, design.eaves, design.slope) if design.roof in _PITCHED else None
    if sloped is None:
        over, wall_top = flat_roof(rings, design.eaves, design.parapet)
        roof, top = "flat", wall_top
    else:
        over, top = sloped
        roof, wall_top = "hipped", design.eaves
    walls = walls_of(rings, origin, design, beside)
    faces = [wall.face(base, wall_top) for wall in walls]
    faces += [level_face(rings, base, "GroundSurface", "ground"), *over]
    maker = SurfaceMaker(name, site, floor, 3, material_of(design), design.extras.embrasure)
    attributes: dict[str, Attribute] = {
        "class": CLASSES[design.function],
        "function": FUNCTIONS[design.function],
        "roofType": ROOF_TYPES[roof],
        "storeysAboveGround": design.storeys,
        "floorHeight": floor,
        "style": design.style,
        "height": round(top - base, 3),
    }
    return CityObject(
        name,
        "Building",
        attributes,
        surfaces=maker.surfaces(faces),
        solid_lod=3,
        children=make_wall_parts(maker, walls, base, beside),
    )


def _rings(footprint: shapely.Polygon, origin: FloatArray) -> list[FloatArray]:
    """Rings of the footprint, with the building to the left, in its frame."""
    shape = shapely.orient_polygons(footprint)
    return [
        shapely.get_coordinates(ring)[:-1] - origin for ring in (shape.exterior, *shape.interiors)
    ]

"""A building over any footprint: straight walls like those of rows, and a flat or hipped roof."""

from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.city.buildings.building_design import Design
from envgen_usd.city.buildings.building_faces import Face
from envgen_usd.city.buildings.building_feature import (
    ROOF_TYPES,
    floor_and_base,
    material_of,
    use_codes,
    with_soffit,
)
from envgen_usd.city.buildings.building_outline import ridge_rise
from envgen_usd.city.buildings.footprint_roofs import (
    PROFILES,
    flat_roof,
    level_face,
    pointed_roof,
    sloped_roof,
)
from envgen_usd.city.buildings.footprint_walls import Surroundings, make_wall_parts, walls_of
from envgen_usd.city.buildings.thematic_surfaces import Site, SurfaceMaker
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject

_PITCHED = frozenset({"gabled", "hipped", "mansard", "shed", "barrel", "sawtooth", *PROFILES})
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
    corners of the footprint, and is level inside. Its top is flat where that leaves no height. A
    pyramidal roof, a dome or an onion ends in a point over the middle of the footprint, where all
    walls see it.
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
    floor, base = floor_and_base(design, site)
    rings = _rings(footprint, origin)
    roof, over, wall_top, top = _roof(rings, design)
    walls = walls_of(rings, origin, design, beside)
    faces = [wall.face(base, wall_top) for wall in walls]
    faces += [level_face(rings, base, "GroundSurface", "ground"), *over]
    maker = SurfaceMaker(name, site, floor, 3, material_of(design), design.extras.embrasure)
    attributes: dict[str, Attribute] = {
        **use_codes(design),
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
        surfaces=maker.surfaces(with_soffit(faces, design)),
        solid_lod=3,
        children=make_wall_parts(maker, walls, base, beside),
    )


def _roof(rings: list[FloatArray], design: Design) -> tuple[str, list[Face], float, float]:
    """Kind and faces of the roof, and the heights of the walls and of the top, metres."""
    if design.roof in PROFILES:
        rise = ridge_rise(replace(design, width=_width(rings), depth=_width(rings)))
        pointed = pointed_roof(rings, design.eaves, rise, PROFILES[design.roof])
        if pointed:
            return design.roof, pointed, design.eaves, design.eaves + rise
    sloped = sloped_roof(rings, design.eaves, design.slope) if design.roof in _PITCHED else None
    if sloped is None:
        over, top = flat_roof(rings, design.eaves, design.parapet)
        return "flat", over, top, top
    return "hipped", sloped[0], design.eaves, sloped[1]


def _width(rings: list[FloatArray]) -> float:
    """Least width of the footprint, metres."""
    box = shapely.minimum_rotated_rectangle(shapely.Polygon(rings[0]))
    sides = np.linalg.norm(np.diff(shapely.get_coordinates(box)[:3], axis=0), axis=1)
    return float(sides.min())


def _rings(footprint: shapely.Polygon, origin: FloatArray) -> list[FloatArray]:
    """Rings of the footprint, with the building to the left, in its frame."""
    shape = shapely.orient_polygons(footprint)
    return [
        shapely.get_coordinates(ring)[:-1] - origin for ring in (shape.exterior, *shape.interiors)
    ]

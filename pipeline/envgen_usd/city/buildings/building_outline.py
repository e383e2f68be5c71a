"""The outline of a building in plan, and the blocks of LoD1."""

import shapely

from envgen_usd.city.buildings.building_design import Design
from envgen_usd.city.buildings.building_faces import Face, Ring, box
from envgen_usd.city.buildings.building_shell import bay_place
from envgen_usd.city.buildings.footprint_roofs import PROFILES
from envgen_usd.city.buildings.shell_union import unite

Box = tuple[float, float, float, float]


def parts_in_plan(design: Design) -> list[tuple[Box, float]]:
    """Returns the rectangles (x0, y0, x1, y1) of the main part, wings and bay, with their eaves."""
    y0 = design.main_front
    y1 = y0 + design.main_depth
    parts = [((0.0, y0, design.width, y1), design.eaves)]
    for wing in design.extras.wings:
        low, high = (0.0, y0) if wing.front else (y1, y1 + wing.depth)
        rectangle = (wing.left, low, wing.left + wing.width, high)
        parts.append((rectangle, wing.storeys * design.storey_height))
    bay, place = design.extras.bay, bay_place(design)
    if bay is not None and place is not None:
        rectangle = (place[0], -bay.depth, place[1], 0.0)
        parts.append((rectangle, bay.storeys * design.storey_height))
    return parts


def footprint(design: Design, height: float, beyond: float = 0.0) -> Ring:
    """Returns the outline at a height, counter-clockwise from above.

    Args:
        design: Design of the building, without its garage.
        height: Height above the floor, metres.
        beyond: Offset of the outline outside the walls, metres.
    """
    boxes = [shapely.box(*rectangle) for rectangle, _ in parts_in_plan(design)]
    shape = boxes[0] if len(boxes) == 1 else shapely.union_all(boxes, grid_size=1e-3)
    if beyond > 0.0:
        shape = shape.buffer(beyond, join_style="mitre")
    ring = shapely.get_coordinates(shapely.simplify(shape, 1e-6).exterior.normalize())[:-1]
    # `normalize` runs clockwise.
    return [(x, y, height) for x, y in ring[::-1].tolist()]


def blocks(
    design: Design, outline: Ring, base: float, share: float, own_heights: bool
) -> list[Face]:
    """Returns the closed shell of LoD1.

    Args:
        design: Design of the building, without its garage.
        outline: Its footprint at any height.
        base: Height of its underside, metres.
        share: Height of the top as a share of the roof, from the eaves to the ridge.
        own_heights: True if every part has a separate top height.
    """
    rise = share * ridge_rise(design)
    plain = prism([(x, y, base) for x, y, _ in outline], design.eaves + rise)
    if not own_heights:
        return plain
    bodies = [
        box((x0, y0, base), (x1, y1, eaves + rise * eaves / design.eaves), "WallSurface", "wall")
        for (x0, y0, x1, y1), eaves in parts_in_plan(design)
    ]
    return unite(bodies) or plain


def ridge_rise(design: Design) -> float:
    """Returns the height of the ridge above the eaves for LoD1, metres."""
    if design.roof in ("flat", "sawtooth", "barrel"):
        return design.parapet
    span = design.width if design.ridge_to_street else design.main_depth
    if design.roof == "hipped" or design.roof in PROFILES:
        span = min(design.width, design.main_depth)
    return span * design.slope * (1.0 if design.roof == "shed" else 0.5)


def prism(floor: Ring, top: float) -> list[Face]:
    """Returns the closed shell between a horizontal polygon and a copy at another height."""
    head = [(x, y, top) for x, y, _ in floor]
    faces = [Face("GroundSurface", "ground", floor[::-1]), Face("RoofSurface", "flat", head)]
    for i, (a, c) in enumerate(zip(floor, head, strict=True)):
        b, d = floor[(i + 1) % len(floor)], head[(i + 1) % len(floor)]
        faces.append(Face("WallSurface", "wall", [a, b, d, c]))
    return faces

"""Balconies, steps and porches: outer installations of a building, each a closed body.

A joint separates them from the wall, as coordinates on the grid cannot touch it exactly.
"""

import math
from collections.abc import Iterator
from itertools import pairwise

from envgen_usd.city.buildings.building_design import JOINT, Design
from envgen_usd.city.buildings.building_faces import Face, Point, box
from envgen_usd.city.buildings.building_shell import taken
from envgen_usd.city.buildings.facades import Facade, Hole, lay_out
from envgen_usd.city.buildings.shell_union import unite
from envgen_usd.city.buildings.thematic_surfaces import SurfaceMaker
from envgen_usd.models.city_model import CityObject

_SLAB = 0.15
_RAIL = 1.0
_RAIL_THICKNESS = 0.08
BALCONY_DEPTH = 1.1
"""Depth of a balcony, metres."""
_RISER = 0.18
_TREAD = 0.28
PORCH_DEPTH = 1.2
"""Depth of a porch, metres."""
_POST = 0.12
_CANOPY = 0.12
"""Thickness of a canopy, and its distance above the door, metres."""
_BESIDE = 0.4


def balcony(left: float, right: float, wall: float, floor: float, out: float) -> list[Face]:
    """Returns a balcony: a slab with a solid balustrade on three sides.

    Args:
        left: Left end along the wall, metres.
        right: Right end along the wall, metres, larger than `left`.
        wall: y of its wall, metres.
        floor: Height of its floor, metres.
        out: -1 on the street side, 1 on the other side.
    """
    depth, t = BALCONY_DEPTH, _RAIL_THICKNESS
    low, top = floor - _SLAB, floor + _RAIL

    def at(a: float, d: float, z: float) -> Point:
        """Point as seen from outside: `a` to the right, `d` out of the wall."""
        return (left + a, wall - d, z) if out < 0 else (right - a, wall + d, z)

    w = right - left
    outer = [(0.0, 0.0), (0.0, depth), (w, depth), (w, 0.0)]
    inner = [(t, 0.0), (t, depth - t), (w - t, depth - t), (w - t, 0.0)]
    faces = [
        Face("OuterFloorSurface", "balcony", [at(*p, floor) for p in inner]),
        Face("OuterCeilingSurface", "balcony", [at(*p, low) for p in outer[::-1]]),
        Face("WallSurface", "balcony", [at(*p, top) for p in (*outer, *inner[::-1])]),
    ]
    for (a, b), (c, d) in zip(pairwise(outer), pairwise(inner), strict=True):
        faces.append(
            Face("WallSurface", "balcony", [at(*a, low), at(*b, low), at(*b, top), at(*a, top)])
        )
        faces.append(
            Face("WallSurface", "balcony", [at(*d, floor), at(*c, floor), at(*c, top), at(*d, top)])
        )
    back = [(0.0, low), (0.0, top), (t, top), (t, floor), (w - t, floor), (w - t, top), (w, top)]
    faces.append(Face("WallSurface", "balcony", [at(a, 0.0, z) for a, z in (*back, (w, low))]))
    return faces


def steps(door: Hole, wall: float, ground: float, base: float) -> list[Face]:
    """Returns steps from the ground up to a door, or an empty list for a level door.

    Args:
        door: Opening of the door.
        wall: y of its wall, metres.
        ground: Height of the ground before it, relative to the floor (mostly negative), metres.
        base: Height of the foundation's underside, metres.
    """
    left, sill, right, _ = door.box
    count = math.ceil((sill - ground) / _RISER - 1e-6)
    if count < 1:
        return []
    left, right = left - 0.15, right + 0.15
    rise = (sill - ground) / count
    # The profile from the wall outwards: (distance, height).
    profile = [(0.0, base), (0.0, sill)]
    for step in range(count):
        edge = (step + 1) * _TREAD + 0.3
        profile += [(edge, sill - step * rise), (edge, sill - (step + 1) * rise)]
    profile[-1] = (profile[-1][0], base)
    ends = [
        Face("WallSurface", "steps", [(left, wall - d, z) for d, z in profile[::-1]]),
        Face("WallSurface", "steps", [(right, wall - d, z) for d, z in profile]),
    ]
    sides = []
    for (d0, z0), (d1, z1) in zip(profile, [*profile[1:], profile[0]], strict=True):
        kind = "OuterFloorSurface" if z0 == z1 and z0 > base else "WallSurface"
        strip = [(right, wall - d0, z0), (left, wall - d0, z0)]
        strip += [(left, wall - d1, z1), (right, wall - d1, z1)]
        sides.append(Face(kind, "steps", strip))
    return ends + sides


def steps_depth(rise: float) -> float:
    """Returns the depth of steps of a given height, metres."""
    return math.ceil(max(rise, 0.0) / _RISER) * _TREAD + 0.3 if rise > 0.0 else 0.0


def porch(door: Hole, wall: float, design: Design, base: float) -> list[Face]:
    """Returns a roof over a door, on posts at detached houses.

    Args:
        door: Opening of the door.
        wall: y of its wall, metres.
        design: Design of the building.
        base: Height of the posts' underside, metres.
    """
    left, _, right, top = door.box
    # A row house has a neighbour beside it.
    left, right = max(left - _BESIDE, 0.0), min(right + _BESIDE, design.width)
    low = top + _CANOPY
    front = wall - PORCH_DEPTH
    bodies = [box((left, front, low), (right, wall, low + _CANOPY), "WallSurface", "porch")]
    if design.style == "detached":
        for x in (left + 0.05, right - 0.05 - _POST):
            near = front + 0.05
            bodies.append(
                box((x, near, base), (x + _POST, near + _POST, low), "WallSurface", "porch")
            )
    return unite(bodies) or bodies[0]


def make_installations(maker: SurfaceMaker, design: Design, base: float) -> tuple[CityObject, ...]:
    """Returns the installations of a building as ``BuildingInstallation``.

    Args:
        maker: Builds the surfaces of the building.
        design: Design of the building.
        base: Height of the foundation's underside, metres.
    """
    bodies: list[tuple[str, list[Face]]] = []
    wall = design.main_front - JOINT
    ground = (maker.site.highest if maker.site.street is None else maker.site.street) - maker.floor
    facade = Facade(design.width, design.storeys, True, taken(design))
    doors = [hole for hole in lay_out(design, facade) if hole.kind == "DoorSurface"]
    for door in doors:
        if design.style != "hall" and steps_depth(door.box[1] - ground) < maker.site.room + wall:
            bodies.append(("steps", steps(door, wall, ground, base)))
        if design.extras.porch and not door.shop and _has_room(door, wall, maker.site.room, design):
            bodies.append(("porch", porch(door, wall, design, base)))
    if design.extras.balconies:
        bodies += [("balcony", faces) for faces in _balconies(design)]
    return tuple(
        _installation(f"{maker.name}_{kind}_{number}", maker, faces)
        for number, (kind, faces) in enumerate(bodies)
        if faces
    )


def _has_room(door: Hole, wall: float, room: float, design: Design) -> bool:
    """True if a porch fits between plot border, eaves, wings and bay."""
    left, right, top = door.box[0] - _BESIDE, door.box[2] + _BESIDE, door.box[3] + 2 * _CANOPY
    # Under an overhang, the canopy must be below the roof.
    below_eaves = top + 0.05 < design.eaves - design.overhang * design.slope
    free = not any(left < end and start < right for start, end in taken(design))
    return room + wall > PORCH_DEPTH and below_eaves and free


def _installation(name: str, maker: SurfaceMaker, faces: list[Face]) -> CityObject:
    part_maker = SurfaceMaker(name, maker.site, maker.floor, maker.lod, maker.material)
    return CityObject(
        name,
        "BuildingInstallation",
        {"relationToConstruction": "outside"},
        part_maker.surfaces(faces),
        solid_lod=maker.lod,
    )


def _balconies(design: Design) -> Iterator[list[Face]]:
    """Balconies at the back of each upper storey, centred, clear of wings."""
    if any(not wing.front for wing in design.extras.wings):
        return
    half = min(1.4, design.width / 2 - 0.5)
    middle, wall = design.width / 2, design.main_front + design.main_depth + JOINT
    for storey in range(1, design.storeys):
        floor = storey * design.storey_height
        yield balcony(middle - half, middle + half, wall, floor, 1.0)

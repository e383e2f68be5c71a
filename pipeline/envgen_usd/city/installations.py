"""Balconies, steps and porches: installations outside a building, each of closed bodies."""

import math
from collections.abc import Iterator
from itertools import pairwise

from envgen_usd.city.design import Design
from envgen_usd.city.facade import Facade, Hole, lay_out
from envgen_usd.city.faces import Face, Point, box
from envgen_usd.city.shell import taken
from envgen_usd.city.surfaces import SurfaceMaker
from envgen_usd.city.union import unite
from envgen_usd.models.city import CityObject

_SLAB = 0.15
_RAIL = 1.0
_RAIL_THICKNESS = 0.08
BALCONY_DEPTH = 1.1
"""Metres."""
_RISER = 0.18
_TREAD = 0.28
PORCH_DEPTH = 1.2
"""Metres."""
_POST = 0.12
_CANOPY = 0.12
"""Thickness of a canopy, and its distance above the door, metres."""
_BESIDE = 0.4


def balcony(left: float, right: float, wall: float, floor: float, out: float) -> list[Face]:
    """Returns a balcony: a slab with a solid balustrade on three sides.

    Args:
        left: Along the wall.
        right: Along the wall, larger than `left`.
        wall: y of the wall that it stands out of.
        floor: Height of its floor.
        out: -1 where it stands out towards the street, 1 away from it.
    """
    depth, t = BALCONY_DEPTH, _RAIL_THICKNESS
    low, top = floor - _SLAB, floor + _RAIL

    def at(a: float, d: float, z: float) -> Point:
        """Seen from outside: `a` to the right, `d` out of the wall."""
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
    """Returns steps from the ground before a door up to it, or nothing where it lies level.

    Args:
        door: The opening.
        wall: y of its wall.
        ground: Height of the ground before it, above the floor (so mostly below zero).
        base: Height that the foundation reaches down to.
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
    """Returns how far steps stand out that overcome a height, metres."""
    return math.ceil(max(rise, 0.0) / _RISER) * _TREAD + 0.3 if rise > 0.0 else 0.0


def porch(door: Hole, wall: float, design: Design, base: float) -> list[Face]:
    """Returns a roof over a door, on posts where the house stands alone.

    Args:
        door: The opening.
        wall: y of its wall.
        design: The building.
        base: Height that the posts reach down to.
    """
    left, _, right, top = door.box
    # Beside a house of a row stands another.
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
        maker: Makes the building's surfaces.
        design: The building.
        base: Height that the foundation reaches down to.
    """
    bodies: list[tuple[str, list[Face]]] = []
    wall = design.main_front
    ground = (maker.site.highest if maker.site.street is None else maker.site.street) - maker.floor
    facade = Facade(design.width, design.storeys, True, taken(design))
    doors = [hole for hole in lay_out(design, facade) if hole.kind == "DoorSurface"]
    for door in doors:
        if design.style != "hall" and steps_depth(door.box[1] - ground) < maker.site.room + wall:
            bodies.append(("steps", steps(door, wall, ground, base)))
        if design.extras.porch and _has_room(door, wall, maker.site.room, design):
            bodies.append(("porch", porch(door, wall, design, base)))
    if design.extras.balconies:
        bodies += [("balcony", faces) for faces in _balconies(design)]
    return tuple(
        _installation(f"{maker.name}_{kind}_{number}", maker, faces)
        for number, (kind, faces) in enumerate(bodies)
        if faces
    )


def _has_room(door: Hole, wall: float, room: float, design: Design) -> bool:
    """Whether a porch fits between plot, eaves, wings and bay."""
    left, right, top = door.box[0] - _BESIDE, door.box[2] + _BESIDE, door.box[3] + 2 * _CANOPY
    # Where the roof stands over, the canopy must be below it.
    below_eaves = top + 0.05 < design.eaves - design.overhang * design.slope
    free = not any(left < end and start < right for start, end in taken(design))
    return room + wall > PORCH_DEPTH and below_eaves and free


def _installation(name: str, maker: SurfaceMaker, faces: list[Face]) -> CityObject:
    own = SurfaceMaker(name, maker.site, maker.floor, maker.lod, maker.material)
    return CityObject(
        name,
        "BuildingInstallation",
        {"relationToConstruction": "outside"},
        own.surfaces(faces),
        solid_lod=maker.lod,
    )


def _balconies(design: Design) -> Iterator[list[Face]]:
    """Behind the middle of each upper storey, where no wing stands."""
    if any(not wing.front for wing in design.extras.wings):
        return
    half = min(1.4, design.width / 2 - 0.5)
    middle, wall = design.width / 2, design.main_front + design.main_depth
    for storey in range(1, design.storeys):
        floor = storey * design.storey_height
        yield balcony(middle - half, middle + half, wall, floor, 1.0)

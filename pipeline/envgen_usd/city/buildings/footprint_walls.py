"""Walls over any footprint: stretches like houses of a row, with what is fixed to them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely

from envgen_usd.city.buildings.building_design import Design, Extras
from envgen_usd.city.buildings.building_faces import Face, Opening
from envgen_usd.city.buildings.facade_fixtures import make_wall_fittings
from envgen_usd.city.buildings.facades import Facade, Hole, lay_out
from envgen_usd.city.buildings.installations import make_installations
from envgen_usd.city.buildings.thematic_surfaces import Site, SurfaceMaker
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import CityObject

_LONGEST = 22.0
"""Length of a street wall from which it looks like several houses, metres."""
_USUAL = 15.0
"""Length of each of these, metres; a larger value gives fewer doors and balconies."""
_LEAST_FRONT = 4.0
"""Least length of a wall with a door, metres."""
_LEAST_BACK = 5.0
"""Least length of a wall with balconies besides those of the street, metres."""
_LEAST_FITTED = 1.0
"""Least length of a wall with courses, cornices and gutters, metres."""


@dataclass(frozen=True)
class Surroundings:
    """What a building stands beside.

    Attributes:
        street: A point in plan; the wall nearest to it has doors.
        blind: True for a wall between two points that has no openings.
        fronts: True for a wall between two points that looks at a street.
        room: Free depth before a wall between two points, metres.
        ground: Heights of the ground at points, N x 2.
        shops: S x 2, shops of the map; `None` where it has none anywhere.
        off_road: True for an outline that keeps clear of the road.
        doors: True for a wall between two points that may have doors.
    """

    street: FloatArray
    blind: Callable[[FloatArray, FloatArray], bool]
    fronts: Callable[[FloatArray, FloatArray], bool] = lambda _a, _b: False
    room: Callable[[FloatArray, FloatArray], float] = lambda _a, _b: 0.0
    ground: Callable[[FloatArray], FloatArray] | None = None
    shops: FloatArray | None = None
    off_road: Callable[[shapely.Polygon], bool] = lambda _outline: True
    doors: Callable[[FloatArray, FloatArray], bool] = lambda _a, _b: True


@dataclass(frozen=True)
class Wall:
    """A wall between two corners, in the frame of the building.

    Attributes:
        start: 2, left end as seen from outside, metres.
        end: 2, right end, metres.
        sections: Stretches with their left ends, from the left to the right; none: it is blind.
        room: Free depth before it, metres.
    """

    start: FloatArray
    end: FloatArray
    sections: tuple[tuple[float, Design, Facade], ...]
    room: float

    @property
    def length(self) -> float:
        """Length, metres."""
        return float(np.hypot(*(self.end - self.start)))

    def holes(self) -> Iterator[Hole]:
        """Openings from the wall's left end."""
        for left, design, facade in self.sections:
            for hole in lay_out(design, facade):
                low, bottom, high, top = hole.box
                yield replace(hole, box=(left + low, bottom, left + high, top))

    def face(self, base: float, top: float) -> Face:
        """The wall with its openings between two heights."""
        along = (self.end - self.start) / self.length

        def at(distance: float, z: float) -> tuple[float, float, float]:
            x, y = (self.start + distance * along).tolist()
            return x, y, z

        (x0, y0), (x1, y1) = self.start.tolist(), self.end.tolist()
        openings = []
        for hole in self.holes():
            left, low, right, high = hole.box
            ring = [at(left, low), at(right, low), at(right, high), at(left, high)]
            openings.append(Opening(hole.kind, ring))
        outline = [(x0, y0, base), (x1, y1, base), (x1, y1, top), (x0, y0, top)]
        return Face("WallSurface", "wall", outline, openings=openings)


def walls_of(
    rings: Sequence[FloatArray], origin: FloatArray, design: Design, beside: Surroundings
) -> list[Wall]:
    """The walls over rings with the building to the left, whose frame starts at an origin."""
    main = _street_wall(rings[0], beside.street - origin)
    sides = [side for ring in rings for side in pairwise(np.concatenate([ring, ring[:1]]))]
    blind = [beside.blind(a + origin, b + origin) for a, b in sides]
    at_street = [
        not design.raised
        and n < len(rings[0])
        and not blind[n]
        and (n == main or _is_front(a, b, origin, beside))
        and beside.doors(a + origin, b + origin)
        for n, (a, b) in enumerate(sides)
    ]
    shops = _shops_of_walls(sides, at_street, beside.shops, origin)
    walls = []
    for n, (a, b) in enumerate(sides):
        room = 0.0 if blind[n] else beside.room(a + origin, b + origin)
        length = float(np.hypot(*(b - a)))
        sections = _sections(design, length, room, shops[n], at_street=at_street[n])
        walls.append(Wall(a, b, () if blind[n] else sections, room))
    return walls


def _is_front(a: FloatArray, b: FloatArray, origin: FloatArray, beside: Surroundings) -> bool:
    return bool(np.hypot(*(b - a)) >= _LEAST_FRONT) and beside.fronts(a + origin, b + origin)


def _shops_of_walls(
    sides: Sequence[tuple[FloatArray, FloatArray]],
    at_street: Sequence[bool],
    shops: FloatArray | None,
    origin: FloatArray,
) -> list[FloatArray]:
    """Distances of shops along each wall; a shop has its front in the nearest street wall."""
    found: list[list[float]] = [[] for _ in sides]
    streets = np.flatnonzero(at_street).tolist()
    if shops is None or not len(streets) or not len(shops):
        return [np.array(places) for places in found]
    lines = shapely.linestrings([np.stack(sides[n]) for n in streets])
    points = shapely.points(shops - origin)
    nearest = shapely.distance(points[:, None], lines[None]).argmin(axis=1)
    places = shapely.line_locate_point(lines[nearest], points)
    for wall, place in zip(nearest.tolist(), places.tolist(), strict=True):
        found[streets[wall]].append(min(place, float(lines[wall].length) - 1e-3))
    return [np.array(places) for places in found]


def make_wall_parts(
    maker: SurfaceMaker, walls: Sequence[Wall], base: float, beside: Surroundings
) -> tuple[CityObject, ...]:
    """Steps, porches and what is fixed to the walls of a building.

    Args:
        maker: Knows the site and the floor of the building.
        walls: Its walls.
        base: Height of the foundation's underside above the floor, metres.
        beside: What the building stands beside.
    """
    parts: list[CityObject] = []
    for number, wall in enumerate(walls):
        if wall.length < _LEAST_FITTED or not wall.sections:
            continue
        along = (wall.end - wall.start) / wall.length
        for count, (left, section, facade) in enumerate(wall.sections):
            origin = maker.site.origin + wall.start + left * along
            middle = origin + section.width / 2 * along + [0.5 * along[1], -0.5 * along[0]]
            low, high = maker.site.lowest, maker.site.highest
            height = None if beside.ground is None else float(beside.ground(middle[None])[0])
            site = Site(origin, along, low, high, height, wall.room)
            name = f"{maker.name}_w{number}_{count}"
            own = SurfaceMaker(name, site, maker.floor, maker.lod, maker.material, maker.embrasure)
            if facade.street:
                parts += make_installations(own, section, base)
            parts += make_wall_fittings(own, section, lay_out(section, facade))
    return tuple(parts)


def _sections(
    design: Design, length: float, room: float, shops: FloatArray, *, at_street: bool
) -> tuple[tuple[float, Design, Facade], ...]:
    """Stretches of a wall with their left ends."""
    count = max(round(length / _USUAL), 1) if at_street and length > _LONGEST else 1
    width = length / count
    fittings, sections = design.extras.fittings, []
    for number in range(count):
        left = number * width
        has_shop = bool(((shops >= left) & (shops < left + width)).any())
        can_stand_out = room > 1.4 and design.storeys > 1
        own = replace(
            fittings,
            shop=at_street and (has_shop or fittings.shop),
            awning=fittings.awning or (has_shop and number % 2 == 0),
            balcony=can_stand_out and (fittings.balcony if at_street else design.extras.balconies),
            dish=False,
            aerial=False,
        )
        extras = Extras(
            embrasure=design.extras.embrasure, porch=design.extras.porch and at_street, fittings=own
        )
        section = replace(design, width=width, overhang=0.0, extras=extras, ridge_to_street=False)
        back = own.balcony and not at_street and width >= _LEAST_BACK
        sections.append((left, section, Facade(width, design.storeys, at_street, balcony=back)))
    return tuple(sections)


def _street_wall(ring: FloatArray, street: FloatArray) -> int:
    """Number of the wall nearest to the street among those with room for a door."""
    after = np.roll(ring, -1, axis=0)
    steps = after - ring
    lengths = np.linalg.norm(steps, axis=1)
    # A wall that looks away from the street is farther than one that looks at it.
    out = np.stack([steps[:, 1], -steps[:, 0]], axis=1) / np.maximum(lengths, 1e-9)[:, None]
    way = street - (ring + after) / 2.0
    distance = np.linalg.norm(way, axis=1)
    facing = (out * way).sum(1) / np.maximum(distance, 1e-9)
    return int(np.argmin(distance - 8.0 * facing + np.where(lengths < 3.0, 50.0, 0.0)))

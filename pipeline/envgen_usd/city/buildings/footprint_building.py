"""A building over any footprint: straight walls with openings, and a flat or hipped roof."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import shapely

from envgen_usd.city.buildings.building_design import Design
from envgen_usd.city.buildings.building_faces import Face, Opening, Ring
from envgen_usd.city.buildings.building_feature import (
    BELOW_GROUND,
    CLASSES,
    FUNCTIONS,
    ROOF_TYPES,
    material_of,
)
from envgen_usd.city.buildings.facades import Facade, Hole, lay_out
from envgen_usd.city.buildings.thematic_surfaces import Site, SurfaceMaker
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject

_PITCHED = frozenset({"gabled", "hipped", "pyramidal", "mansard", "shed", "barrel", "sawtooth"})
"""Roofs that become hipped over a footprint that is no rectangle."""
_HIGHEST_RISE = 5.0
"""Largest rise of such a roof, metres; a larger value makes roofs of wide houses higher."""
_LEAST_RISE = 0.8
"""Least rise of such a roof, metres; lower ones are flat."""
_TRIES = np.linspace(1.0, 0.15, 18)
"""Tried depths of the slopes as shares of the largest."""

BlindWall = Callable[[FloatArray, FloatArray], bool]
"""True for a wall between two points in plan that has no openings."""


def make_footprint_building(  # noqa: PLR0913, PLR0917 - what a building follows from
    name: str,
    design: Design,
    footprint: shapely.Polygon,
    ground: tuple[float, float],
    street: FloatArray,
    blind: BlindWall,
) -> CityObject:
    """Returns a building whose walls stand on a polygon, which may have courts.

    A pitched roof slopes up from all walls by the same angle, as far as its inner border keeps the
    corners of the footprint, and is level inside. Its top is flat where that leaves no height.

    Args:
        name: gml:id; the ids of its surfaces begin with it.
        design: Figures and materials; width, depth, wings and fittings do not count.
        footprint: Outline of the walls, metres.
        ground: Lowest and highest ground below it, metres.
        street: A point in plan; the wall nearest to it has the doors.
        blind: Which walls have no openings.
    """
    origin = np.floor(np.array(footprint.centroid.coords[0]))
    site = Site(origin, np.array([1.0, 0.0]), *ground)
    floor = round(ground[1] + design.plinth, 3)
    base = ground[0] - BELOW_GROUND - floor
    rings = _rings(footprint, origin)
    inner = _inner_rings(rings, design) if design.roof in _PITCHED else None
    rise = 0.0 if inner is None else inner[1]
    doors = _street_wall(rings[0], street - origin)
    faces = list(_walls(rings, design, base, doors, lambda a, b: blind(a + origin, b + origin)))
    faces.append(_level(rings, base, "GroundSurface", "ground"))
    if inner is None:
        faces.append(_level(rings, design.eaves, "RoofSurface", "flat"))
    else:
        faces += _slopes(rings, inner[0], design.eaves, rise)
        faces.append(_level(inner[0], design.eaves + rise, "RoofSurface", "flat"))
    roof = "flat" if inner is None else "hipped"
    maker = SurfaceMaker(name, site, floor, 3, material_of(design), design.extras.embrasure)
    attributes: dict[str, Attribute] = {
        "class": CLASSES[design.function],
        "function": FUNCTIONS[design.function],
        "roofType": ROOF_TYPES[roof],
        "storeysAboveGround": design.storeys,
        "floorHeight": floor,
        "style": design.style,
        "height": round(design.eaves + rise - base, 3),
    }
    return CityObject(name, "Building", attributes, surfaces=maker.surfaces(faces), solid_lod=3)


def _rings(footprint: shapely.Polygon, origin: FloatArray) -> list[FloatArray]:
    """Rings of the footprint, with the building to the left, in its frame."""
    shape = shapely.orient_polygons(footprint)
    return [
        shapely.get_coordinates(ring)[:-1] - origin for ring in (shape.exterior, *shape.interiors)
    ]


def _ring(points: FloatArray, height: float) -> Ring:
    return [(x, y, height) for x, y in points.tolist()]


def _level(rings: Sequence[FloatArray], height: float, kind: str, part: str) -> Face:
    """A horizontal face; ground looks down."""
    outer, *courts = (_ring(ring, height) for ring in rings)
    if kind == "GroundSurface":
        return Face(kind, part, outer[::-1], [court[::-1] for court in courts])
    return Face(kind, part, outer, courts)


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


def _walls(
    rings: Sequence[FloatArray], design: Design, base: float, doors: int, blind: BlindWall
) -> list[Face]:
    faces = []
    for number, ring in enumerate(rings):
        closed = np.concatenate([ring, ring[:1]])
        for wall, (a, b) in enumerate(pairwise(closed)):
            length = float(np.hypot(*(b - a)))
            holes: list[Hole] = []
            if not blind(a, b):
                at_street = number == 0 and wall == doors
                holes = lay_out(design, Facade(length, design.storeys, at_street))
            faces.append(_wall(a, b, (base, design.eaves), holes))
    return faces


def _wall(a: FloatArray, b: FloatArray, heights: tuple[float, float], holes: list[Hole]) -> Face:
    base, top = heights
    along = (b - a) / np.hypot(*(b - a))

    def at(distance: float, z: float) -> tuple[float, float, float]:
        x, y = (a + distance * along).tolist()
        return x, y, z

    (x0, y0), (x1, y1) = a.tolist(), b.tolist()
    ring = [(x0, y0, base), (x1, y1, base), (x1, y1, top), (x0, y0, top)]
    openings = []
    for hole in holes:
        left, low, right, high = hole.box
        openings.append(
            Opening(hole.kind, [at(left, low), at(right, low), at(right, high), at(left, high)])
        )
    return Face("WallSurface", "wall", ring, openings=openings)


def _slopes(
    rings: Sequence[FloatArray], inner: Sequence[FloatArray], eaves: float, rise: float
) -> list[Face]:
    faces = []
    for ring, inside in zip(rings, inner, strict=True):
        low, high = _ring(ring, eaves), _ring(inside, eaves + rise)
        for n in range(len(low)):
            after = (n + 1) % len(low)
            quad = [low[n], low[after], high[after], high[n]]
            faces.append(Face("RoofSurface", "slope", quad))
    return faces


def _inner_rings(
    rings: Sequence[FloatArray], design: Design
) -> tuple[list[FloatArray], float] | None:
    """Rings moved inwards by the same distance, and the rise there; `None` without room."""
    outer = shapely.Polygon(rings[0], rings[1:])
    widest = 2.0 * outer.area / outer.length
    slope = max(design.slope, 0.1)
    most = min(_HIGHEST_RISE / slope, 0.98 * widest)
    for share in _TRIES.tolist():
        depth = share * most
        if depth * slope < _LEAST_RISE:
            return None
        moved = [_moved(ring, depth) for ring in rings]
        if all(_keeps(ring, inside) for ring, inside in zip(rings, moved, strict=True)):
            shape = shapely.Polygon(moved[0], moved[1:])
            if shape.is_valid and shape.area > 0.5 and outer.contains(shape):
                return moved, round(depth * slope, 3)
    return None


def _moved(ring: FloatArray, depth: float) -> FloatArray:
    """A ring whose sides are moved to their left by the same distance."""
    steps = np.roll(ring, -1, axis=0) - ring
    normals = np.stack([-steps[:, 1], steps[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    before = np.roll(normals, 1, axis=0)
    # The corner moves along the sum of both normals until it is as far from both sides.
    both = before + normals
    size = np.maximum((both * normals).sum(1, keepdims=True), 1e-6)
    moved: FloatArray = ring + depth * both / size
    return moved


def _keeps(ring: FloatArray, inside: FloatArray) -> bool:
    """True if each side keeps its direction and some length."""
    steps = np.roll(ring, -1, axis=0) - ring
    moved = np.roll(inside, -1, axis=0) - inside
    ahead = (steps * moved).sum(1) / np.linalg.norm(steps, axis=1)
    return bool((ahead > 0.05).all())

"""Buildings of a map, by their footprints, heights, storeys, roofs and materials."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from scipy.spatial import cKDTree

from envgen_usd.city.buildings.building_design import Design, Extras, Fittings
from envgen_usd.city.buildings.building_feature import make_building
from envgen_usd.city.buildings.building_outline import ridge_rise
from envgen_usd.city.buildings.design_draws import draw_design
from envgen_usd.city.buildings.footprint_building import make_footprint_building
from envgen_usd.city.buildings.thematic_surfaces import Site
from envgen_usd.city.ground_heights import Ground
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.building_rules import BuildingRules
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.place import Houses
from envgen_usd.seeds import Draws

_STRAIGHT = 0.15
"""Distance of a corner from a straight wall by which it is left out, metres."""
_LEAST_AREA = 6.0
"""Area of the smallest building, m²."""
_RECTANGLE = 0.35
"""Largest distance of a footprint from the rectangle that is built instead, metres."""
_TOUCH = 0.3
"""Distance of a wall from another building below which it has no openings, metres."""
_ROAD_SHARE = 0.3
"""Share of a footprint on the road up to which it is cut; others are left out."""
_FROM_ROAD = 0.1
"""Distance of a cut footprint from the road, metres."""
_FLAT_FROM = 700.0
"""Area from which a roof that the map does not name is flat, m²."""
_FLAT_STOREYS = 6
"""Storeys from which a roof that the map does not name is flat."""
_OVERHANG = 0.35
"""Largest width of eaves, metres, so that roofs stay near their footprints."""
_STOREY_HEIGHTS = (2.4, 6.0)
_SMALL = frozenset(
    {"garage", "garages", "carport", "shed", "hut", "roof", "kiosk", "service", "container"}
)
_HALLS = frozenset(
    {"industrial", "warehouse", "hangar", "factory", "retail", "supermarket", "barn", "commercial"}
)


@dataclass(frozen=True)
class MappedBuildings:
    """Buildings of a map.

    Attributes:
        buildings: Buildings on the ground.
        issues: What was cut, left out, or drawn from the environment.
    """

    buildings: tuple[CityObject, ...]
    issues: tuple[Issue, ...]


def build_mapped(  # noqa: PLR0913, PLR0917 - what buildings follow from
    houses: Houses,
    ground: Ground,
    road: Sequence[FloatArray] | FloatArray,
    rules: BuildingRules,
    seed: int,
    source: str = "",
) -> MappedBuildings:
    """Builds the buildings of a map.

    1. Footprints are cleaned, and cut where they reach onto the road or into a larger building;
       those mostly on the road or within another are left out.
    2. Height, storeys, roof and materials are the map's; what it lacks is drawn.
    3. A footprint that is nearly a rectangle gets the environment's house of that size, any other
       one straight walls and a flat or hipped roof.

    Args:
        houses: Buildings of the map, in the road frame.
        ground: Heights of the ground.
        road: Triangles of the road in plan, T x 3 x 2.
        rules: Figures of the environment's buildings.
        seed: The user's seed.
        source: Name of the map, for messages.
    """
    counts: Counter[str] = Counter()
    shapes, numbers = _cleaned(houses, np.asarray(road), counts)
    tree = shapely.STRtree(shapes)
    corners = np.asarray(road).reshape(-1, 2)
    streets = cKDTree(corners) if len(corners) else None
    built = []
    for shape, number in zip(shapes, numbers, strict=True):
        middle = np.array(shape.centroid.coords[0])
        street = middle if streets is None else corners[int(streets.query(middle)[1])]
        near = tree.query(shape.buffer(_TOUCH), predicate="intersects")
        others = [shapes[n] for n in near.tolist() if shapes[n] is not shape]
        house = _House(houses, number, shape, rules, Draws(seed, "city", "mapped", number))
        built.append(house.built(ground, street, others))
        counts.update(house.drawn)
    return MappedBuildings(tuple(built), tuple(_issues(counts, len(built), source)))


def _cleaned(
    houses: Houses, road: FloatArray, counts: Counter[str]
) -> tuple[list[shapely.Polygon], list[int]]:
    """Footprints free of the road and of one another, the largest first."""
    tree = shapely.STRtree(shapely.polygons(road)) if len(road) else None
    shapes: list[shapely.Polygon] = []
    numbers: list[int] = []
    taken: dict[int, shapely.Polygon] = {}
    wide = shapely.STRtree(houses.footprints)
    for number in np.argsort(-shapely.area(houses.footprints), kind="stable").tolist():
        shape = _largest(shapely.make_valid(houses.footprints[number]))
        if shape is None:
            counts["small"] += 1
            continue
        area = shape.area
        for other in wide.query(shape, predicate="intersects").tolist():
            if other in taken and other != number:
                shape = _largest(shapely.difference(shape, taken[other])) if shape else None
        if shape is None or shape.area < 0.5 * area:
            counts["inside"] += 1
            continue
        if tree is not None:
            hit = tree.query(shape, predicate="intersects")
            if len(hit):
                covered = shapely.union_all(tree.geometries[hit])
                if shapely.intersection(shape, covered).area > _ROAD_SHARE * shape.area:
                    counts["on_road"] += 1
                    continue
                shape = _largest(shapely.difference(shape, covered.buffer(_FROM_ROAD)))
                counts["cut"] += 1
        if shape is None:
            counts["small"] += 1
            continue
        shapes.append(shape)
        numbers.append(number)
        taken[number] = shape
    return shapes, numbers


def _largest(shape: shapely.Geometry) -> shapely.Polygon | None:
    """The largest part of a shape with straight walls; `None` where nothing is left."""
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    if not parts:
        return None
    best = max(parts, key=shapely.area)
    plain = shapely.simplify(best, _STRAIGHT)
    # Grid of 1 mm: neighbours then share their walls exactly.
    plain = shapely.set_precision(plain, 1e-3)
    parts = [part for part in shapely.get_parts(plain) if part.geom_type == "Polygon"]
    best = max(parts, key=shapely.area, default=None)
    if best is None or best.area < _LEAST_AREA or not best.is_valid:
        return None
    courts = [ring for ring in best.interiors if shapely.Polygon(ring).area > _LEAST_AREA]
    return shapely.Polygon(best.exterior, courts)


class _House:
    """A building of the map on its way to a feature."""

    def __init__(
        self,
        houses: Houses,
        number: int,
        shape: shapely.Polygon,
        rules: BuildingRules,
        draws: Draws,
    ) -> None:
        self._houses, self._number, self._shape = houses, number, shape
        self._kind = str(houses.kinds[number])
        self._rules, self._draws = rules, draws
        self.drawn: list[str] = []

    def built(
        self, ground: Ground, street: FloatArray, others: Sequence[shapely.Polygon]
    ) -> CityObject:
        """The feature, on the ground."""
        name = f"osm_building_{self._number}"
        edge = shapely.get_coordinates(shapely.segmentize(self._shape, 2.0))
        heights = ground.heights(edge)
        low, high = float(heights.min()), float(heights.max())
        frame = self._rectangle(street)
        design = self._design(frame[1] if frame else self._size())
        row = frame is not None and self._row(frame, others)
        if frame is not None and row is not None and design.roof != "sawtooth":
            origin, (width, depth), along = frame
            design = replace(
                design,
                width=width,
                depth=depth,
                style="row" if row and design.style != "hall" else design.style,
                ridge_to_street=width < depth and not row,
            )
            front = origin + width / 2.0 * along
            site = Site(origin, along, low, high, room=min(3.0, float(np.hypot(*(street - front)))))
            return make_building(name, design, site)[0]
        blind = _Blind(others)
        return make_footprint_building(name, design, self._shape, (low, high), street, blind)

    def _size(self) -> tuple[float, float]:
        box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(self._shape))
        sides = np.linalg.norm(np.diff(box[:3], axis=0), axis=1)
        return float(sides.max()), float(sides.min())

    def _rectangle(
        self, street: FloatArray
    ) -> tuple[FloatArray, tuple[float, float], FloatArray] | None:
        """Left end of the street side, width and depth, and its direction; `None` if uneven."""
        box = shapely.minimum_rotated_rectangle(self._shape)
        if self._shape.interiors or box.geom_type != "Polygon":
            return None
        if shapely.hausdorff_distance(box.exterior, self._shape.exterior) > _RECTANGLE:
            return None
        corners = shapely.get_coordinates(shapely.orient_polygons(box))[:4]
        sides = np.roll(corners, -1, axis=0) - corners
        lengths = np.linalg.norm(sides, axis=1)
        out = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / lengths[:, None]
        way = street - (corners + sides / 2.0)
        facing = (out * way).sum(1) / np.maximum(np.linalg.norm(way, axis=1), 1e-9)
        front = int(np.argmax(facing))
        width, depth = float(lengths[front]), float(lengths[(front + 1) % 4])
        if min(width, depth) < 2.0:
            return None
        return corners[front], (round(width, 3), round(depth, 3)), sides[front] / width

    def _row(
        self,
        frame: tuple[FloatArray, tuple[float, float], FloatArray],
        others: Sequence[shapely.Polygon],
    ) -> bool | None:
        """True with a neighbour at the left or right, `None` with one elsewhere."""
        origin, (width, depth), along = frame
        into = np.array([-along[1], along[0]])
        blind = _Blind(others)
        corners = [origin, origin + width * along]
        corners += [corners[1] + depth * into, origin + depth * into]
        hit = [blind(corners[n], corners[(n + 1) % 4]) for n in range(4)]
        return None if hit[0] or hit[2] else hit[1] or hit[3]

    def _design(self, size: tuple[float, float]) -> Design:
        """Figures of the map, and of the environment where it has none."""
        rules, draws = self._rules, self._draws
        hall = self._kind in _HALLS or self._houses.landuse[self._number] == "industrial"
        small = self._kind in _SMALL or self._shape.area < 30.0
        design = draw_design(rules, size, draws)
        said = str(self._houses.roofs[self._number])
        roof = said or design.roof
        storeys = self._storeys(design, small, hall)
        flat_kind = small or hall or self._shape.area > _FLAT_FROM or storeys >= _FLAT_STOREYS
        if not said and flat_kind:
            roof = "flat"
        flat = roof == "flat"
        roofing = rules.flat_roof_materials if flat else rules.roof_materials
        pitch = draws.within("mapped pitch", rules.roof_pitch)
        fittings = Fittings(gutters=design.extras.fittings.gutters and not small)
        design = replace(
            design,
            style=design.style if rules.style == "hall" else "detached",
            storeys=storeys,
            storey_height=2.6 if small else design.storey_height,
            roof=roof,
            slope=math.tan(math.radians(min(pitch, 14.0) if roof == "shed" else pitch)),
            overhang=0.0 if flat else min(design.overhang, _OVERHANG),
            parapet=0.0 if small or not flat else max(design.parapet, 0.4),
            wall_material=self._material("walls", rules.materials, "mapped wall"),
            roof_material=self._material("roofing", roofing, "mapped roof"),
            chimney=None if small or flat else design.chimney,
            extras=Extras(
                embrasure=design.extras.embrasure,
                roof_windows=0 if small else design.extras.roof_windows,
                fittings=fittings,
            ),
        )
        return self._with_height(replace(design, width=size[0], depth=size[1]))

    def _storeys(self, design: Design, small: bool, hall: bool) -> int:
        said = float(self._houses.storeys[self._number])
        if np.isfinite(said):
            return max(round(said), 1)
        height = float(self._houses.heights[self._number])
        if np.isfinite(height):
            return max(round(height * 0.85 / design.storey_height), 1)
        self.drawn.append("height")
        if small:
            return 1
        return max(design.storeys, 1) if not hall else min(max(design.storeys, 1), 3)

    def _with_height(self, design: Design) -> Design:
        """A design whose top has the height of the map, with storeys of usual height."""
        height = float(self._houses.heights[self._number])
        if not np.isfinite(height):
            return design
        rise = ridge_rise(design)
        eaves = max(height - rise, 0.5 * height, 2.2)
        storeys = design.storeys
        if not _STOREY_HEIGHTS[0] <= eaves / storeys <= _STOREY_HEIGHTS[1]:
            storeys = max(round(eaves / design.storey_height), 1)
        return replace(design, storeys=storeys, storey_height=eaves / storeys)

    def _material(self, key: str, weights: Mapping[str, float], name: str) -> str:
        """A material of the family that the map names, else of the environment."""
        family = str(getattr(self._houses, key)[self._number])
        fitting = {n: w for n, w in weights.items() if family and n.startswith(family)}
        return self._draws.choice(name, fitting or weights)


class _Blind:
    """Walls that another building touches."""

    def __init__(self, others: Iterable[shapely.Polygon]) -> None:
        self._others = list(others)

    def __call__(self, a: FloatArray, b: FloatArray) -> bool:
        """True if most of a wall lies beside another building."""
        if not self._others:
            return False
        step = b - a
        length = float(np.hypot(*step))
        out = np.array([step[1], -step[0]]) / max(length, 1e-9)
        places = a + np.linspace(0.1, 0.9, 5)[:, None] * step + 0.5 * _TOUCH * out
        points = shapely.points(places)
        near = np.zeros(len(points), bool)
        for other in self._others:
            near |= shapely.distance(points, other) < _TOUCH
        return bool(near.mean() > 0.35)


def _issues(counts: Counter[str], built: int, source: str) -> Iterable[Issue]:
    texts = {
        "cut": ("reach onto the road", "cut there", Severity.INFO),
        "on_road": ("stand on the road", "left out", Severity.WARNING),
        "inside": ("stand within another one", "left out", Severity.INFO),
        "small": ("have no usable footprint", "left out", Severity.INFO),
        "height": (
            "have neither height nor levels",
            "drawn from the environment",
            Severity.INFO,
        ),
    }
    for name, (what, done, severity) in texts.items():
        if counts[name]:
            text = f"{counts[name]} buildings {what}; {built} are built"
            yield Issue(f"osm.building_{name}", severity, source, text, done)

"""Buildings of a map, by their footprints, heights, storeys, roofs and materials."""

import math
import pickle
import tempfile
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely

from envgen_usd.city.buildings.building_design import Design, Extras, Fittings
from envgen_usd.city.buildings.building_feature import make_building
from envgen_usd.city.buildings.building_outline import ridge_rise
from envgen_usd.city.buildings.design_draws import draw_design
from envgen_usd.city.buildings.footprint_building import make_footprint_building
from envgen_usd.city.buildings.footprint_walls import Surroundings
from envgen_usd.city.buildings.thematic_surfaces import Site
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.mapped_bodies import ground_below, grouped
from envgen_usd.city.plots.mapped_footprints import OVER_ROAD, cleaned_footprints
from envgen_usd.city.plots.mapped_outlines import Outline, l_shape, outline_of
from envgen_usd.city.plots.mapped_surroundings import Neighbourhood
from envgen_usd.city.plots.use_rules import barn_rules
from envgen_usd.errors import Issue, Severity
from envgen_usd.executors.executor import ALONE, LocalProcesses, Tasks
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.building_rules import BuildingRules
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.place import Houses
from envgen_usd.seeds import Draws

_RECTANGLE = 0.35
"""Largest distance of a footprint from the rectangle that is built instead, metres."""
_EXACT = 0.02
"""The same for bodies of a building of several, which would reach into one another, metres."""
_LEAST_SHARE = 50
"""Least number of buildings for which another process is worth its start."""
_LEAST_SIDE = 2.0
"""Least side of a rectangle that gets a house of the environment, metres."""
_LONG = 22.0
"""Length of a flat-roofed rectangle from which its walls look like several houses, metres."""
_BALCONY = 1.4
"""Least depth before a wall with balconies, metres."""
_LEAST_SHOP = 60.0
"""Least area of a building with a shop that the map does not have, m²."""
_FLAT_FROM = 700.0
"""Area from which a roof that the map does not name is flat, m²."""
_FLAT_STOREYS = 6
"""Storeys from which a roof that the map does not name is flat."""
_VILLA_AREA, _VILLA_STOREYS = 200.0, 2
"""Area below which a free-standing building of unknown height is a house of so many storeys, m²."""
_OVERHANG = 0.35
"""Largest width of eaves, metres, so that roofs stay near their footprints."""
_SHOPS = frozenset({"retail", "supermarket", "kiosk", "commercial", "shop"})
"""Kinds of buildings with shop fronts."""
_STOREY_HEIGHTS = (2.4, 6.0)
_PLINTH = 0.1
"""Height of the floor of bodies of a building above the highest ground, metres."""
_SLOPES = (0.05, 8.0)
"""Least and largest slope of a roof whose height the map gives."""
_SPIRE = 1.5
"""Slope from which a roof has no eaves."""
_ROUND_SLOPES = {"dome": 1.0, "onion": 2.4}
"""Rise of round roofs by half the least width, where the map gives no height: a dome is a half
sphere."""
_LEVEL = frozenset({"flat", "sawtooth", "barrel"})
"""Roofs whose height does not follow from their slope."""
_OVER_FOOTPRINT = frozenset({"sawtooth", *_ROUND_SLOPES})
"""Roofs that houses of an environment do not have."""
_SMALL = frozenset({"garage", "garages", "carport", "hut", "roof", "kiosk", "service", "container"})
_BARNS = frozenset(
    {"barn", "farm_auxiliary", "stable", "cowshed", "sty", "sheepfold", "shed", "granary"}
)
"""Kinds of buildings of farms without flats."""
_LARGE_BARN = 60.0
"""Area from which such a building is as high as the barns of the environment, m²."""
_SACRED = frozenset({"church", "cathedral", "chapel", "mosque", "synagogue", "temple", "monastery"})
"""Kinds of buildings without shops and balconies."""
_HALLS = frozenset(
    {"industrial", "warehouse", "hangar", "factory", "retail", "supermarket", "commercial"}
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
    shops: FloatArray | None = None,
    executor: LocalProcesses = ALONE,
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
        shops: S x 2, shops of the map; without any, the environment draws them.
        executor: Builds many buildings in several processes.
    """
    counts: Counter[str] = Counter()
    shapes, numbers = cleaned_footprints(houses, np.asarray(road), counts)
    bodies = houses.take(np.array(numbers, int))
    lands = ground_below(shapes, bodies.groups, ground)
    site = _Site(
        houses, bodies, shapes, numbers, lands, np.asarray(road), ground, shops, rules, seed
    )
    built = _all_built(site, executor)
    for _, drawn in built:
        counts.update(drawn)
    whole = grouped([feature for feature, _ in built], bodies.groups)
    return MappedBuildings(whole, tuple(_issues(counts, len(whole), source)))


_Built = tuple[CityObject, Sequence[str]]
"""A building, and what of it was drawn from the environment."""


@dataclass(frozen=True, eq=False)
class _Site:
    """What all buildings of a map follow from.

    Attributes:
        houses: Buildings of the map.
        bodies: Those that are built.
        shapes: Their cleaned footprints.
        numbers: Their places in `houses`.
        lands: Lowest and highest ground below each, metres.
        road: Triangles of the road in plan, T x 3 x 2.
        ground: Heights of the ground.
        shops: S x 2, shops of the map, or `None`.
        rules: Figures of the environment's buildings.
        seed: The user's seed.
    """

    houses: Houses
    bodies: Houses
    shapes: Sequence[shapely.Polygon]
    numbers: Sequence[int]
    lands: Sequence[tuple[float, float]]
    road: FloatArray
    ground: Ground
    shops: FloatArray | None
    rules: BuildingRules
    seed: int

    def built(self, places: Iterable[int]) -> list[_Built]:
        """Builds some of the buildings."""
        around = Neighbourhood(self.shapes, self.road, self.ground, self.shops, self.bodies)
        found: list[_Built] = []
        for place in places:
            number = self.numbers[place]
            group = int(self.houses.groups[number])
            # The bodies of a building look alike.
            own = ("mapped", number) if group < 0 else ("mapped group", group)
            draws = Draws(self.seed, "city", *own)
            house = _House(self.houses, number, self.shapes[place], self.rules, draws)
            found.append((house.built(self.lands[place], around.around(place)), house.drawn))
        return found


def _all_built(site: _Site, executor: LocalProcesses) -> list[_Built]:
    """Builds all buildings, in several processes where they are many."""
    places = range(len(site.numbers))
    shares = min(executor.slots, len(places) // _LEAST_SHARE)
    if executor.is_alone(shares):
        return site.built(places)
    parts: dict[int, list[_Built]] = {}
    jobs = [places[number::shares] for number in range(shares)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "site.pickle"
        path.write_bytes(pickle.dumps(site, pickle.HIGHEST_PROTOCOL))
        tasks = Tasks(_built_share, jobs, _read_site, (path,))
        executor.run(tasks, lambda found: parts.update([found]))
    return [parts[place % shares][place // shares] for place in places]


_site: _Site


def _read_site(path: Path) -> None:
    global _site  # noqa: PLW0603 - the state of a worker process
    _site = pickle.loads(path.read_bytes())


def _built_share(places: Sequence[int]) -> tuple[int, list[_Built]]:
    """The first of some places, and the buildings there."""
    return places[0], _site.built(places)


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
        self._raised = float(houses.bottoms[number])
        self._height = float(houses.heights[number]) - self._raised
        self._has_others = bool(houses.groups[number] >= 0)
        self._is_body = self._raised > 0.0 or self._has_others
        self.drawn: list[str] = []

    def built(self, land: tuple[float, float], beside: Surroundings) -> CityObject:
        """The feature above the lowest and the highest ground below it."""
        name = f"osm_building_{self._number}"
        plain = self._rectangle(beside)
        design = self._design(plain.size if plain else self._size(), beside)
        if design.roof in {"flat", "sawtooth"} and plain and max(plain.size) > _LONG:
            plain = None if design.style != "hall" else plain
        if plain is None and design.roof in {"gabled", "hipped"} and not self._has_others:
            return self._winged(name, design, land, beside)
        if plain is not None and design.roof not in _OVER_FOOTPRINT:
            row = _row(plain, beside)
            if row is not None:
                width, depth = plain.size
                ridge = width < depth and not row
                style = "row" if row and design.style != "hall" else design.style
                design = replace(
                    design, width=width, depth=depth, style=style, ridge_to_street=ridge
                )
                return _house(name, design, plain, land, beside)[0]
        return self._on_footprint(name, design, land, beside)

    def _winged(
        self, name: str, design: Design, land: tuple[float, float], beside: Surroundings
    ) -> CityObject:
        """A house with a ridge over each arm of an L, or slopes over all walls."""
        found = l_shape(self._shape, beside.street)
        is_free = found is not None and beside.off_road(found.outline.polygon())
        if found and is_free and not any(map(beside.blind, *_sides(found.outline))):
            extras = replace(
                design.extras,
                wings=(replace(found.wing, storeys=design.storeys),),
                dormers=0,
                roof_windows=0,
            )
            width, depth = found.outline.size
            house = replace(design, width=width, depth=depth, ridge_to_street=False, extras=extras)
            building, lost = _house(name, house, found.outline, land, beside)
            if "wings" not in lost:
                return building
        return self._on_footprint(name, design, land, beside)

    def _on_footprint(
        self, name: str, design: Design, land: tuple[float, float], beside: Surroundings
    ) -> CityObject:
        """A building over the footprint; shops of the map stand at their place along its walls."""
        extras, by_place = design.extras, beside.shops is not None and len(beside.shops) > 0
        shop = extras.fittings.shop and (not by_place or self._kind in _SHOPS)
        extras = replace(extras, fittings=replace(extras.fittings, shop=shop))
        own = replace(design, extras=extras)
        return make_footprint_building(name, own, self._shape, land, beside)

    def _size(self) -> tuple[float, float]:
        box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(self._shape))
        sides = np.linalg.norm(np.diff(box[:3], axis=0), axis=1)
        return float(sides.max()), float(sides.min())

    def _rectangle(self, beside: Surroundings) -> Outline | None:
        """The rectangle of the footprint; `None` if it is uneven, or reaches onto the road."""
        box = shapely.minimum_rotated_rectangle(self._shape)
        uneven = _EXACT if self._has_others else _RECTANGLE
        if self._shape.interiors or box.geom_type != "Polygon":
            return None
        if shapely.hausdorff_distance(box.exterior, self._shape.exterior) > uneven:
            return None
        if self._raised < OVER_ROAD and not beside.off_road(box):
            return None
        outline = outline_of(box, beside.street)
        return outline if min(outline.size) >= _LEAST_SIDE else None

    def _design(self, size: tuple[float, float], beside: Surroundings) -> Design:
        """Figures of the map, and of the environment where it has none."""
        draws, barn = self._draws, self._kind in _BARNS
        rules = barn_rules(self._rules) if barn else self._rules
        hall = self._kind in _HALLS or self._houses.landuse[self._number] == "industrial"
        least = _LARGE_BARN if barn else 30.0
        small = self._kind in _SMALL or self._shape.area < least
        design = draw_design(rules, size, draws)
        said = str(self._houses.roofs[self._number])
        roof = said or design.roof
        storeys = self._storeys(design, beside, small, hall)
        large = self._shape.area > _FLAT_FROM or storeys >= _FLAT_STOREYS
        flat_kind = not barn and (small or hall or large)
        if not said and flat_kind:
            roof = "flat"
        flat, plain = roof == "flat", barn or small or hall or self._kind in _SACRED
        roofing = rules.flat_roof_materials if flat else rules.roof_materials
        pitch = draws.within("mapped pitch", rules.roof_pitch)
        design = replace(
            design,
            style=design.style if rules.style == "hall" else "detached",
            storeys=storeys,
            storey_height=2.6 if small else design.storey_height,
            roof=roof,
            slope=_ROUND_SLOPES.get(
                roof, math.tan(math.radians(min(pitch, 14.0) if roof == "shed" else pitch))
            ),
            overhang=0.0 if flat or roof in _ROUND_SLOPES else min(design.overhang, _OVERHANG),
            parapet=0.0 if small or not flat else max(design.parapet, 0.4),
            wall_material=self._material("walls", rules.materials, "mapped wall"),
            roof_material=self._material("roofing", roofing, "mapped roof"),
            chimney=None if small or flat else design.chimney,
            extras=self._extras(design, beside, plain=plain),
        )
        design = replace(design, width=size[0], depth=size[1])
        if self._is_body:
            design = self._as_body(design)
        return self._with_height(self._with_roof_height(design))

    def _as_body(self, design: Design) -> Design:
        """A body meets those around it: no parapet, no eaves, and the plinth of its building."""
        extras = design.extras
        if self._raised:
            extras = Extras(embrasure=extras.embrasure)
        return replace(
            design,
            raised=self._raised,
            plinth=_PLINTH,
            parapet=0.0,
            overhang=0.0,
            extras=extras,
            chimney=None,
        )

    def _with_roof_height(self, design: Design) -> Design:
        """A design whose roof rises as high as the map says."""
        wanted = float(self._houses.roof_heights[self._number])
        usual = ridge_rise(design)
        if not np.isfinite(wanted) or design.roof in _LEVEL or usual <= 0.0:
            return design
        if np.isfinite(self._height):
            wanted = min(wanted, self._height)
        slope = min(max(design.slope * wanted / usual, _SLOPES[0]), _SLOPES[1])
        # Eaves of a spire would lift its top.
        return replace(design, slope=slope, overhang=0.0 if slope > _SPIRE else design.overhang)

    def _extras(self, design: Design, beside: Surroundings, *, plain: bool) -> Extras:
        """What the environment gives its houses, and shops where the map has them."""
        drawn, fittings = design.extras, design.extras.fittings
        shop = (beside.shops is not None and len(beside.shops) > 0) or self._kind in _SHOPS
        if plain:
            own = Fittings(gutters=fittings.gutters and self._kind not in _SMALL, shop=shop)
            return Extras(embrasure=drawn.embrasure, fittings=own)
        wanted = shop or (beside.shops is None and fittings.shop)
        own = replace(fittings, shop=shop or (wanted and self._shape.area > _LEAST_SHOP))
        return replace(drawn, wings=(), bay=None, garage=0.0, fittings=own)

    def _storeys(self, design: Design, beside: Surroundings, small: bool, hall: bool) -> int:
        said = float(self._houses.storeys[self._number])
        if np.isfinite(said):
            return max(round(said), 1)
        height = self._height
        if np.isfinite(height):
            return max(round(height * 0.85 / design.storey_height), 1)
        self.drawn.append("height")
        if small or self._kind in _BARNS:
            return 1
        most = 3 if hall else design.storeys
        if not hall and self._shape.area < _VILLA_AREA and self._is_free(beside):
            most = _VILLA_STOREYS
        return max(min(design.storeys, most), 1)

    def _is_free(self, beside: Surroundings) -> bool:
        """True for a building that touches no other one."""
        corners = shapely.get_coordinates(shapely.orient_polygons(self._shape).exterior)
        return not any(beside.blind(a, b) for a, b in pairwise(corners))

    def _with_height(self, design: Design) -> Design:
        """A design whose top has the height of the map, with storeys of usual height."""
        height = self._height
        if not np.isfinite(height):
            return design
        rise = ridge_rise(design)
        least = 0.0 if self._is_body else max(0.5 * height, 2.2)
        eaves = max(height - rise, least, 0.2)
        storeys = design.storeys
        if not _STOREY_HEIGHTS[0] <= eaves / storeys <= _STOREY_HEIGHTS[1]:
            storeys = max(round(eaves / design.storey_height), 1)
        return replace(design, storeys=storeys, storey_height=eaves / storeys)

    def _material(self, key: str, weights: Mapping[str, float], name: str) -> str:
        """A material of the family that the map names, else of the environment."""
        family = str(getattr(self._houses, key)[self._number])
        whole = self._rules.materials if key == "walls" else self._rules.roof_materials
        fitting = [
            {n: w for n, w in each.items() if family and n.startswith(family)}
            for each in (weights, whole)
        ]
        return self._draws.choice(name, next(filter(None, fitting), weights))


def _house(
    name: str,
    design: Design,
    outline: Outline,
    land: tuple[float, float],
    beside: Surroundings,
) -> tuple[CityObject, tuple[str, ...]]:
    """The environment's house on a rectangle, and what of it had no room."""
    front, back = beside.room(*outline.side(0)), beside.room(*outline.side(2))
    extras = design.extras
    fittings = replace(extras.fittings, balcony=extras.fittings.balcony and front > _BALCONY)
    extras = replace(extras, balconies=extras.balconies and back > _BALCONY, fittings=fittings)
    a, b = outline.side(0)
    out = np.array([outline.along[1], -outline.along[0]])
    height = None
    if beside.ground is not None:
        height = float(beside.ground(((a + b) / 2.0 + 0.5 * out)[None])[0])
    site = Site(outline.origin, outline.along, *land, street=height, room=front)
    return make_building(name, replace(design, extras=extras), site)


def _row(outline: Outline, beside: Surroundings) -> bool | None:
    """True with a neighbour at the left or right, `None` with one elsewhere."""
    hit = [beside.blind(*outline.side(n)) for n in range(4)]
    hit[0] |= not beside.doors(*outline.side(0))
    return None if hit[0] or hit[2] else hit[1] or hit[3]


def _sides(outline: Outline) -> tuple[list[FloatArray], list[FloatArray]]:
    """Starts and ends of the sides of a rectangle."""
    starts, ends = zip(*(outline.side(n) for n in range(4)), strict=True)
    return list(starts), list(ends)


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

"""The map of a real place: its streets as a road file."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from pyproj import Transformer

from envgen_usd.chunks import Chunk
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.given_buildings import GivenBuildings
from envgen_usd.city.plots.mapped_buildings import build_mapped
from envgen_usd.city.plots.mapped_gardens import MapGardens, enclose_houses
from envgen_usd.city.plots.mapped_objects import MapLand, make_mapped_objects
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.executors.executor import ALONE, LocalProcesses
from envgen_usd.geometry.mirrored_opendrive import mirrored_points
from envgen_usd.geometry.raster_part import PlacedPoints
from envgen_usd.landuse.house_plots import PlotHouses
from envgen_usd.landuse.landuse_provider import LanduseProvider
from envgen_usd.landuse.mapped_landuse import MappedLanduse
from envgen_usd.landuse.osm_land_tags import has_landuse
from envgen_usd.landuse.osm_landuse import read_osm
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, Plot
from envgen_usd.models.place import Houses, Place, Shapes
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.models.street_plan import StreetPlan, StreetPoint
from envgen_usd.places.building_bodies import with_bodies
from envgen_usd.places.building_figures import main_buildings
from envgen_usd.places.driving_side import left_hand_reason
from envgen_usd.places.map_elements import count_elements
from envgen_usd.places.mirrored_streets import mirrored_extract, mirrored_plan
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.places.osm_streets import StreetExtract, read_street_extract
from envgen_usd.places.osm_tags import RESIDENTIAL_KINDS
from envgen_usd.places.street_chains import street_plan
from envgen_usd.recipe.build_options import ROAD_FILE, LandOptions
from envgen_usd.step_clock import Clock
from envgen_usd.streets.mapped_roads import MappedRoads, mapped_roads
from envgen_usd.streets.mirrored_roads import mirrored_roads
from envgen_usd.streets.national_signs import with_national_signs
from envgen_usd.terrain.dem_geotiff import read_model
from envgen_usd.whole_files import write_whole

FILLS = ("all", "missing", "none")
"""What may be generated beside a map."""
_GENERATED: Mapping[str, str] = {
    "tree": "street_tree",
    "lamp": "street_light",
    **{kind: kind for kind in ("bench", "bin", "bollard", "hydrant", "mailbox", "bicycle_rack")},
}
"""Kind that is generated beside roads for each kind of the map."""
_APART: Mapping[str, float] = {
    "street_tree": 60.0,
    "street_light": 120.0,
    **dict.fromkeys(("bench", "bin", "bollard", "hydrant", "mailbox", "bicycle_rack"), 400.0),
}
"""Metres of road for each object of the map from which none are generated; larger: fewer are."""
_BESIDE = 20.0
"""Farthest object of the map from the reference line of a road that has it, metres."""
_REPLACED = 0.1
"""Share of a footprint that buildings of a city model have to cover to take its place."""
_HOMES = frozenset({"", "yes", "farm", "villa", "semi", *RESIDENTIAL_KINDS})
"""Kinds of buildings with plots; those of unknown kind are homes where no industry is."""
_GARAGES = ("garage", "garages", "carport")
_SIDES = 4
_LEAST_AREA = 1e-6
"""Twice the least area of a triangle of the road in plan, m²; kerbs are vertical."""


@dataclass(frozen=True, eq=False)
class MappedPlace:
    """A map and the road file that it becomes.

    Attributes:
        file: The extract.
        plan: Its streets.
        place: Its buildings and what stands between them, in the road frame; `None` without any.
        xodr: OpenDRIVE of its streets.
        issues: What was left out or decided.
        counts: What was read and made, by name.
        land: Points of the map beyond the borders of roads.
    """

    file: Path
    plan: StreetPlan
    place: Place | None
    xodr: bytes
    issues: tuple[Issue, ...]
    counts: Mapping[str, int]
    land: tuple[StreetPoint, ...] = ()

    def write_road(self, folder: Path) -> Path:
        """Writes the road file into a folder and returns its path."""
        path = folder / ROAD_FILE
        write_whole(path, self.xodr)
        return path

    def landuse(self, fill: str) -> MappedLanduse:
        """The landuse of the map, with plots of its houses where they may be generated."""
        extract = read_osm(self.file, self.plan.crs)
        if self.place is None:
            return MappedLanduse(extract, np.empty(0, object))
        main = main_buildings(self.place.houses)
        lived_in = np.isin(main.kinds, sorted(_HOMES)) & (main.landuse != "industrial")
        houses = PlotHouses(main.footprints, lived_in) if fill == "missing" else None
        return MappedLanduse(extract, self.place.houses.footprints, houses)


def read_mapped_place(options: LandOptions, clock: Clock) -> MappedPlace:
    """Reads the extract of the options and makes roads of its streets; writes no files.

    Raises:
        EnvgenError: The extract, the part of it or its size is unusable.
    """
    path = options.osm
    if path is None:
        raise EnvgenError("--osm: no extract given")
    if options.fill not in FILLS:
        raise EnvgenError(f"--fill {options.fill}: unknown; choose from {', '.join(FILLS)}")
    bounds = _bounds(options.bbox)
    with clock.step("streets"):
        extract = read_street_extract(path, bounds, options.max_area)
        plan, roads = _roads(extract, path, options)
        elements = count_elements(path, has_landuse, bounds)
    place = _place(path, plan) if extract.buildings else None
    counted = tuple(elements.issues(path.name))
    issues = (*roads.issues, *(place.issues if place else ()), *counted)
    return MappedPlace(path, plan, place, roads.xml, issues, roads.counts, roads.land)


def _roads(
    extract: StreetExtract, path: Path, options: LandOptions
) -> tuple[StreetPlan, MappedRoads]:
    """The streets of an extract, and their road file, on the side on which traffic drives."""
    reason, name = left_hand_reason(extract, options.driving_side), path.name.split(".")[0]
    if not reason:
        plan = street_plan(extract, path, options.country)
        ground = _ground(options.heightmap, plan) if options.heightmap else None
        return plan, with_national_signs(mapped_roads(plan, name, ground), options.country)
    image = street_plan(mirrored_extract(extract), path, options.country)
    plan = mirrored_plan(image)
    ground = _ground(options.heightmap, plan) if options.heightmap else None

    def image_ground(points: FloatArray) -> FloatArray:
        assert ground is not None
        return ground(mirrored_points(points))

    roads = mirrored_roads(mapped_roads(image, name, image_ground if ground else None))
    roads = with_national_signs(roads, options.country)
    issue = Issue(
        "osm.driving_side", Severity.INFO, path.name, reason, "roads for traffic on the left"
    )
    return plan, replace(roads, issues=(*roads.issues, issue))


def _place(path: Path, plan: StreetPlan) -> Place:
    """Buildings and what stands between them, in the reference system of the streets."""
    place = with_bodies(read_osm_place(path))
    move = Transformer.from_crs(place.crs, plan.crs, always_xy=True).transform

    def moved(points: FloatArray) -> FloatArray:
        return np.column_stack(move(*points.T)) if len(points) else points

    def shapes(geometries: Shapes) -> Shapes:
        turned: Shapes = shapely.transform(geometries, moved)
        return turned

    return replace(
        place,
        houses=replace(place.houses, footprints=shapes(place.houses.footprints)),
        streets=replace(place.streets, lines=shapes(place.streets.lines)),
        barriers=shapes(place.barriers),
        trees=moved(place.trees),
        lamps=moved(place.lamps),
        shops=moved(place.shops),
        crs=plan.crs,
    )


def buildings_of_map(  # noqa: PLR0913, PLR0917 - what buildings follow from
    place: MappedPlace,
    heightmaps: Mapping[Chunk, HeightMap],
    surface: RoadSurface,
    profile: Profile,
    options: LandOptions,
    model: GivenBuildings | None = None,
    executor: LocalProcesses = ALONE,
) -> GivenBuildings | None:
    """The buildings of the map on the ground, or `None` where they are to be generated.

    Those of a city model come first: buildings of the map stand where it has none.
    """
    if options.fill == "all":
        return model
    first, *others = heightmaps.values()
    ground, built = Ground(first, others), City((), surface.crs, surface.offset)
    if place.place is not None:
        bounds = np.array([chunk.bounds for chunk in heightmaps])
        part = place.place.within((*bounds[:, :2].min(0).tolist(), *bounds[:, 2:].max(0).tolist()))
        shops = part.shops if len(place.place.shops) else None
        houses, replaced = _beside_model(part.houses, model, place.file.name)
        found = build_mapped(
            houses,
            ground,
            _triangles(surface),
            profile.buildings,
            options.seed,
            place.file.name,
            shops,
            executor,
        )
        built = City(found.buildings, surface.crs, surface.offset, (*found.issues, *replaced))
    given = GivenBuildings(built)
    made = len(given)
    given.keep(heightmaps)
    if place.place is not None and (away := len(place.place.houses) - len(part.houses)):
        given.issues = (*given.issues, _beyond(away + made - len(given), place.file.name))
    return given if model is None else model.joined(given)


def _beyond(count: int, source: str) -> Issue:
    text = f"{count} buildings lie beyond the land around the roads"
    return Issue("osm.building_beyond", Severity.INFO, source, text, "left out")


def _beside_model(
    houses: Houses, model: GivenBuildings | None, source: str
) -> tuple[Houses, tuple[Issue, ...]]:
    """The houses that a city model does not have, and how many it has."""
    if model is None:
        return houses, ()
    tree = shapely.STRtree(model.footprints())
    house, other = tree.query(houses.footprints, predicate="intersects")
    shared = shapely.intersection(houses.footprints[house], tree.geometries[other])
    covered = np.bincount(house, shapely.area(shared), len(houses))
    there = covered > _REPLACED * shapely.area(houses.footprints)
    text = f"{there.sum()} of {len(houses)} buildings stand where the city model has some"
    issue = Issue("osm.building_replaced", Severity.INFO, source, text, "the model's are used")
    return houses.take(~there), (issue,)


def _water(heightmaps: Iterable[HeightMap]) -> FloatArray:
    """Corners of the grid that are water, N x 2, metres."""
    places = [np.empty((0, 2))]
    for each in heightmaps:
        if each.water is not None:
            x, y = np.meshgrid(*each.chunk.corner_axes())
            wet = each.heights <= each.water.levels
            places.append(np.stack([x[wet], y[wet]], axis=1))
    return np.concatenate(places)


def add_objects_of_map(  # noqa: PLR0913, PLR0917 - what objects follow from
    given: GivenBuildings,
    place: MappedPlace,
    heightmaps: Mapping[Chunk, HeightMap],
    surface: RoadSurface,
    profile: Profile,
    options: LandOptions,
) -> None:
    """Adds what stands between the buildings: trees, lamps, furniture, hedges, fences, walls."""
    first, *others = heightmaps.values()
    lines = np.concatenate([line.points[:, :2] for line in surface.roads])
    land = MapLand(
        Ground(first, others),
        frozenset(heightmaps),
        _triangles(surface),
        lines,
        given.footprints(),
        _water(heightmaps.values()),
    )
    gates = [point for point in place.plan.points if point.kind == "gate"]
    found = make_mapped_objects(
        place.land, place.plan.lines, gates, land, profile, options.seed, place.file.name
    )
    furnished = _furnished(place.plan, surface) if options.fill == "missing" else {}
    given.add(found.objects, furnished, found.issues)


def add_plots_of_houses(
    given: GivenBuildings,
    place: MappedPlace,
    landuse: LanduseProvider,
    plots: Sequence[Plot],
    heightmaps: Mapping[Chunk, HeightMap],
) -> None:
    """Adds the plots of the map's houses with the ways into them, and the map's own ways."""
    if place.place is None or not isinstance(landuse, MappedLanduse) or landuse.houses is None:
        return
    extract, houses = landuse.extract, place.place.houses
    pairs = zip(extract.shapes, extract.classes, strict=True)
    parks = [shape for shape, kind in pairs if kind == LanduseClass.PARK]
    garages = houses.footprints[np.isin(houses.kinds, _GARAGES)]
    of_map = MapGardens(place.place.barriers, np.array([*parks, None], object)[:-1], garages)
    first, *others = heightmaps.values()
    ground, buildings = Ground(first, others), given.buildings()
    found = enclose_houses(plots, buildings, given.footprints(), of_map, ground, place.file.name)
    ways = [path.ground() for path in extract.paths]
    given.add_plots(found.enclosed, ways, found.issues)


def _triangles(surface: RoadSurface) -> FloatArray:
    """Triangles of the road in plan without vertical ones, T x 3 x 2."""
    triangles: FloatArray = surface.vertices[surface.triangles][:, :, :2]
    sides = triangles[:, 1:] - triangles[:, :1]
    areas = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    return triangles[areas > _LEAST_AREA]


def _furnished(plan: StreetPlan, surface: RoadSurface) -> dict[str, frozenset[str]]:
    """Roads that have enough objects of a kind on the map, by the kind that is generated."""
    found = {}
    roads = [line for line in surface.roads if not line.junction]
    tree = shapely.STRtree([shapely.LineString(line.points[:, :2]) for line in roads])
    for kind, template in _GENERATED.items():
        places = [point.place for point in plan.points if point.kind == kind]
        if not places:
            continue
        points = shapely.points(np.array(places))
        _, hit = tree.query(points, predicate="dwithin", distance=_BESIDE)
        counts = np.bincount(hit, minlength=len(roads))
        lengths = np.array([float(np.ptp(line.s)) for line in roads])
        enough = counts * _APART[template] >= np.maximum(lengths, 1.0)
        found[template] = frozenset(
            road.road for road, is_so in zip(roads, enough, strict=True) if is_so
        )
    return found


def _bounds(values: tuple[float, ...]) -> tuple[float, float, float, float] | None:
    if not values:
        return None
    shown = ",".join(f"{value:g}" for value in values)
    if len(values) != _SIDES or not all(np.isfinite(values)):
        raise EnvgenError(f"--bbox {shown}: give four numbers of degrees, west,south,east,north")
    west, south, east, north = values
    if not (-180.0 <= west < east <= 180.0 and -90.0 <= south < north <= 90.0):
        raise EnvgenError(
            f"--bbox {shown}: west has to be less than east and south less than north, within 180"
            " and 90 degrees"
        )
    return west, south, east, north


def _ground(path: Path, plan: StreetPlan) -> Callable[[FloatArray], FloatArray]:
    """Heights of the land, with which the streets are made."""
    lines = np.concatenate([street.line for street in plan.streets])
    return read_model(path, PlacedPoints(lines, plan.crs))

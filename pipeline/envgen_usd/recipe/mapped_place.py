"""The map of a real place: its streets as a road file."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from pyproj import Transformer

from envgen_usd.chunks import Chunk
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.given_buildings import GivenBuildings
from envgen_usd.city.plots.mapped_buildings import build_mapped
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.geometry.raster_part import PlacedPoints
from envgen_usd.landuse.mapped_landuse import MappedLanduse
from envgen_usd.landuse.osm_landuse import read_osm
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.building_rules import BuildingRules
from envgen_usd.models.city_model import City
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.place import Place, Shapes
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.models.street_plan import StreetPlan
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.places.osm_streets import read_street_extract
from envgen_usd.places.street_chains import street_plan
from envgen_usd.recipe.build_options import ROAD_FILE, LandOptions
from envgen_usd.step_clock import Clock
from envgen_usd.streets.mapped_roads import mapped_roads
from envgen_usd.terrain.dem_geotiff import read_model
from envgen_usd.whole_files import write_whole

FILLS = ("all", "missing", "none")
"""What may be generated beside a map."""
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
    """

    file: Path
    plan: StreetPlan
    place: Place | None
    xodr: bytes
    issues: tuple[Issue, ...]
    counts: Mapping[str, int]

    def write_road(self, folder: Path) -> Path:
        """Writes the road file into a folder and returns its path."""
        path = folder / ROAD_FILE
        write_whole(path, self.xodr)
        return path

    def landuse(self) -> MappedLanduse:
        """The landuse of the map."""
        footprints = np.empty(0, object) if self.place is None else self.place.houses.footprints
        return MappedLanduse(read_osm(self.file, self.plan.crs), footprints)


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
        plan = street_plan(extract, path, options.country)
        ground = _ground(options.heightmap, plan) if options.heightmap else None
        roads = mapped_roads(plan, path.name.split(".")[0], ground)
    place = _place(path, plan) if extract.buildings else None
    issues = (*roads.issues, *(place.issues if place else ()))
    return MappedPlace(path, plan, place, roads.xml, issues, roads.counts)


def _place(path: Path, plan: StreetPlan) -> Place:
    """Buildings and what stands between them, in the reference system of the streets."""
    place = read_osm_place(path)
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


def buildings_of_map(
    place: MappedPlace,
    heightmaps: Mapping[Chunk, HeightMap],
    surface: RoadSurface,
    rules: BuildingRules,
    options: LandOptions,
) -> GivenBuildings | None:
    """The buildings of the map on the ground, or `None` where they are to be generated."""
    if place.place is None or options.fill == "all" or options.city is not None:
        return None
    bounds = np.array([chunk.bounds for chunk in heightmaps])
    box = (*bounds[:, :2].min(0).tolist(), *bounds[:, 2:].max(0).tolist())
    part = place.place.within(box)
    first, *others = heightmaps.values()
    triangles = surface.vertices[surface.triangles][:, :, :2]
    sides = triangles[:, 1:] - triangles[:, :1]
    areas = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    built = build_mapped(
        part.houses,
        Ground(first, others),
        triangles[areas > _LEAST_AREA],
        rules,
        options.seed,
        place.file.name,
        part.shops if len(place.place.shops) else None,
    )
    given = GivenBuildings(City(built.buildings, surface.crs, surface.offset, built.issues))
    given.keep(heightmaps)
    return given


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

"""The city model of a whole map in a single file, without a stage."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from envgen_usd.city.buildings.level_of_detail import Modelling
from envgen_usd.city.generate import build_city, pave_ways, plan_city
from envgen_usd.city.roads.road_city import FULL_DETAIL, build_road_city
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.city.roads.traffic_spaces import RoadDetail
from envgen_usd.citygml.write import write_features
from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.errors import Issue
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.models.environment_profile import Profile
from envgen_usd.recipe.build_inputs import read_land_inputs
from envgen_usd.recipe.build_options import LandOptions
from envgen_usd.recipe.map_land import Land, lay_out_land, read_road
from envgen_usd.step_clock import Clock, Progress
from envgen_usd.terrain.ground_mesh import build_ground
from envgen_usd.whole_files import make_folder


@dataclass(frozen=True)
class CityOptions:
    """Content of a city model besides roads and the features of the road file.

    Attributes:
        roads: Options of the roads.
        buildings: Options of the buildings; `None` generates no features beside the road.
        land: True to include landuse and relief.
        version: CityGML version, ``3.0`` or ``2.0``.
    """

    roads: RoadDetail = FULL_DETAIL
    buildings: Modelling | None = None
    land: bool = False
    version: str = "3.0"


def write_whole_city(
    options: LandOptions,
    model: CityOptions,
    path: Path,
    progress: Progress = lambda *_: None,
) -> tuple[Issue, ...]:
    """Writes a road with its surroundings as a single file; roads are not cut at chunk borders.

    Args:
        options: Options of the road and of the land around it.
        model: Content of the file.
        path: CityGML or, where it ends in ``.json``, CityJSON 2.0.
        progress: Called at each step.

    Returns:
        Repairs, decisions and omissions in the input, and parts of buildings without room.

    Raises:
        EnvgenError: An input is unusable, or the version is unknown.
    """
    clock = Clock(progress)
    profile = read_land_inputs(options)
    left_out: list[Issue] = []
    needs_land = model.buildings is not None or model.land or options.city is not None
    if needs_land:
        land = lay_out_land(options, profile, clock)
        surface, issues = land.surface, land.issues
        features = _features(_with_land(land, profile, options.seed, model), left_out)
    else:
        with clock.step("road"):
            road, surface = read_road(options.road, options.tolerance, profile.road)
        issues = (*road.network.issues, *surface.issues)
        features = iter(build_road_city(surface, profile, model.roads, options.seed).objects)
    make_folder(path.parent)
    with clock.step("city"):
        if path.suffix.lower() == ".json":
            write_cityjson(City(tuple(features), surface.crs, surface.offset), path)
        else:
            write_features(features, path, surface.crs, surface.offset, model.version)
    return (*issues, *left_out)


def _features(parts: Iterable[City], issues: list[Issue]) -> Iterator[CityObject]:
    """Features one after the other; `issues` takes those of the parts."""
    for part in parts:
        issues.extend(part.issues)
        yield from part.objects


def _with_land(land: Land, profile: Profile, seed: int, model: CityOptions) -> Iterator[City]:
    """Yields the roads, then all other features chunk by chunk."""
    yield build_road_city(land.surface, profile, model.roads, seed)
    roads, outline = RoadIndex(land.surface), Outline.of(land.surface)
    for chunk in land.chunks:
        maps = land.of(chunk)
        plan = plan_city(
            chunk,
            maps.plots,
            roads,
            maps.heightmap,
            profile,
            seed,
            maps.around,
            maps.buildings,
            model.buildings or Modelling(),
        )
        landuse = pave_ways(plan, maps.landuse)
        has_walls = model.buildings is not None and maps.heightmap.water is not None
        needs_ground = model.land or has_walls
        ground = build_ground(maps.heightmap, outline, landuse) if needs_ground else None
        relief, walls = ground if model.land else None, ground if has_walls else None
        city = build_city(plan, landuse, profile, relief, walls=walls, roads=False)
        if model.buildings is not None:
            yield city
        else:
            given = () if maps.buildings is None else city.of_kind("Building")
            yield City((*given, *city.of_kind("LandUse", "ReliefFeature")))

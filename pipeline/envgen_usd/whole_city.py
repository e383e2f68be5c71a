"""The whole environment of a road as one city model, without a stage."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from envgen_usd.chunks import chunks_of_points
from envgen_usd.city.building import Modelling
from envgen_usd.city.generate import CityDetail, build_city, pave_ways
from envgen_usd.city.road_city import FULL_DETAIL, build_road_city
from envgen_usd.city.traffic_spaces import RoadDetail
from envgen_usd.citygml.write import write_features
from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.land import land_beside
from envgen_usd.landuse.plots import find_plots
from envgen_usd.landuse.rules import RuleProvider
from envgen_usd.models.city import City, CityObject
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface
from envgen_usd.terrain.ground import build_ground
from envgen_usd.terrain.heightmap import build_heightmaps


@dataclass(frozen=True)
class CityOptions:
    """What a city model is to hold besides roads and the features of the road file.

    Attributes:
        roads: How roads are modelled.
        buildings: How buildings are modelled; none: nothing is generated beside the road.
        land: True if landuse and relief are there.
        seed: Every random draw follows from it.
        version: Of CityGML, ``3.0`` or ``2.0``.
    """

    roads: RoadDetail = FULL_DETAIL
    buildings: Modelling | None = None
    land: bool = False
    seed: int = 0
    version: str = "3.0"


def write_whole_city(
    surface: RoadSurface, profile: Profile, options: CityOptions, path: Path
) -> None:
    """Writes a road with what stands beside it as one file, of which no chunk cuts the roads.

    Args:
        surface: The road.
        profile: The environment.
        options: What the file is to hold.
        path: CityGML or, where it ends in ``.json``, CityJSON 2.0.

    Raises:
        EnvgenError: The version is unknown.
    """
    features = city_features(surface, profile, options)
    if path.suffix.lower() == ".json":
        write_cityjson(City(tuple(features), surface.crs, surface.offset), path)
    else:
        write_features(features, path, surface.crs, surface.offset, options.version)


def city_features(
    surface: RoadSurface, profile: Profile, options: CityOptions
) -> Iterator[CityObject]:
    """Returns the features of a map one after the other, those beside the roads chunk by chunk.

    Args:
        surface: The road.
        profile: The environment.
        options: What is wanted.
    """
    yield from build_road_city(surface, profile, options.roads).objects
    if options.buildings is None and not options.land:
        return
    chunks = chunks_of_points(surface.vertices, land_beside(profile.plots))
    maps = RuleProvider().generate(surface, chunks, profile, options.seed)
    plots = find_plots(maps, surface)
    rules = profile.terrain
    heightmaps = build_heightmaps(surface, chunks, rules, options.seed, plots=plots)
    for chunk in chunks:
        around = (heightmaps[near] for near in chunk.neighbours() if near in heightmaps)
        level = heightmaps[chunk]
        landuse = pave_ways(chunk, plots, surface, level, maps[chunk], profile, options.seed)
        ground = build_ground(level, surface, landuse) if options.land else None
        made = build_city(
            chunk,
            plots,
            surface,
            level,
            landuse,
            profile,
            options.seed,
            around,
            ground,
            detail=CityDetail(options.buildings or Modelling(), roads=False),
        )
        kept = made.objects
        if options.buildings is None:
            kept = made.of_kind("LandUse", "ReliefFeature")
        yield from kept

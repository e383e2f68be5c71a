"""A town on given streets as plain figures: what an environment makes of them, without a stage."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from envgen_usd.chunks import HEIGHT_SAMPLES, Chunk, chunks_of_points
from envgen_usd.city.buildings.building_outline import footprint
from envgen_usd.city.generate import plan_city
from envgen_usd.city.plots.building_plans import PlannedBuilding
from envgen_usd.city.plots.given_buildings import chunk_of
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.landuse.landuse_provider import LanduseProvider
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.plot_index import PlotIndex
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.models.place import Houses, Place, Streets
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.places.street_roads import road_text
from envgen_usd.recipe.map_land import read_road

_TOLERANCE = 0.1
"""Chord error of the road's surface, metres: buildings stand farther from it than that."""


@dataclass(frozen=True)
class Town:
    """A generated town.

    Attributes:
        place: Its buildings and streets, as they are read of a map.
        surface: Its roads.
        maps: Landuse of each chunk.
        plots: Plots of the whole town.
    """

    place: Place
    surface: RoadSurface
    maps: Mapping[Chunk, LanduseMap]
    plots: tuple[Plot, ...]


def generated_town(
    streets: Streets, profile: Profile, seed: int, landuse: LanduseProvider | None = None
) -> Place:
    """The town that an environment makes on streets: a place as it is read of a map.

    The streets become an OpenDRIVE file, and the steps of a build lay out plots and buildings on
    level ground.

    Args:
        streets: Streets, in metres.
        profile: The environment.
        seed: Seed of all draws.
        landuse: Lays out the plots; `None`: the rules.

    Raises:
        EnvgenError: There are no streets.
    """
    return town_on_streets(streets, profile, seed, landuse).place


def town_on_streets(
    streets: Streets, profile: Profile, seed: int, landuse: LanduseProvider | None = None
) -> Town:
    """As `generated_town`, with its plots.

    Raises:
        EnvgenError: There are no streets.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "streets.xodr"
        path.write_text(road_text(streets), encoding="utf-8")
        _, surface = read_road(path, _TOLERANCE, profile.road)
    return town_beside(surface, streets, profile, seed, landuse=landuse)


def town_beside(  # noqa: PLR0913 - what a town follows from
    surface: RoadSurface,
    streets: Streets,
    profile: Profile,
    seed: int,
    chunks: Sequence[Chunk] | None = None,
    *,
    landuse: LanduseProvider | None = None,
) -> Town:
    """The town that an environment makes beside roads.

    Args:
        surface: Road surfaces.
        streets: The same roads in plan, for figures.
        profile: The environment.
        seed: Seed of all draws.
        chunks: Chunks of the town; `None`: those near the roads.
        landuse: Lays out the plots; `None`: the rules.
    """
    chunks = chunks or chunks_of_points(surface.vertices, land_beside(profile))
    maps = (landuse or RuleProvider()).generate(surface, chunks, profile, seed)
    plots = find_plots(maps, surface)
    by_place = PlotIndex(plots)
    roads = RoadIndex(surface)
    level = np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES))
    planned: list[PlannedBuilding] = []
    for chunk in chunks:
        near = by_place.touching(chunk)
        plan = plan_city(chunk, near, roads, HeightMap(chunk, level), profile, seed)
        planned += [b for b in plan.buildings if chunk_of(shapely.Polygon(b.plot.polygon)) == chunk]
    place = Place(
        f"{profile.country}/{profile.area}",
        _houses(planned, profile.buildings.function),
        streets,
        np.empty((0, 2)),
        np.empty((0, 2)),
        np.empty(0, object),
        np.empty(0, np.str_),
    )
    return Town(place, surface, maps, plots)


def streets_of(surface: RoadSurface) -> Streets:
    """All roads in plan, as wide as they are with their sidewalks."""
    roads = [line for line in surface.roads if len(line.s) > 1]
    middles = [(line.left_border() + line.right_border()) / 2.0 for line in roads]
    widths = [float(np.median(line.t_left - line.t_right)) for line in roads]
    count = len(roads)
    return Streets(
        np.array([shapely.LineString(middle) for middle in middles], object),
        np.array(widths),
        np.ones(count, bool),
        np.full(count, np.nan),
        np.full(count, np.nan),
    )


_KINDS = {
    LanduseClass.GARAGES: "garages",
    LanduseClass.SHOP: "retail",
    LanduseClass.SCHOOL: "school",
}
"""Kind of the building on a whole plot with a use, as a map tags it."""


def _houses(planned: list[PlannedBuilding], landuse: str) -> Houses:
    words = np.full(len(planned), "", np.str_)
    kinds = np.array([_KINDS.get(building.plot.landuse, "") for building in planned], np.str_)
    return Houses(
        np.array(list(_outlines(planned)), object),
        np.full(len(planned), np.nan),
        np.array([float(building.design.storeys) for building in planned]),
        kinds,
        np.array([landuse] * len(planned), np.str_),
        np.array([building.design.roof for building in planned], np.str_),
        words,
        words,
    )


def _outlines(planned: list[PlannedBuilding]) -> Iterator[shapely.Polygon]:
    """Walls of each building in plan."""
    for building in planned:
        ring = np.array(footprint(building.design, 0.0))[:, :2]
        into = np.array([-building.along[1], building.along[0]])
        yield shapely.Polygon(building.origin + ring @ np.stack([building.along, into]))

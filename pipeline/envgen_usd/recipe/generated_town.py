"""A town on given streets as plain figures: what an environment makes of them, without a stage."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely

from envgen_usd.chunks import HEIGHT_SAMPLES, chunks_of_points
from envgen_usd.city.buildings.building_outline import footprint
from envgen_usd.city.generate import plan_city
from envgen_usd.city.plots.building_placement import PlannedBuilding
from envgen_usd.city.plots.given_buildings import chunk_of
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.plot_index import PlotIndex
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.place import Houses, Place, Streets
from envgen_usd.places.street_roads import road_text
from envgen_usd.recipe.map_land import land_beside, read_road

_TOLERANCE = 0.1
"""Chord error of the road's surface, metres: buildings stand farther from it than that."""


def generated_town(streets: Streets, profile: Profile, seed: int) -> Place:
    """The town that an environment makes on streets: a place as it is read of a map.

    The streets become an OpenDRIVE file, and the steps of a build lay out plots and buildings on
    level ground.

    Args:
        streets: Streets, in metres.
        profile: The environment.
        seed: Seed of all draws.

    Raises:
        EnvgenError: There are no streets.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "streets.xodr"
        path.write_text(road_text(streets), encoding="utf-8")
        _, surface = read_road(path, _TOLERANCE, profile.road.marks)
    chunks = chunks_of_points(surface.vertices, land_beside(profile.plots))
    maps = RuleProvider().generate(surface, chunks, profile, seed)
    plots = PlotIndex(find_plots(maps, surface))
    roads = RoadIndex(surface)
    level = np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES))
    planned: list[PlannedBuilding] = []
    for chunk in chunks:
        plan = plan_city(
            chunk, plots.touching(chunk), roads, HeightMap(chunk, level), profile, seed
        )
        planned += [b for b in plan.buildings if chunk_of(shapely.Polygon(b.plot.polygon)) == chunk]
    return Place(
        f"{profile.country}/{profile.area}",
        _houses(planned, profile.buildings.function),
        streets,
        np.empty((0, 2)),
        np.empty((0, 2)),
        np.empty(0, object),
        np.empty(0, np.str_),
    )


def _houses(planned: list[PlannedBuilding], landuse: str) -> Houses:
    words = np.full(len(planned), "", np.str_)
    return Houses(
        np.array(list(_outlines(planned)), object),
        np.full(len(planned), np.nan),
        np.array([float(building.design.storeys) for building in planned]),
        words,
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

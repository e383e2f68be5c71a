"""Suburb, city centre and farmland hold what their names say along a straight street."""

from functools import cache
from pathlib import Path

import numpy as np
import shapely

from envgen_usd.chunks import HEIGHT_SAMPLES, Chunk
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.building_plans import PlannedBuilding, plan_buildings
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.models.ground import HeightMap
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface

STRAIGHT = Path(__file__).parents[2] / "asset_library" / "roads" / "straight.xodr"
CHUNKS = [Chunk(x, y) for x in range(-1, 4) for y in (-1, 0)]
ACROSS = (0.0, 200.0)
"""Stretch of the street that is looked at, metres along x."""


@cache
def buildings(area: str) -> tuple[PlannedBuilding, ...]:
    """Buildings at the straight street in an area of country 1."""
    profile = read_profile("1", area)
    surface = build_surface(read_network(STRAIGHT))
    roads = RoadIndex(surface)
    maps = RuleProvider().generate(surface, CHUNKS, profile, 0)
    plots = find_plots(maps, surface)
    planned = {}
    for chunk in CHUNKS:
        ground = Ground(HeightMap(chunk, np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES))))
        plan = RoadPlan(roads.triangles_near(chunk.bounds, 30.0))
        scene = Scene(chunk, roads, plan, Footprints([]), ground, 0)
        for house in plan_buildings(scene, plots, profile.buildings):
            planned[house.name] = house
    return tuple(planned.values())


def houses(area: str) -> tuple[PlannedBuilding, ...]:
    """Buildings at the street itself."""
    return tuple(house for house in buildings(area) if not house.is_behind)


def fronts(area: str) -> list[tuple[float, float, float]]:
    """Start and end along the street of each house near it, and its distance from the axis."""
    boxes = [shapely.bounds(house.footprint) for house in houses(area)]
    near = [(x0, x1, min(abs(y0), abs(y1))) for x0, y0, x1, y1 in boxes]
    return [(x0, x1, y) for x0, x1, y in near if y < 20.0 and x1 > ACROSS[0] and x0 < ACROSS[1]]


def closed_share(area: str) -> float:
    """Share of both sides of the stretch that houses stand along."""
    lengths = [min(x1, ACROSS[1]) - max(x0, ACROSS[0]) for x0, x1, _ in fronts(area)]
    return sum(lengths) / (2 * (ACROSS[1] - ACROSS[0]))


def test_fronts_of_a_city_centre_are_closed_and_those_of_a_suburb_are_open() -> None:
    assert closed_share("city_centre") > 0.75
    assert 0.2 < closed_share("suburb") < 0.65


def test_houses_of_a_suburb_stand_behind_front_gardens() -> None:
    centre, suburb = (
        np.median([y for *_, y in fronts(area)]) for area in ("city_centre", "suburb")
    )
    assert suburb > centre + 3.0


def test_a_city_centre_is_tall_and_has_shops() -> None:
    town, suburb = ([h.design for h in houses(area)] for area in ("city_centre", "suburb"))
    assert min(d.eaves for d in town if d.extras.fittings.shop) > 10.0
    assert np.mean([d.extras.fittings.shop for d in town]) > 0.6
    assert max(d.eaves for d in suburb) < 8.0


def test_farms_are_far_apart_and_have_barns() -> None:
    assert 0.0 < closed_share("agricultural") < 0.25
    farms = {house.plot.id for house in buildings("agricultural") if not house.is_behind}
    barns = {house.plot.id for house in buildings("agricultural") if house.is_behind}
    assert len(barns & farms) > 0.7 * len(farms)

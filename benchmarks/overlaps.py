"""Counts buildings that overlap one another or a road, on the maps of road files.

    python benchmarks/overlaps.py ROAD.xodr [...]

Each file is laid out in every environment. A building counts with its eaves, bays, balconies and
garage; houses of a row share their party walls, which is no overlap.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely

from envgen_usd.chunks import HEIGHT_SAMPLES, chunks_of_points
from envgen_usd.city.buildings.level_of_detail import FINEST_MODELLING
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints, footprint_of
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.building_placement import place_buildings
from envgen_usd.city.plots.building_plans import plan_buildings
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.city.roads.file_features import near_chunk
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.plot_index import PlotIndex
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.recipe.map_land import read_road

MARGIN = 30.0
LEAST_AREA = 1e-6
"""Square metres; less is the grid of coordinates."""


def footprints(surface: RoadSurface, profile: Profile, seed: int) -> Iterator[shapely.Geometry]:
    chunks = chunks_of_points(surface.vertices, land_beside(profile))
    plots = find_plots(RuleProvider().generate(surface, chunks, profile, seed), surface)
    level = np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES))
    roads, by_place = RoadIndex(surface), PlotIndex(plots)
    for chunk in chunks:
        near = by_place.touching(chunk)
        road = RoadPlan(roads.triangles_near(chunk.bounds, MARGIN))
        taken = Footprints([]).joined(near_chunk(roads, chunk))
        ground = Ground(HeightMap(chunk, level))
        scene = Scene(chunk, roads, road, taken, ground, seed, FINEST_MODELLING)
        planned = plan_buildings(scene, near, profile.buildings)
        for building in place_buildings(scene, planned).features:
            yield footprint_of(building)


def overlaps(shapes: list[shapely.Geometry]) -> int:
    found = np.array(shapes, dtype=object)
    one, two = shapely.STRtree(found).query(found, predicate="intersects")
    one, two = one[one < two], two[one < two]
    return int((shapely.area(shapely.intersection(found[one], found[two])) > LEAST_AREA).sum())


def on_road(shapes: list[shapely.Geometry], surface: RoadSurface) -> int:
    on_ground = surface.triangles[surface.triangle_level >= 0]
    found, road = np.array(shapes, dtype=object), shapely.polygons(surface.vertices[on_ground, :2])
    one, two = shapely.STRtree(road).query(found, predicate="intersects")
    touching = shapely.area(shapely.intersection(found[one], road[two])) > LEAST_AREA
    return len(np.unique(one[touching]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("roads", type=Path, nargs="+", help="OpenDRIVE files")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    total = np.zeros(3, dtype=int)
    print("road, environment: buildings, overlaps, on the road")
    for path in options.roads:
        _, surface = read_road(path, 0.02)
        for country, areas in known_environments().items():
            for area in areas:
                shapes = list(footprints(surface, read_profile(country, area), options.seed))
                counts = len(shapes), overlaps(shapes), on_road(shapes, surface)
                total += counts
                print(f"{path.stem}, {country}/{area}: {counts}", flush=True)
    print(f"together: {tuple(total.tolist())}")


if __name__ == "__main__":
    main()

"""Plots of networks beside those of the rules, on the same roads and in the same environments.

`plots` counts plots with houses. `F1 of sizes` pairs them off with plots of the rules of another
seed, whose frontage and depth differ by at most a fifth. `holds` is the share that holds the
rectangle which its site asks for: the one on the site's front, inside of the site. Plots without a
site, at corners, in gaps and inside of blocks, are asked for the least plot of the environment
(`plot_rectangles.py`). A cell of the raster may lack in either direction. `straight` is the share
of the outline along the front, or at right angles to it. Landuse alone is made; nothing is built on
it. Rows are means over the seeds. An extract of OpenStreetMap stands for the streets of its densest
square kilometre.

    python benchmarks/landuse_plots.py ROAD.xodr EXTRACT.osm.gz --network run/weights.safetensors
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from envgen_usd.chunks import Chunk, chunks_of_points
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.landuse.landuse_rules import RuleProvider, fitted_sites
from envgen_usd.landuse.network.data.street_conditions import (
    draw_streets,
    fit_streets,
    street_sites,
)
from envgen_usd.landuse.network.network_provider import NetworkProvider
from envgen_usd.landuse.network.place_provider import PlaceProvider, corner_of, maps_of
from envgen_usd.landuse.network.shipped_weights import find_weights
from envgen_usd.landuse.network.training.plot_form import asked_sizes, plot_form, size_score
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.place_plots import straight_plots, with_straight_plots
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.plot_rectangles import least_rectangle
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.places.street_roads import road_text
from envgen_usd.recipe.environment_learning import TOWN, densest
from envgen_usd.recipe.map_land import read_road

HOUSES = (LanduseClass.LAWN, LanduseClass.RUBBLE)
AGAIN = 1000
"""Added to the seed of the rules that others are compared with."""
COLUMNS = ("plots", "of the rules'", "F1 of sizes", "holds", "straight", "CPU s a chunk")
Maps = Mapping[Chunk, LanduseMap]
Make = Callable[[RoadSurface, Sequence[Chunk], Profile, int], tuple[Maps, Sites]]
"""Landuse of a map, and the sites that its plots were laid out on."""


def by_rules(
    surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
) -> tuple[Maps, Sites]:
    roadsides = find_roadsides(surface, profile.plots, seed)
    maps = RuleProvider().generate(surface, chunks, profile, seed)
    return maps, fitted_sites(surface, roadsides, profile, seed)


def by_shipped(
    surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
) -> tuple[Maps, Sites]:
    rules = profile.plots
    maps = NetworkProvider(find_weights(None)).generate(surface, chunks, profile, seed)
    streets = draw_streets(find_roadsides(surface, rules, seed), rules, seed)
    return maps, street_sites(fit_streets(streets, surface, rules))


def by_places(weights: Path) -> Make:
    provider = PlaceProvider(weights)

    def make(
        surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
    ) -> tuple[Maps, Sites]:
        land, first = provider.land(surface, chunks, profile, seed)
        where = (corner_of(first), surface, profile, seed)
        maps = maps_of(with_straight_plots(land, *where), first, chunks)
        return maps, straight_plots(land, *where).sites

    return make


def form(surface: RoadSurface, profile: Profile, make: Make, seed: int) -> FloatArray:
    """Form of the plots with houses, and seconds a chunk in a last column."""
    chunks = chunks_of_points(surface.vertices, land_beside(profile))
    start = time.process_time()
    maps, sites = make(surface, chunks, profile, seed)
    seconds = (time.process_time() - start) / len(chunks)
    plots = [plot for plot in find_plots(maps, surface) if plot.landuse in HOUSES]
    found = plot_form(plots, asked_sizes(plots, sites, least_rectangle(profile.plots)))
    return np.column_stack([found, np.full(len(found), seconds)])


def roads_of(path: Path, profile: Profile) -> RoadSurface:
    """The surface of a road file, or of the streets of an extract's densest square kilometre."""
    if path.suffix == ".xodr":
        return read_road(path, 0.1, profile.road)[1]
    streets = densest(read_osm_place(path), TOWN).streets
    with tempfile.TemporaryDirectory() as folder:
        road = Path(folder) / "streets.xodr"
        road.write_text(road_text(streets), encoding="utf-8")
        return read_road(road, 0.1, profile.road)[1]


def judge(path: Path, profile: Profile, makes: dict[str, Make]) -> None:
    """Prints the rows of a road in an environment."""
    surface = roads_of(path, profile)
    seeds = range(options.seeds)
    truth = [form(surface, profile, by_rules, seed + AGAIN) for seed in seeds]
    for name, make in makes.items():
        rows = []
        for seed in seeds:
            found = form(surface, profile, make, seed)
            count = len(found) / max(1, len(truth[seed]))
            score = size_score(found[:, :2], truth[seed][:, :2])
            rows.append([len(found), count, score, *found[:, 2:].mean(axis=0)])
        plots, *figures = np.mean(rows, axis=0)
        cells = [f"{plots:.0f}", *(f"{figure:.3f}" for figure in figures)]
        title = f"{path.name.split('.')[0]}, {profile.country}/{profile.area}, {name}"
        print(f"| {title} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("roads", nargs="+", type=Path, help="road files, or extracts of maps")
    parser.add_argument("--network", type=Path, nargs="*", default=[], help="weights of places")
    parser.add_argument("--environment", nargs="*", help="such as 1/residential; default: all")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--no-shipped", action="store_true")
    options = parser.parse_args()
    every = [
        f"{country}/{area}" for country, areas in known_environments().items() for area in areas
    ]
    makes: dict[str, Make] = {"rules": by_rules}
    if not options.no_shipped:
        makes["shipped network"] = by_shipped
    for weights in options.network:
        makes[weights.parent.name] = by_places(weights)
    print(f"| | {' | '.join(COLUMNS)} |\n|{'---|' * (len(COLUMNS) + 1)}")
    for road in options.roads:
        for environment in options.environment or every:
            judge(road, read_profile(*environment.split("/")), makes)

"""Plots of networks beside those of the rules, on the same roads and in the same environments.

`plots` counts plots with houses. `F1 of sizes` pairs them off with plots of the rules of another
seed, whose frontage and depth differ by at most a fifth. `holds` is the share that holds the
rectangle which the environment asks for: the frontage and the depth that a twentieth of its plots
stay below. `straight` is the share of the outline along the front, or at right angles to it.
Landuse alone is made; nothing is built on it. Rows are means over the seeds.

    python benchmarks/landuse_plots.py ROAD.xodr [...] --network run/weights.safetensors
"""

import argparse
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from envgen_usd.chunks import chunks_of_points
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.landuse.landuse_provider import LanduseProvider
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.network.network_provider import NetworkProvider
from envgen_usd.landuse.network.place_provider import PlaceProvider
from envgen_usd.landuse.network.shipped_weights import find_weights
from envgen_usd.landuse.network.training.plot_form import plot_form, size_score
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.distribution import value_at
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.recipe.map_land import read_road

HOUSES = (LanduseClass.LAWN, LanduseClass.RUBBLE)
SMALL = 0.05
"""Share of an environment's plots that are smaller than the asked rectangle."""
AGAIN = 1000
"""Added to the seed of the rules that others are compared with."""
COLUMNS = ("plots", "of the rules'", "F1 of sizes", "holds", "straight", "CPU s a chunk")


def form(surface: RoadSurface, profile: Profile, make: LanduseProvider, seed: int) -> FloatArray:
    """Form of the plots with houses, and seconds a chunk in a last column."""
    chunks = chunks_of_points(surface.vertices, land_beside(profile))
    start = time.process_time()
    maps = make.generate(surface, chunks, profile, seed)
    seconds = (time.process_time() - start) / len(chunks)
    plots = [plot for plot in find_plots(maps, surface) if plot.landuse in HOUSES]
    sizes = profile.plots.frontage, profile.plots.depth
    found = plot_form(plots, (value_at(sizes[0], SMALL), value_at(sizes[1], SMALL)))
    return np.column_stack([found, np.full(len(found), seconds)])


def judge(path: Path, profile: Profile, makes: dict[str, Callable[[], LanduseProvider]]) -> None:
    """Prints the rows of a road in an environment."""
    _, surface = read_road(path, 0.1, profile.road.marks)
    seeds = range(options.seeds)
    truth = [form(surface, profile, RuleProvider(), seed + AGAIN) for seed in seeds]
    for name, make in makes.items():
        rows = []
        for seed in seeds:
            found = form(surface, profile, make(), seed)
            count = len(found) / max(1, len(truth[seed]))
            score = size_score(found[:, :2], truth[seed][:, :2])
            rows.append([len(found), count, score, *found[:, 2:].mean(axis=0)])
        plots, *figures = np.mean(rows, axis=0)
        cells = [f"{plots:.0f}", *(f"{figure:.3f}" for figure in figures)]
        title = f"{path.stem}, {profile.country}/{profile.area}, {name}"
        print(f"| {title} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("roads", nargs="+", type=Path)
    parser.add_argument("--network", type=Path, nargs="*", default=[], help="weights of places")
    parser.add_argument("--environment", nargs="*", help="such as 1/residential; default: all")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--no-shipped", action="store_true")
    options = parser.parse_args()
    every = [
        f"{country}/{area}" for country, areas in known_environments().items() for area in areas
    ]
    makes: dict[str, Callable[[], LanduseProvider]] = {"rules": RuleProvider}
    if not options.no_shipped:
        makes["shipped network"] = lambda: NetworkProvider(find_weights(None))
    for weights in options.network:
        makes[weights.parent.name] = partial(PlaceProvider, weights)
    print(f"| | {' | '.join(COLUMNS)} |\n|{'---|' * (len(COLUMNS) + 1)}")
    for road in options.roads:
        for environment in options.environment or every:
            judge(road, read_profile(*environment.split("/")), makes)

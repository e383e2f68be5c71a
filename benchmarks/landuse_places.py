"""Nearness of landuse to real places: rules, learnt environments and networks, on eastern halves.

Each extract is cut in the middle of its buildings. Squares of 256 cells cover the densest square
kilometre of the eastern half; what is there besides streets, water and railways is to be found.
Environments and the statistics that networks are told come from the densest square kilometre of the
western half. A row holds distances to the eastern squares, mean and spread over the seeds; the row
"western half" is the distance of the real western squares, and "every other square" that of the
eastern squares to one another, which is noise. ``diversity`` is 1 - agreement of two draws. The
last table is the mean over the extracts.

    python benchmarks/landuse_places.py munich.osm.gz krems.osm.gz --network run/weights.safetensors
"""

import argparse
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from envgen_usd.chunks import CELL_SIZE, Chunk, chunks_of_points
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.network.data.place_sample import PlaceSample
from envgen_usd.landuse.network.network_provider import NetworkProvider
from envgen_usd.landuse.network.place_filling import fill_places
from envgen_usd.landuse.network.place_provider import PlaceProvider
from envgen_usd.landuse.network.shipped_weights import find_weights
from envgen_usd.landuse.network.training.place_measures import (
    FIGURES,
    LandFigures,
    agreement,
    differences,
    land_figures,
)
from envgen_usd.landuse.network.training.weights_file import read_network
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.place_landuse import PlaceLand
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.places.street_roads import road_text
from envgen_usd.recipe.environment_learning import TOWN, densest, learnt_environment
from envgen_usd.recipe.map_land import read_road
from envgen_usd.recipe.place_windows import MappedPlace, land_of_maps, place_samples

SIDE = 256
"""Side of a square, cells."""
STREETS_AROUND = 120.0
"""Land around the squares whose streets are built, metres."""
Corner = tuple[int, int]
Draw = Callable[[int], Sequence[PlaceLand]]
"""Land of all squares for a seed."""


class Trial:
    """The eastern squares of a place, and what is known of its western half."""

    def __init__(self, path: Path, most: int) -> None:
        self.name = path.name.split(".")[0]
        self.mapped = MappedPlace.read(path)
        self.west, self.east = self.mapped.place.halves()
        self.corners, self.squares = self._squares("east", most)
        _, self.western = self._squares("west", most)
        self.real = land_figures([land_of(one) for one in self.squares], self.squares)
        self.surface = self._surface()

    def _squares(self, half: str, most: int) -> tuple[list[Corner], list[PlaceSample]]:
        place = self.west if half == "west" else self.east
        quarter, limits = densest(place, TOWN).bounds(), self.mapped.half(half)
        low, high = np.maximum(quarter[:2], limits[:2]), np.minimum(quarter[2:], limits[2:])
        bounds = (*low.tolist(), *high.tolist())
        found = list(place_samples(self.mapped, bounds, SIDE, SIDE))[:most]
        return [corner for corner, _ in found], [sample for _, sample in found]

    def _surface(self) -> RoadSurface:
        low = np.min(self.corners, axis=0) * CELL_SIZE - STREETS_AROUND
        high = (np.max(self.corners, axis=0) + SIDE) * CELL_SIZE + STREETS_AROUND
        streets = self.mapped.place.within((*low.tolist(), *high.tolist())).streets
        with tempfile.TemporaryDirectory() as folder:
            road = Path(folder) / "streets.xodr"
            road.write_text(road_text(streets), encoding="utf-8")
            return read_road(road, 0.1, read_profile("1", "residential").road)[1]

    def cut(self, maps: Mapping[Chunk, LanduseMap]) -> list[PlaceLand]:
        """The squares of a map."""
        return [land_of_maps(maps, corner, SIDE) for corner in self.corners]

    def by_rules(self, profile: Profile) -> Draw:
        chunks = chunks_of_points(self.surface.vertices, land_beside(profile))
        make = RuleProvider().generate
        return lambda seed: self.cut(make(self.surface, chunks, profile, seed))

    def by_shipped(self, profile: Profile) -> Draw:
        chunks = chunks_of_points(self.surface.vertices, 60.0)
        make = NetworkProvider(find_weights(None)).generate
        return lambda seed: self.cut(make(self.surface, chunks, profile, seed))

    def by_build(self, weights: Path, profile: Profile) -> Draw:
        chunks = chunks_of_points(self.surface.vertices, land_beside(profile))
        make = PlaceProvider(weights).generate
        return lambda seed: self.cut(make(self.surface, chunks, profile, seed))

    def by_network(self, weights: Path) -> Draw:
        network = read_network(weights, "place")
        told = np.mean([one.condition for one in self.western], axis=0)
        asked = [replace(one, condition=told.astype(np.float32)) for one in self.squares]
        return lambda seed: fill_places(network, asked, seed)


def land_of(sample: PlaceSample) -> PlaceLand:
    """The land of a sample."""
    return PlaceLand(sample.classes, sample.plots.astype(np.int64), sample.built)


def house_plots(lands: Sequence[PlaceLand]) -> int:
    """Plots for houses, whole or in part, in squares."""
    ground = (LanduseClass.LAWN, LanduseClass.RUBBLE)
    return sum(
        len(np.unique(land.plots[np.isin(land.classes, ground) & (land.plots > 0)]))
        for land in lands
    )


def rows_of(trial: Trial, draw: Draw, seeds: int) -> np.ndarray:
    """Seeds x figures; then the number of plots as a share of the real one, diversity, seconds."""
    drawn: list[LandFigures] = []
    rows = []
    for seed in range(seeds):
        start = time.process_time()
        lands = draw(seed)
        seconds = (time.process_time() - start) / len(lands)
        drawn.append(land_figures(lands, trial.squares))
        count = house_plots(lands) / house_plots([land_of(one) for one in trial.squares])
        rows.append([*differences(trial.real, drawn[-1], trial.squares), count, np.nan, seconds])
    pairs = [agreement(drawn[0], other, trial.squares) for other in drawn[1:]]
    table = np.array(rows)
    table[:, -2] = 1 - np.mean(pairs) if pairs else np.nan
    return table


def _interleaved(trial: Trial) -> np.ndarray:
    """Distance of every other eastern square to the squares between."""
    halves = [trial.squares[first::2] for first in (0, 1)]
    one, other = (land_figures([land_of(each) for each in half], half) for half in halves)
    return np.array([[*differences(one, other), np.nan, np.nan, np.nan]])


def row(name: str, values: np.ndarray) -> None:
    """Prints a row of the table: mean and spread over seeds."""
    cells = []
    for column, one in enumerate(values.T):
        digits = 1 if column in {1, 2, 3} else 3
        spread = f" ± {one.std():.{digits}f}" if len(one) > 1 and column < len(FIGURES) else ""
        cells.append("" if np.isnan(one).all() else f"{one.mean():.{digits}f}{spread}")
    print(f"| {name} | {' | '.join(cells)} |", flush=True)


def head(title: str) -> None:
    """Prints the head of a table."""
    names = [*FIGURES, "number", "diversity", "CPU s a square"]
    print(f"\n| {title} | {' | '.join(names)} |\n|{'---|' * (len(names) + 1)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("extracts", nargs="+", type=Path)
    parser.add_argument("--network", type=Path, nargs="*", default=[], help="weights of places")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--squares", type=int, default=16, help="at most, a place")
    parser.add_argument("--only-networks", action="store_true")
    parser.add_argument("--no-shipped", action="store_true", help="leave out the shipped network")
    options = parser.parse_args()
    base, total = read_profile("1", "residential"), defaultdict(list)
    for path in options.extracts:
        trial = Trial(path, options.squares)
        head(f"{trial.name}, {len(trial.squares)} squares, {len(trial.real.shapes)} plots")
        western = land_figures([land_of(one) for one in trial.western], trial.western)
        floor = np.array([[*differences(trial.real, western), np.nan, np.nan, np.nan]])
        draws: dict[str, Draw] = {}
        learnt = learnt_environment(trial.west, base).profile
        if not options.only_networks:
            draws["rules, hand-written"] = trial.by_rules(base)
            draws["rules, learnt"] = trial.by_rules(learnt)
        if not options.only_networks and not options.no_shipped:
            draws["shipped network"] = trial.by_shipped(base)
        for weights in options.network:
            draws[f"{weights.parent.name}"] = trial.by_network(weights)
            draws[f"{weights.parent.name}, in a build"] = trial.by_build(weights, learnt)
        results = {"real: every other square": _interleaved(trial), "real: western half": floor}
        for name, values in results.items():
            row(name, values)
        for name, draw in draws.items():
            results[name] = rows_of(trial, draw, options.seeds)
            row(name, results[name])
        for name, values in results.items():
            total[name].append(values.mean(axis=0))
    head(f"mean over {len(options.extracts)} places")
    for name, values in total.items():
        row(name, np.ma.masked_invalid(values).mean(axis=0).filled(np.nan)[None])


if __name__ == "__main__":
    main()

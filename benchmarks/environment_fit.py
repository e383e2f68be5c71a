"""Nearness of generated towns to real places: learnt environments against hand-written ones.

Each map or city model is cut in the middle of its buildings. An environment is learnt on the
western half. Towns of it and of the hand-written environments are generated on the streets of the
densest square kilometre of the eastern half (for a city model, which has none, on those of the demo
road), and measured by the same code as the whole eastern half. The table holds 1-dimensional
Wasserstein distances to the eastern half, mean over the seeds. The row "west" is the distance of
the real western half: no learning comes nearer but by chance.

    python benchmarks/environment_fit.py munich.osm.gz:residential krems.osm.gz delft.json
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.stats import wasserstein_distance

from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.landuse.landuse_provider import LanduseProvider
from envgen_usd.landuse.network.network_provider import network_provider
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.place import Place, Streets
from envgen_usd.places.building_figures import BuildingFigures, measure
from envgen_usd.places.environment_fit import LEAST_SAMPLES
from envgen_usd.recipe.environment_learning import TOWN, densest, learnt_environment
from envgen_usd.recipe.generated_town import generated_town, streets_of
from envgen_usd.recipe.map_land import read_road
from envgen_usd.recipe.real_place import read_place

DEMO = Path(__file__).resolve().parents[1] / "asset_library" / "roads" / "town.xodr"
"""Road whose streets towns get that a city model was learnt for."""
FIGURES = {
    "area": "m2",
    "height": "m",
    "setback": "m",
    "gaps": "m",
    "coverage": "1",
}


def samples(figures: BuildingFigures) -> Mapping[str, FloatArray]:
    """Known figures by name."""
    return {n: getattr(figures, n)[np.isfinite(getattr(figures, n))] for n in FIGURES}


def distances(real: Mapping[str, FloatArray], other: Mapping[str, FloatArray]) -> FloatArray:
    """Wasserstein distance of each figure; NaN where the real place has too few samples."""
    return np.array(
        [
            wasserstein_distance(real[name], other[name])
            if len(real[name]) >= LEAST_SAMPLES and len(other[name])
            else np.nan
            for name in FIGURES
        ]
    )


def streets_near(place: Place) -> Streets:
    """Streets of the densest part of a place, or of the demo."""
    if len(place.streets):
        return densest(place, TOWN).streets
    return streets_of(read_road(DEMO, 0.1, read_profile("1", "residential").road)[1])


def towns(
    streets: Streets,
    profile: Profile,
    real: Mapping[str, FloatArray],
    seeds: int,
    landuse: LanduseProvider | None = None,
) -> tuple[FloatArray, str]:
    """Distances of towns on streets, mean and spread over seeds."""
    rows, counts = [], []
    for seed in range(seeds):
        figures = measure(generated_town(streets, profile, seed, landuse))
        rows.append(distances(real, samples(figures)))
        counts.append(len(figures.area))
    return np.array(rows), f"{np.mean(counts):.0f}"


def row(name: str, count: str, values: FloatArray, spread: FloatArray | None = None) -> None:
    """Prints a row of the table."""
    cells = [f"{value:9.3f}" for value in values]
    if spread is not None:
        cells = [f"{v} ±{s:7.3f}" for v, s in zip(cells, spread, strict=True)]
    else:
        cells = [f"{cell}{' ' * 9}" for cell in cells]
    print(f"{name:22}{count:>10}  {'  '.join(cells)}", flush=True)


def compare(path: Path, landuse: str, seeds: int, networks: Sequence[Path]) -> None:
    """Prints the table of an extract."""
    west, east = read_place(path).halves()
    real, western = samples(measure(east, landuse)), samples(measure(west, landuse))
    print(f"\n{path.name}, {landuse or 'all'} buildings")
    print(
        f"{'':22}{'buildings':>10}  " + "  ".join(f"{f'{n} {u}':>18}" for n, u in FIGURES.items())
    )
    for name, half in (("samples, west", western), ("samples, east", real)):
        print(f"{name:22}{'':>10}  " + "  ".join(f"{len(half[n]):18}" for n in FIGURES))
    row("west", str(len(western["area"])), distances(real, western))
    streets = streets_near(east)
    hand = []
    for country, areas in known_environments().items():
        for area in areas:
            rows, count = towns(streets, read_profile(country, area), real, seeds)
            hand.append(rows.mean(axis=0))
            row(f"{country}/{area}", count, hand[-1], rows.std(axis=0))
    base = read_profile("1", "industrial" if landuse == "industrial" else "residential")
    learnt = learnt_environment(west, base, landuse)
    rows, count = towns(streets, learnt.profile, real, seeds)
    row("learnt", count, rows.mean(axis=0), rows.std(axis=0))
    best = np.min(hand, axis=0)
    row("learnt / best figure", "", rows.mean(axis=0) / best)
    relative = np.nansum(np.array(hand) / best, axis=1)
    row("learnt / best environment", "", rows.mean(axis=0) / hand[int(np.argmin(relative))])
    for weights in networks:
        rows, count = towns(streets, learnt.profile, real, seeds, network_provider(weights))
        row(f"learnt, {weights.parent.name}", count, rows.mean(axis=0), rows.std(axis=0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument(
        "extracts",
        nargs="+",
        help="FILE of a map or city model, or FILE:residential, FILE:industrial",
    )
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--network", type=Path, nargs="*", default=[], help="weights of landuse")
    options = parser.parse_args()
    for extract in options.extracts:
        path, _, landuse = extract.partition(":")
        compare(Path(path), landuse, options.seeds, options.network)


if __name__ == "__main__":
    main()

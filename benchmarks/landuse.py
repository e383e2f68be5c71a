"""Times landuse by rules on real roads, and measures it at the borders of chunks.

Run ``python benchmarks/landuse.py [FILE ...]``; without files those of the corpus are taken
($ENVGEN_SHARED or ../shared), if it is there. The last line compares how often class or plot
change from one cell to the next across the borders of chunks and inside, on random layouts.
"""

import os
import sys
import time
from pathlib import Path

import numpy as np

from envgen_usd.chunks import LANDUSE_CELLS, Chunk, chunks_of_points
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.landuse.landuse_regions import find_regions
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.network.data.road_layouts import KINDS, draw_layout
from envgen_usd.landuse.plot_index import PlotIndex
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.road_areas import RoadAreas
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface

ROOT = Path(__file__).resolve().parents[1]
CORPUS = Path(os.environ.get("ENVGEN_SHARED", ROOT.parent / "shared")) / "corpus"
NAMES = ("carla_test/Town01", "carla_test/Town04", "esmini/fabriksgatan")
LAYOUTS = 240
AROUND = 40
"""Cells on both sides of a border that are its inside."""


def measure(path: Path) -> None:
    """Prints the seconds of each step."""
    surface = build_surface(read_network(path))
    profile = read_profile("1", "residential")
    chunks = chunks_of_points(surface.vertices, 60.0)
    times = [time.perf_counter()]
    maps = RuleProvider().generate(surface, chunks, profile, 0)
    times.append(time.perf_counter())
    plots = find_plots(maps, surface)
    times.append(time.perf_counter())
    areas, by_place = RoadAreas(surface), PlotIndex(plots)
    regions = [find_regions(maps[chunk], by_place.touching(chunk), areas) for chunk in chunks]
    times.append(time.perf_counter())
    rules, fitting, polygons = np.diff(times)
    print(f"{path.stem:16} {len(chunks):3} chunks  rules {rules:.2f} s", end="")
    print(f"  {len(plots):4} plots {fitting:.2f} s", end="")
    print(f"  {sum(map(len, regions)):5} polygons {polygons:.2f} s")


def changes(number: int) -> np.ndarray:
    """Changes and pairs of cells across borders, and inside, of one random layout."""
    environments = [(c, a) for c, areas in known_environments().items() for a in areas]
    profile = read_profile(*environments[number % len(environments)])
    kind = KINDS[number // len(environments) % len(KINDS)]
    surface = draw_layout(kind, np.random.default_rng([7, number]))
    chunks = [Chunk(x, y) for x in (0, 1) for y in (0, 1)]
    maps = RuleProvider().generate(surface, chunks, profile, number)
    found = np.zeros(4)
    cells = [
        np.block([[getattr(maps[Chunk(x, y)], name) for x in (0, 1)] for y in (0, 1)])
        for name in ("classes", "plots")
    ]
    for classes, plots in (cells, [values.T for values in cells]):
        change = np.diff(classes.astype(int), axis=1) != 0
        change |= np.diff(plots, axis=1) != 0
        near = change[:, LANDUSE_CELLS - 1 - AROUND : LANDUSE_CELLS + AROUND]
        border, inside = near[:, AROUND], np.delete(near, AROUND, axis=1)
        found += [border.sum(), border.size, inside.sum(), inside.size]
    return found


def main(paths: list[Path]) -> None:
    """Prints the figures."""
    for path in paths:
        measure(path)
    each = np.array([changes(number) for number in range(LAYOUTS)])
    draw = np.random.default_rng(0)
    samples = [each[draw.integers(0, LAYOUTS, LAYOUTS)].sum(axis=0) for _ in range(500)]
    ratio, *others = (a * d / (b * c) for a, b, c, d in [each.sum(axis=0), *samples])
    print(
        f"{LAYOUTS} layouts: changes across borders are {ratio:.3f} ± {np.std(others):.3f} "
        "times as frequent as inside"
    )


if __name__ == "__main__":
    corpus = [CORPUS / f"{name}.xodr" for name in NAMES]
    given = [Path(name) for name in sys.argv[1:]]
    main(given or [path for path in corpus if path.exists()])

"""Generates and writes buildings in each of the sixteen levels of detail, a file for each.

    python benchmarks/levels.py --buildings 1000 --processes 2

The buildings are those of all environments in turn, on plots of their own. With --check every
solid is validated after ISO 19107 and every file against the schema in --schemas.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from envgen_usd.city.buildings.building_feature import make_building
from envgen_usd.city.buildings.design_draws import draw_design
from envgen_usd.city.buildings.level_of_detail import LEVELS, Modelling
from envgen_usd.city.buildings.thematic_surfaces import Site
from envgen_usd.citygml.city_validation import geometry_issues, schema_issues
from envgen_usd.citygml.write import write_features
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.environment_profile import Profile
from envgen_usd.seeds import Draws, generator

SPACING = 80.0
SPACES = {"row": (9.0, 14.0), "detached": (20.0, 18.0), "hall": (45.0, 35.0)}


def profiles() -> list[Profile]:
    return [
        read_profile(country, area)
        for country, areas in known_environments().items()
        for area in areas
    ]


def buildings(count: int, level: str) -> Iterator[CityObject]:
    known = profiles()
    across = int(np.ceil(np.sqrt(count)))
    modelling = Modelling(LEVELS[level], lower=False)
    for number in range(count):
        rules = known[number % len(known)].buildings
        draws = generator(0, "benchmark", number)
        turn = draws.uniform(-np.pi, np.pi)
        place = SPACING * np.array(divmod(number, across), dtype=np.float64)
        ground = draws.uniform(0.0, 0.5, 2)
        site = Site(
            origin=place,
            along=np.array([np.cos(turn), np.sin(turn)]),
            lowest=float(ground.min()),
            highest=float(ground.max()),
            street=float(ground.mean()),
        )
        design = draw_design(rules, SPACES[rules.style], Draws(0, "benchmark", number))
        yield make_building(f"building_{number}", design, site, modelling)[0]


def measure(
    job: tuple[str, int, bool, Path | None],
) -> tuple[str, float, int, tuple[int, ...]]:
    level, count, check, schemas = job
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "city.gml"
        start = time.process_time()
        write_features(buildings(count, level), path)
        spent = time.process_time() - start
        faults: tuple[int, ...] = ()
        if check:
            faults = (len(geometry_issues(path)),)
        if schemas is not None:
            faults += (len(schema_issues(path, schemas)),)
        return level, spent, path.stat().st_size, faults


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--buildings", type=int, default=1000)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--levels", nargs="+", default=list(LEVELS), choices=list(LEVELS))
    parser.add_argument("--check", action="store_true", help="validate every solid")
    parser.add_argument("--schemas", type=Path, help="folder with the schemas of CityGML")
    options = parser.parse_args()
    start = time.perf_counter()
    # The largest levels first, so that no process is left alone with one at the end.
    jobs = [(n, options.buildings, options.check, options.schemas) for n in options.levels]
    jobs.sort(reverse=True)
    print("level    CPU s        MB  faults (geometry, schema)")
    with ProcessPoolExecutor(options.processes, get_context("spawn")) as pool:
        for level, spent, size, faults in pool.map(measure, jobs):
            print(f"{level:>5} {spent:8.2f} {size / 1e6:9.1f}  {faults or ''}", flush=True)
    print(f"all together {time.perf_counter() - start:.1f} s in {options.processes} processes")


if __name__ == "__main__":
    main()

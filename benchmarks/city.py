"""Generates, writes, reads and validates cities of growing size; times, file sizes and memory.

    python benchmarks/city.py --buildings 1000 10000 --level 2.2

Each chunk of 200 m by 200 m is divided into 100 plots without a road. Generating and writing go
chunk by chunk into one file, as for a map, so memory must not grow with the number of buildings.
Times are CPU seconds of one process, which a busy machine does not change.
"""

import argparse
import math
import resource
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE, HEIGHT_SAMPLES, LANDUSE_CELLS, Chunk
from envgen_usd.city.buildings.level_of_detail import FINEST, LEVELS, Modelling
from envgen_usd.city.generate import build_city, plan_city
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.citygml.city_validation import geometry_issues, schema_issues
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_features
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.environment_files import read_profile
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.models.road_surface import RoadSurface

SIDE = 10
NO_ROAD = RoadIndex(
    RoadSurface(
        vertices=np.empty((0, 3)),
        triangles=np.empty((0, 3), dtype=np.int64),
        triangle_patch=np.empty(0, dtype=np.int64),
        triangle_level=np.empty(0, dtype=np.int64),
        patches=(),
        outline=(),
        lanes=(),
        roads=(),
    )
)


def plots_of(chunk: Chunk) -> tuple[Plot, ...]:
    size = CHUNK_SIZE / SIDE
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size
    places = [(column, row) for row in range(SIDE) for column in range(SIDE)]
    outlines = [corners + chunk.origin + np.array(place) * size for place in places]
    return tuple(
        Plot(f"plot_{chunk.prim_name}_{number}", outline, LanduseClass.LAWN, outline[:2])
        for number, outline in enumerate(outlines)
    )


def buildings(
    count: int, profile: Profile, modelling: Modelling, spent: list[float]
) -> Iterator[CityObject]:
    """Buildings of as many chunks as it takes; the time that they took is added up in `spent`."""
    across = math.ceil(math.sqrt(math.ceil(count / SIDE**2)))
    made = 0
    for number in range(10**9):
        start = time.process_time()
        chunk = Chunk(number % across, number // across)
        flat = HeightMap(chunk, np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES)))
        classes = np.full((LANDUSE_CELLS, LANDUSE_CELLS), LanduseClass.LAWN, dtype=np.uint8)
        landuse = LanduseMap(chunk, classes, np.ones(classes.shape, dtype=np.int64))
        plots = plots_of(chunk)
        plan = plan_city(chunk, plots, NO_ROAD, flat, profile, 0, modelling=modelling)
        city = build_city(plan, landuse, profile)
        found = city.of_kind("Building")[: count - made]
        made += len(found)
        spent[0] += time.process_time() - start
        yield from found
        if made >= count or not found:
            return


def timed(function, *arguments):
    start = time.process_time()
    result = function(*arguments)
    return result, time.process_time() - start


def measure(count: int, environment: str, level: str, schemas: Path | None) -> str:
    profile = read_profile(*environment.split("/"))
    modelling = Modelling(LEVELS[level], lower=level == FINEST.name)
    with tempfile.TemporaryDirectory() as folder:
        return " ".join(_measure(count, profile, modelling, schemas, Path(folder)))


def _measure(
    count: int, profile: Profile, modelling: Modelling, schemas: Path | None, folder: Path
) -> list[str]:
    path, other = folder / "city.gml", folder / "city.json"
    generating = [0.0]
    _, both = timed(write_features, buildings(count, profile, modelling, generating), path)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    city, reading = timed(read_city, path)
    faults, checking = timed(geometry_issues, path)
    misfits, against_schema = timed(schema_issues, path, schemas) if schemas else ((), math.nan)
    _, to_json = timed(write_cityjson, city, other)
    _, from_json = timed(read_cityjson, other)
    times = (generating[0], both - generating[0], reading, checking, against_schema)
    return [
        f"{len(city.objects):>9,}",
        *(f"{value:8.2f}" for value in (*times, to_json, from_json)),
        f"{path.stat().st_size / 1e6:8.1f}",
        f"{other.stat().st_size / 1e6:8.1f}",
        f"{memory:8.0f}",
        f"{len(faults) + len(misfits):6}",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--buildings", type=int, nargs="+", default=[1000])
    parser.add_argument("--environment", default="1/residential", help="country/area")
    parser.add_argument("--level", default=FINEST.name, choices=list(LEVELS))
    parser.add_argument("--schemas", type=Path, help="folder with the schemas of CityGML")
    options = parser.parse_args()
    print(
        "buildings  gen. s  write s   read s  geom. s    xsd s   json s  json r s"
        "   gml MB  json MB   MB mem  faults"
    )
    for count in options.buildings:
        # A process of its own, so that its peak of memory is its own.
        with ProcessPoolExecutor(1, get_context("spawn")) as process:
            job = process.submit(
                measure, count, options.environment, options.level, options.schemas
            )
            print(job.result(), flush=True)


if __name__ == "__main__":
    main()

"""Measures how long the root of a large stage takes to open, with all chunks unloaded.

    python benchmarks/stage_root.py OUT/chunks/0_0 --chunks 1000 10000

The chunk is one of a finished build. Its files stand for those of all chunks of a square map,
as links, and the code of `build` composes them and writes the index of the city. Times are
processor seconds; a stage of nine chunks shows what does not grow with the map.
"""

import argparse
import math
import os
import tempfile
import time
from pathlib import Path

import numpy as np
from pxr import Usd

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.chunks import CITY_FILE, Chunk
from envgen_usd.citygml.city_index import write_index
from envgen_usd.environment_files import read_profile
from envgen_usd.layers.stage_composition import ACTORS, LAYERS, compose_stage
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.recipe.chunk_summaries import SUMMARY, kept_entry, kept_payload


def map_of(source: Path, count: int, folder: Path) -> list[Chunk]:
    """Links the files of a chunk into a map of `count` chunks."""
    side = math.ceil(math.sqrt(count))
    chunks = [Chunk(number % side, number // side) for number in range(count)]
    for chunk in chunks:
        place = folder / "chunks" / chunk.name
        place.mkdir(parents=True)
        for name in (*(f"{layer}.usdc" for layer in (ACTORS, *LAYERS)), SUMMARY):
            os.link(source / name, place / name)
    return chunks


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("chunk", type=Path, help="folder of a chunk of a build")
    parser.add_argument("--chunks", type=int, nargs="+", default=[9, 10_000])
    options = parser.parse_args()
    numbers = np.empty(0, np.int64)
    surface = RoadSurface(
        np.empty((0, 3)), np.empty((0, 3), np.int64), numbers, numbers, (), (), (), ()
    )
    profile, catalogue = read_profile("1", "residential"), read_catalogue()
    print("| chunks | compose CPU s | index CPU s | layers MB | open CPU s | open s |")
    print("|---|---|---|---|---|---|")
    for count in options.chunks:
        # Beside the build, since links stay in one file system.
        with tempfile.TemporaryDirectory(dir=options.chunk.parent) as name:
            folder = Path(name)
            chunks = map_of(options.chunk, count, folder)
            start = time.process_time()
            stage = compose_stage(
                folder, chunks, surface, profile, catalogue, actors=True, read=kept_payload
            )
            composed = time.process_time() - start
            start = time.process_time()
            files = [folder / "chunks" / chunk.name / CITY_FILE for chunk in chunks]
            write_index(files, folder / CITY_FILE, kept_entry)
            indexed = time.process_time() - start
            size = sum(path.stat().st_size for path in (stage, *(folder / "layers").iterdir()))
            start, began = time.process_time(), time.perf_counter()
            opened = Usd.Stage.Open(str(stage), Usd.Stage.LoadNone)
            seconds, wall = time.process_time() - start, time.perf_counter() - began
            del opened
        cells = (f"{composed:.1f}", f"{indexed:.1f}", f"{size / 1e6:.1f}")
        print(
            "|", " | ".join((str(count), *cells, f"{seconds:.2f}", f"{wall:.2f}")), "|", flush=True
        )


if __name__ == "__main__":
    main()

"""Measures how time and memory grow with the map: street grids of several sizes.

    python benchmarks/scale.py --blocks 1 3 6 --most 12 --out scale.md

Each map is built in a process of its own. Of a large map, a part of about `--most` chunks is built
(as `build --shard 1/n` does), so that a row costs minutes; roads, landuse and terrain are always
those of the whole map. Times are processor seconds of one process, so that other programs on the
machine count little.
"""

import argparse
import json
import os
import shutil
import tempfile
import time
from pathlib import Path

from envgen_usd.chunks import chunks_of_points
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build_shard
from envgen_usd.recipe.map_land import read_road
from envgen_usd.streets.network_roads import network_xml
from envgen_usd.streets.street_layouts import grid_network

HEADER = ("blocks", "road km", "chunks", "map CPU s", "map CPU s a chunk", "built")
MORE = ("CPU s a chunk", "peak MB")
_MAP = ("road", "given land", "landuse", "terrain", "index")
"""Steps that take the whole map."""


class Meter:
    """Processor seconds of each step."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._start: dict[str, float] = {}

    def __call__(self, step: str, done: int, _total: int) -> None:
        now = time.process_time()
        if done == 0:
            self._start[step] = now
        self.seconds[step] = now - self._start.get(step, now)


def measured(blocks: int, most: int, folder: Path) -> dict[str, float]:
    """Builds a part of a grid in this process; returns a row."""
    road = folder / "grid.xodr"
    network = grid_network((blocks, blocks), 0)
    road.write_bytes(network_xml(network, "grid"))
    profile = read_profile("1", "residential")
    surface = read_road(road, 0.02, profile.road.marks)[1]
    chunks = len(chunks_of_points(surface.vertices, land_beside(profile)))
    del surface
    shards = max(round(chunks / most), 1)
    options = BuildOptions(road, "1", "residential", folder / "out", workers=1)
    meter = Meter()
    result = build_shard(options, (1, shards), meter)
    whole = sum(meter.seconds.get(step, 0.0) for step in _MAP)
    return {
        "blocks": blocks,
        "road km": round(network.length / 1000, 1),
        "chunks": chunks,
        "map CPU s": round(whole, 1),
        "map CPU s a chunk": round(whole / chunks, 2),
        "built": result.built,
        "CPU s a chunk": round(meter.seconds["chunks"] / max(result.built, 1), 2),
    }


def row_of(blocks: int, most: int) -> dict[str, float]:
    """A row, measured in a new process, with its peak memory."""
    folder = Path(tempfile.mkdtemp(prefix="envgen-scale-"))
    process = os.fork()
    if process == 0:
        row = measured(blocks, most, folder)
        (folder / "row.json").write_text(json.dumps(row))
        os._exit(0)
    _, _, usage = os.wait4(process, 0)
    row = json.loads((folder / "row.json").read_text())
    shutil.rmtree(folder)
    return row | {"peak MB": usage.ru_maxrss >> 10}


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--blocks", type=int, nargs="+", default=[1, 3, 6])
    parser.add_argument("--most", type=int, default=12, help="chunks that are built of a map")
    parser.add_argument("--out", type=Path, help="file for the table, Markdown")
    options = parser.parse_args()
    names = (*HEADER, *MORE)
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    print("\n".join(lines), flush=True)
    for blocks in options.blocks:
        row = row_of(blocks, options.most)
        lines.append("| " + " | ".join(str(row[name]) for name in names) + " |")
        print(lines[-1], flush=True)
    if options.out:
        options.out.write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()

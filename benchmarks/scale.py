"""Measures how time and memory grow with the map: street grids of several sizes.

    python benchmarks/scale.py --blocks 2 3 6 12 --most 6 --out scale.md

Each map is built as a build does it: a process reads the file and gives the tasks, and one worker
makes the whole land, and up to `--most` chunks in the middle of the map. These lie between the
outermost streets, so that chunks of small and of large maps hold as much town. Times are processor
seconds; beside other programs they grow, by half where two processors share a core. Peaks of memory
are those of the kernel (Linux): of reading the file, of what the lead does afterwards, and of the
worker.
"""

import argparse
import json
import multiprocessing
import pickle
import shutil
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.chunks import Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.free_memory import trim_memory
from envgen_usd.models.road import RoadNetwork
from envgen_usd.opendrive.reference_samples import ReferenceSamples
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.chunk_products import ChunkInputs, ChunkMaps, RoadLand, build_chunk
from envgen_usd.recipe.map_land import lay_out_land, read_road_file
from envgen_usd.recipe.map_regions import Region
from envgen_usd.recipe.region_roads import BESIDE
from envgen_usd.recipe.region_stages import REACHES, STAGES, RegionalLand, make_product
from envgen_usd.recipe.regional_build import (
    RegionalMap,
    RegionMaps,
    StreetLayout,
    lay_out_regions,
    regional_map,
)
from envgen_usd.step_clock import Clock
from envgen_usd.streets.network_roads import network_xml
from envgen_usd.streets.street_layouts import grid_network

Row = dict[str, Any]

COLUMNS = (
    *("blocks", "road km", "chunks", "regions", "file CPU s", "land CPU s a chunk"),
    *("streets CPU s a chunk", "CPU s a chunk", "buildings a chunk"),
    *("reading MB", "lead MB", "worker MB"),
)
KEY = "measured"


def lead(blocks: int, most: int, folder: Path) -> None:
    """Reads the file of a grid and has the map built, in a process of its own; writes the row."""
    row = json.loads((folder / "grid.json").read_text())
    options = _options(folder)
    profile, clock = read_profile("1", "residential"), Clock(_quiet)
    start = time.process_time()
    road = read_road_file(options.road, options.tolerance)
    row |= {"blocks": blocks, "file CPU s": round(time.process_time() - start, 1)}
    row["reading MB"] = peak()
    forget_peak()
    streets = _around(ReferenceSamples.of(road.network).boxes)
    regional = regional_map(options, profile, road)
    if regional is None:
        start = time.process_time()
        whole = lay_out_land(options, profile, clock, road=road)
        seconds = time.process_time() - start
        count = len(whole.chunks)
        row |= {"chunks": count, "regions": 1, "land CPU s a chunk": round(seconds / count, 2)}
        row |= built(folder, whole, count, _inner(whole.chunks, streets, most), whole.of)
        row["worker MB"] = peak()
    else:
        row |= _in_regions(regional, most, streets, folder)
        land = lay_out_regions(regional, options, KEY, clock)
        count = len(land.chunks)
        seconds = row.pop("land CPU s")
        row |= {"chunks": count, "land CPU s a chunk": round(seconds / count, 2)}
    row["lead MB"] = peak()
    (folder / "row.json").write_text(json.dumps(row))


def _in_regions(regional: RegionalMap, most: int, streets: np.ndarray, folder: Path) -> Row:
    """Gives a worker the tasks of a map of several regions; returns what it measured."""
    known = replace(regional.land, folder=regional.land.folder / KEY)
    whole = regional.regions
    middle = min(whole, key=lambda each: _away(each.bounds, streets))
    tasks = [
        (stage, region, None if stage not in REACHES else regional.near(region, REACHES[stage]))
        for stage in STAGES
        for region in whole
    ]
    last = ("", middle, regional.near(middle, BESIDE))
    for number, task in enumerate([*tasks, last]):
        (folder / f"task{number}").write_bytes(pickle.dumps(task))
    (folder / "land").write_bytes(pickle.dumps(known))
    _in_process(worker, folder, len(tasks), most, streets)
    row: Row = json.loads((folder / "worker.json").read_text())
    return row | {"regions": len(whole)}


def worker(folder: Path, tasks: int, most: int, streets: np.ndarray) -> None:
    """Makes the land of all regions and chunks of the one in the middle; writes figures."""
    known: RegionalLand = _read(folder / "land")
    start = time.process_time()
    for number in range(tasks):
        stage, region, network = _read(folder / f"task{number}")
        make_product(known, stage, region, network)
        trim_memory()
    row: Row = {"land CPU s": time.process_time() - start}
    _, region, network = _read(folder / f"task{tasks}")
    row |= _middle_chunks(known, region, network, most, streets, folder)
    (folder / "worker.json").write_text(json.dumps(row | {"worker MB": peak()}))


def _middle_chunks(  # noqa: PLR0913, PLR0917 - what the chunks of a region follow from
    known: RegionalLand,
    region: Region,
    network: RoadNetwork,
    most: int,
    streets: np.ndarray,
    folder: Path,
) -> Row:
    start, chunks = time.process_time(), known.chunks(region)
    roads, maps = StreetLayout.of(known, region, network), RegionMaps(known, region)
    inner = _inner(chunks, streets, most)
    return built(folder, roads, len(chunks), inner, maps.of, start)


def built(  # noqa: PLR0913, PLR0917 - what chunks follow from
    folder: Path,
    roads: RoadLand,
    count: int,
    chunks: Sequence[Chunk],
    maps: Callable[[Chunk], ChunkMaps],
    start: float | None = None,
) -> Row:
    """Builds chunks; returns the seconds of each, and of the streets shared by `count` chunks."""
    start, profile = start or time.process_time(), read_profile("1", "residential")
    (folder / "chunks").mkdir()
    options = _options(folder)
    inputs = ChunkInputs.of(folder / "chunks", roads, profile, read_catalogue(), options)
    trim_memory()
    shared = time.process_time()
    buildings = [build_chunk(inputs, maps(chunk), KEY).counts["Building"] for chunk in chunks]
    return {
        "streets CPU s a chunk": round((shared - start) / count, 2),
        "CPU s a chunk": round((time.process_time() - shared) / len(chunks), 1),
        "buildings a chunk": round(sum(buildings) / len(chunks)),
    }


def forget_peak() -> None:
    """Lets the kernel count the peak from now on."""
    Path("/proc/self/clear_refs").write_text("5", "ascii")


def peak() -> int:
    """Largest resident memory of this process since its begin or `forget_peak`, MB."""
    lines = Path("/proc/self/status").read_text("utf-8").splitlines()
    return next(int(line.split()[1]) >> 10 for line in lines if line.startswith("VmHWM"))


def _options(folder: Path) -> BuildOptions:
    return BuildOptions(folder / "grid.xodr", "1", "residential", folder / "out", workers=1)


def _read(path: Path) -> Any:
    return pickle.loads(path.read_bytes())


def _inner(chunks: Iterable[Chunk], streets: np.ndarray, most: int) -> list[Chunk]:
    """The chunks between the outermost streets, nearest to the middle first."""
    x0, y0, x1, y1 = streets
    between = [
        chunk
        for chunk in chunks
        if x0 <= chunk.bounds[0] and y0 <= chunk.bounds[1]
        and chunk.bounds[2] <= x1 and chunk.bounds[3] <= y1
    ]  # fmt: skip
    if not between:
        raise SystemExit("no chunk lies between the outermost streets; take more blocks")
    return sorted(between, key=lambda chunk: _away(chunk.bounds, streets))[:most]


def _quiet(_step: str, _done: int, _total: int) -> None:
    """Takes progress, and tells nothing."""


def _around(boxes: np.ndarray) -> np.ndarray:
    """The rectangle around boxes, N x 4: min x, min y, max x, max y."""
    return np.concatenate([boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)])


def _away(bounds: Sequence[float], streets: np.ndarray) -> float:
    """Distance of the middles of two rectangles."""
    low, high = (np.array(bounds) - streets).reshape(2, 2)
    return float(np.hypot(*(low + high))) / 2.0


def row_of(blocks: int, most: int) -> Row:
    """A row of the table."""
    folder = Path(tempfile.mkdtemp(prefix="envgen-scale-"))
    network = grid_network((blocks, blocks), 0)
    (folder / "grid.xodr").write_bytes(network_xml(network, "grid"))
    (folder / "grid.json").write_text(json.dumps({"road km": round(network.length / 1000, 1)}))
    _in_process(lead, blocks, most, folder)
    row: Row = json.loads((folder / "row.json").read_text())
    shutil.rmtree(folder)
    return row


def _in_process(run: Callable[..., None], *parts: object) -> None:
    """Runs a function in a new process; its memory begins with what it imports."""
    process = multiprocessing.get_context("spawn").Process(target=run, args=parts)
    process.start()
    process.join()
    if process.exitcode:
        raise SystemExit(f"a process ended with {process.exitcode}")


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--blocks", type=int, nargs="+", default=[2, 3, 6, 12])
    parser.add_argument("--most", type=int, default=12, help="chunks that are built of a map")
    parser.add_argument("--out", type=Path, help="file for the table, Markdown")
    options = parser.parse_args()
    names = COLUMNS
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

"""Measures how time and memory grow with the map: street grids of several sizes.

    python benchmarks/scale.py --blocks 1 3 6 12 --most 6 --out scale.md

Each map is built in a process of its own: its whole land, and `--most` of its chunks, which lie in
its middle. Times are processor seconds of one process, so that other programs on the machine count
little.
"""

import argparse
import json
import os
import shutil
import tempfile
import time
from pathlib import Path

import numpy as np

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.environment_files import read_profile
from envgen_usd.opendrive.reference_samples import ReferenceSamples
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.chunk_products import ChunkInputs, build_chunk
from envgen_usd.recipe.map_land import lay_out_land, read_road_file, surface_of
from envgen_usd.recipe.region_stages import STREETS
from envgen_usd.recipe.regional_build import (
    RegionMaps,
    StreetLayout,
    lay_out_regions,
    regional_map,
)
from envgen_usd.step_clock import Clock
from envgen_usd.streets.network_roads import network_xml
from envgen_usd.streets.street_layouts import grid_network

HEADER = ("blocks", "road km", "chunks", "regions", "file CPU s", "land CPU s a chunk")
MORE = ("streets CPU s a chunk", "CPU s a chunk", "peak MB")


def measured(blocks: int, most: int, folder: Path) -> dict[str, float]:
    """Builds a part of a grid in this process; returns a row."""
    road = folder / "grid.xodr"
    network = grid_network((blocks, blocks), 0)
    road.write_bytes(network_xml(network, "grid"))
    profile, catalogue, clock = read_profile("1", "residential"), read_catalogue(), Clock(_quiet)
    options = BuildOptions(road, "1", "residential", folder / "out", workers=1)
    times = [time.process_time()]
    reading = read_road_file(road, options.tolerance)
    times.append(time.process_time())
    place = _middle(ReferenceSamples.of(reading.network).boxes)
    regional = regional_map(options, profile, reading)
    if regional is None:
        land = lay_out_land(options, profile, clock, reading=reading)
        regions, chunks, roads, maps = 1, land.chunks, land, land
    else:
        land = lay_out_regions(regional, options, "measured", clock)
        assert land.regional is not None
        known, whole = land.regional.land, land.regional.regions
        region = min(whole, key=lambda each: _distance(_middle(np.array([each.bounds])), place))
        regions, chunks = len(whole), known.chunks(region)
    times.append(time.process_time())
    if regional is not None:
        near = land.regional.near(region, STREETS)
        surface = surface_of(near, options.tolerance, profile.road.marks)
        roads, maps = StreetLayout(near, surface), RegionMaps(known, region)
    (folder / "chunks").mkdir()
    inputs = ChunkInputs.of(folder / "chunks", roads, profile, catalogue, options)
    times.append(time.process_time())
    near_first = sorted(chunks, key=lambda each: _distance(_middle(np.array([each.bounds])), place))
    built = near_first[:most]
    for chunk in built:
        build_chunk(inputs, maps.of(chunk), "measured")
    times.append(time.process_time())
    file, laid_out, streets, all_built = np.diff(times).tolist()
    return {
        "blocks": blocks,
        "road km": round(network.length / 1000, 1),
        "chunks": len(land.chunks),
        "regions": regions,
        "file CPU s": round(file, 1),
        "land CPU s a chunk": round(laid_out / len(land.chunks), 2),
        "streets CPU s a chunk": round(streets / len(chunks), 2),
        "CPU s a chunk": round(all_built / len(built), 2),
    }


def _quiet(_step: str, _done: int, _total: int) -> None:
    """Takes progress, and tells nothing."""


def _middle(boxes: np.ndarray) -> np.ndarray:
    """Middle of the rectangle around boxes, N x 4."""
    middle: np.ndarray = (boxes[:, :2].min(axis=0) + boxes[:, 2:].max(axis=0)) / 2.0
    return middle


def _distance(point: np.ndarray, place: np.ndarray) -> float:
    return float(np.hypot(*(point - place)))


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
    parser.add_argument("--blocks", type=int, nargs="+", default=[1, 3, 6, 12])
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

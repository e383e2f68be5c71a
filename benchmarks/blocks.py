"""Judges the form of towns: full blocks, closed fronts, what stands just under the horizon.

    python benchmarks/blocks.py towns ROAD.xodr [...] [--environment 1/residential]
    python benchmarks/blocks.py places EXTRACT.osm.gz [...] [--environment 1/residential]
    python benchmarks/blocks.py frames now=FRAMES CamVid=camvid7:train

`towns` lays out landuse and buildings on the streets of road files, without a stage. A block is the
land that roads enclose, at least `LEAST_BLOCK` of it, without the narrowest verge. Coverage is the
share of the blocks in plots: of all, of the emptiest, and how many blocks lie below `FULL`. Built,
core and open are those of `places/block_figures.py`: share under buildings, share of the land
behind the first row under buildings, share of views from the street that meet no house.

`places` measures the densest square kilometre of real extracts, and towns on its streets, alike.

`frames` prints the share of each class in whole images and in the image rows from 50 to 60 % of the
height, which hold what stands just under the horizon; columns as in `looks.py`. CamVid counts walls
as building, driveways as sidewalk and grass as vegetation, so its classes are those of frames, too.
"""

import argparse
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from looks import CLASSES, photographs

from envgen_usd import read_frames
from envgen_usd.environment_files import read_profile
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.land_rules import BlockRules
from envgen_usd.models.place import Place
from envgen_usd.places.block_figures import LEAST_BLOCK, measure_blocks
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.recipe.environment_learning import TOWN, densest
from envgen_usd.recipe.generated_town import Town, streets_of, town_beside, town_on_streets
from envgen_usd.recipe.map_land import read_road
from envgen_usd.study.study_classes import camvid_frame_table

ROOT = Path(__file__).resolve().parents[1]
CORPUS = Path(os.environ.get("ENVGEN_SHARED", ROOT.parent / "shared")) / "corpus"
NAMES = (
    "carla_test/Town01",
    "carla_test/Town03",
    "esmini/fabriksgatan",
    "esmini/multi_intersections",
    "scenic/Town10HD_0910",
)
FULL = 0.85
"""Share of a block in plots from which it is full."""
ROWS = (0.5, 0.6)
"""Image rows just under the horizon of a camera on a dashboard, as shares of the height."""
CELL = 0.4
"""Half of what the raster leaves between plots, metres."""


def coverage(town: Town, profile: Profile) -> np.ndarray:
    """Share of each block in plots, with its area, B x 2."""
    rings = [shapely.Polygon(loop[:, :2]) for loop in town.surface.outline_loops() if len(loop) > 2]
    blocks = [r for r in rings if not r.exterior.is_ccw and r.area > LEAST_BLOCK]
    plots = [shapely.Polygon(plot.polygon) for plot in town.plots]
    built = shapely.union_all(shapely.buffer(plots, CELL), grid_size=0.001)
    land = shapely.buffer(shapely.make_valid(blocks), -profile.plots.verge[0])
    inside = shapely.area(shapely.intersection(land, built, grid_size=0.001))
    areas = shapely.area(land)
    return np.stack([inside / np.maximum(areas, 1.0), areas], axis=1)[areas > 0.0]


def figures(place: Place) -> tuple[int, float, float, float]:
    """Blocks, built share, built share of cores, share of open views."""
    found = measure_blocks(place)
    area = shapely.area(found.blocks)
    built = float(np.average(found.built, weights=area)) if len(area) else np.nan
    core = float(np.nanmean(found.core_built)) if np.isfinite(found.core_built).any() else np.nan
    return len(area), built, core, float(found.is_open.mean()) if len(found.is_open) else np.nan


def print_town(name: str, town: Town, profile: Profile, seconds: float) -> None:
    """Prints a row of the table of towns."""
    full = coverage(town, profile)
    _, built, core, openness = figures(town.place)
    kinds = np.unique([plot.landuse.name.lower() for plot in town.plots], return_counts=True)
    uses = " ".join(f"{kind} {count}" for kind, count in zip(*kinds, strict=True))
    share = np.average(full[:, 0], weights=full[:, 1]) if len(full) else np.nan
    least, below = (full[:, 0].min(), (full[:, 0] < FULL).sum()) if len(full) else (np.nan, 0)
    blocks = f"{len(full)} | {share:.1%} | {least:.1%} | {below}"
    front = f"{built:.1%} | {core:.1%} | {openness:.1%}"
    counts = f"{len(town.plots)} | {len(town.place.houses)} | {seconds:.1f}"
    print(f"| {name} | {blocks} | {front} | {counts} | {uses} |", flush=True)


def judge_towns(paths: list[Path], profile: Profile, seed: int) -> None:
    """Prints the figures of towns on road files."""
    print(
        "| town | blocks | coverage | least | below 85 % | built | core | open | plots | buildings "
        "| s | uses |\n|---|---|---|---|---|---|---|---|---|---|---|---|"
    )
    for path in paths:
        _, surface = read_road(path, 0.1, profile.road)
        start = time.perf_counter()
        town = town_beside(surface, streets_of(surface), profile, seed)
        print_town(path.stem, town, profile, time.perf_counter() - start)


def judge_places(paths: list[Path], profile: Profile, seed: int) -> None:
    """Prints the figures of real places, and of towns on their streets."""
    print("| place | blocks | built | core | open |\n|---|---|---|---|---|")
    for path in paths:
        real = densest(read_osm_place(path), TOWN)
        town = town_on_streets(real.streets, profile, seed)
        for name, place in (("real", real), ("generated", town.place)):
            blocks, built, core, openness = figures(place)
            print(
                f"| {path.name}, {name} | {blocks} | {built:.1%} | {core:.1%} | {openness:.1%} |",
                flush=True,
            )
        full = coverage(town, profile)
        share = np.average(full[:, 0], weights=full[:, 1])
        print(f"coverage {share:.1%}, least {full[:, 0].min():.1%}", flush=True)


def class_images(folder: Path, part: str) -> Iterator[np.ndarray]:
    """Images of classes as CamVid has them: of photographs, or without a part of frames."""
    if part:
        yield from (classes for _, classes in photographs(folder, part))
    else:
        merged = camvid_frame_table()
        yield from (merged[frame.semantic] for frame in read_frames(folder))


def shares(images: Iterator[np.ndarray]) -> np.ndarray:
    """Share of each class, and of none, in whole images and in rows under the horizon, 2 x 8."""
    counts = np.zeros((2, 256))
    for classes in images:
        low, high = (int(share * len(classes)) for share in ROWS)
        for place, rows in enumerate((classes, classes[low:high])):
            counts[place] += np.bincount(rows.ravel(), minlength=256)
    share: np.ndarray = counts[:, [*range(len(CLASSES)), 255]] / counts.sum(axis=1, keepdims=True)
    return share


def judge_frames(columns: list[str]) -> None:
    """Prints the shares of classes in whole images, and under the horizon."""
    found: dict[str, np.ndarray] = {}
    for text in columns:
        name, _, place = text.partition("=")
        folder, _, part = place.partition(":")
        found[name] = shares(class_images(Path(folder), part))
    print(f"| whole, under the horizon | {' | '.join(found)} |\n|---|{'---|' * len(found)}")
    for number, name in enumerate((*CLASSES, "unlabelled")):
        cells = (f"{one[0, number]:.1%}, {one[1, number]:.1%}" for one in found.values())
        print(f"| {name} | {' | '.join(cells)} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("kind", choices=("towns", "places", "frames"))
    parser.add_argument("inputs", nargs="*", help="road files, extracts, or NAME=FOLDER[:PART]")
    parser.add_argument("--environment", default="1/residential")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--bare", action="store_true", help="without the environment's [blocks]")
    options = parser.parse_args()
    if options.kind == "frames":
        judge_frames(options.inputs)
        return
    profile = read_profile(*options.environment.split("/"))
    if options.bare:
        profile = replace(profile, blocks=BlockRules())
    paths = [Path(name) for name in options.inputs]
    if options.kind == "places":
        judge_places(paths, profile, options.seed)
    else:
        demo = ROOT / "asset_library" / "roads" / "town.xodr"
        corpus = [demo, *(CORPUS / f"{name}.xodr" for name in NAMES)]
        judge_towns(paths or [path for path in corpus if path.exists()], profile, options.seed)


if __name__ == "__main__":
    main()

"""Times the terrain of 10 x 10 chunks, and measures ground beside real roads.

Run ``python benchmarks/terrain.py [FILE ...]``; without files those of the corpus are taken
($ENVGEN_SHARED or ../shared), if it is there. The 10 x 10 chunks hold ten winding, hilly roads of
2 km, once on the article's land without relief, once between hills with levelled plots.
"""

import math
import os
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from envgen_usd.chunks import CELL_SIZE, Chunk, chunks_of_points
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.terrain.ground_mesh import build_ground
from envgen_usd.terrain.heightmaps import build_heightmaps
from envgen_usd.terrain.terrain_field import TerrainField, fit_terrain

ROOT = Path(__file__).resolve().parents[1]
CORPUS = Path(os.environ.get("ENVGEN_SHARED", ROOT.parent / "shared")) / "corpus"
NAMES = (
    "carla_test/Town01",
    "carla_test/Town04",
    "carla_test/Town05",
    "esmini/fabriksgatan",
    "malidrive/SmallTownRoads",
    "esmini/curves_elevation",
    "esmini/tunnels",
)
SIDE = 10
BEND = 1.1
"""Radians that a bend of the roads turns by, there and back."""
ARCS = 16


def write_roads(path: Path) -> Path:
    """Writes roads from west to east, one through the middle of each row of chunks."""
    length = 2000.0 / ARCS * (BEND / 2) / math.sin(BEND / 2)
    roads = "".join(_road(row, length) for row in range(SIDE))
    path.write_text(f"<OpenDRIVE><header/>{roads}</OpenDRIVE>", encoding="utf-8")
    return path


def _road(row: int, length: float) -> str:
    chord = 2000.0 / ARCS
    curvature = BEND / length
    geometries = "".join(
        f'<geometry s="{k * length!r}" x="{k * chord!r}" y="{200 * row + 100}" '
        f'hdg="{BEND / 2 * (-1) ** k!r}" length="{length!r}">'
        f'<arc curvature="{-curvature * (-1) ** k!r}"/></geometry>'
        for k in range(ARCS)
    )
    tops = [6.0 * math.sin(1.3 * k + 0.7 * row) for k in range(ARCS + 1)]
    elevations = "".join(
        f'<elevation s="{k * length!r}" a="{tops[k]!r}" b="0" '
        f'c="{3 * (tops[k + 1] - tops[k]) / length**2!r}" '
        f'd="{-2 * (tops[k + 1] - tops[k]) / length**3!r}"/>'
        for k in range(ARCS)
    )
    width = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
    sides = "".join(
        f'<{side}><lane id="{lane}" type="{kind}">{what}</lane></{side}>'
        for side, lane, kind, what in (
            ("left", 1, "driving", width),
            ("center", 0, "none", ""),
            ("right", -1, "driving", width),
        )
    )
    return (
        f'<road id="{row}" length="{ARCS * length!r}" junction="-1"><planView>{geometries}'
        f"</planView><elevationProfile>{elevations}</elevationProfile>"
        f'<lanes><laneSection s="0">{sides}</laneSection></lanes></road>'
    )


def time_map(surface: RoadSurface, relief: float) -> None:
    """Prints the seconds that height maps and ground meshes of the large map take."""
    profile = read_profile("1", "residential")
    rules = replace(profile.terrain, relief=relief)
    chunks = [Chunk(x, y) for x in range(SIDE) for y in range(SIDE)]
    plots = find_plots(RuleProvider().generate(surface, chunks, profile, 0), surface)
    times = [(time.perf_counter(), time.process_time())]
    heightmaps = build_heightmaps(surface, chunks, rules, 0, None, plots)
    times.append((time.perf_counter(), time.process_time()))
    outline = Outline.of(surface)
    for made in heightmaps.values():
        build_ground(made, outline)
    times.append((time.perf_counter(), time.process_time()))
    (maps, maps_cpu), (meshes, meshes_cpu) = np.diff(times, axis=0)
    print(
        f"{len(chunks)} chunks, {len(plots)} plots, relief {relief:g} m: "
        f"height maps {maps:.1f} s (CPU {maps_cpu:.1f} s), "
        f"ground meshes {meshes:.1f} s (CPU {meshes_cpu:.1f} s)"
    )


def measure(path: Path) -> None:
    """Prints how well the ground beside a road keeps to it and to the steepest slope."""
    surface = build_surface(read_network(path))
    rules = read_profile("1", "residential").terrain
    chunks = chunks_of_points(surface.vertices, 60.0)
    start = time.perf_counter()
    field = fit_terrain(surface, rules, 0)
    slopes = np.concatenate([slopes_of(field, chunk) for chunk in chunks])
    seconds = time.perf_counter() - start
    samples, _ = field.outline.samples(0.3)
    error = np.max(np.abs(field(samples) - samples[:, 2]), initial=0.0)
    print(f"{path.stem:16} {len(chunks):3} chunks {seconds:5.1f} s", end="")
    print(f"  road {error:.0e} m  steepest {slopes.max():.2f}", end="")
    print(f"  above {rules.bank_slope:g}: {np.mean(slopes > limit(rules)):.4%}")


def limit(rules: TerrainRules) -> float:
    """Slope above which ground is too steep."""
    return rules.bank_slope + 0.01


def slopes_of(field: TerrainField, chunk: Chunk) -> np.ndarray:
    """Slopes of the cells of a chunk whose corners are all off the road."""
    x, y = chunk.corner_axes()
    heights, road = field.on_grid(x, y), field.outline.encloses_grid(x, y)
    east, north = np.diff(heights, axis=1), np.diff(heights, axis=0)
    slopes = np.hypot((east[1:] + east[:-1]) / 2, (north[:, 1:] + north[:, :-1]) / 2) / CELL_SIZE
    touched = road[1:, 1:] | road[:-1, 1:] | road[1:, :-1] | road[:-1, :-1]
    found: np.ndarray = slopes[~touched]
    return found


def main(paths: list[Path]) -> None:
    """Prints both tables."""
    with tempfile.TemporaryDirectory() as folder:
        surface = build_surface(read_network(write_roads(Path(folder) / "roads.xodr")))
    for relief in (0.0, 8.0):
        time_map(surface, relief)
    for path in paths:
        measure(path)


if __name__ == "__main__":
    corpus = [CORPUS / f"{name}.xodr" for name in NAMES]
    given = [Path(name) for name in sys.argv[1:]]
    main(given or [path for path in corpus if path.exists()])

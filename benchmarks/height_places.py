"""Heights beside the streets of a real place: a network against the membrane.

Streets of an extract of OpenStreetMap are draped over a real elevation model, square by square. A
network is trained on the western half, and on its streets draped over land farther west; it is
measured on squares of the eastern half, which share no cell with them. The columns are those of
`landuse eval` for heights: errors of the ground beside the streets, where the streets alone are
known.

    python benchmarks/height_places.py bayreuth.osm.gz N49E011.hgt N50E011.hgt --out run
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rasterio
import shapely
from rasterio.enums import Resampling
from rasterio.transform import from_origin
from rasterio.warp import reproject

from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL, HeightSample
from envgen_usd.landuse.network.data.road_layouts import AREA, lay_streets
from envgen_usd.landuse.network.heights.drawn_land import land_of_raster
from envgen_usd.landuse.network.heights.height_evaluation import (
    HeightFill,
    HeightWindow,
    by_height_network,
    by_mean,
    by_membrane,
    by_nearest,
    height_table,
    score_heights,
)
from envgen_usd.landuse.network.heights.height_raster_samples import AROUND
from envgen_usd.landuse.network.heights.height_scenes import (
    SQUARE,
    HeightScene,
    make_height_sample,
    on_grid,
    square_centres,
)
from envgen_usd.landuse.network.training.training_run import Run, train
from envgen_usd.landuse.network.training.weights_file import read_network
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.place import Place
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.places.building_figures import street_edges
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.places.osm_tags import SIDEWALK
from envgen_usd.recipe.landuse_runs import network_sizes, training_figures
from envgen_usd.seeds import generator
from envgen_usd.terrain.terrain_field import fit_terrain

HALF = (SQUARE / 2 + AROUND) * HEIGHT_CELL
"""Half of the side of the land around a square, metres."""
ELSEWHERE = np.array([[-35e3, -100e3], [-5e3, 100e3]])
"""Opposite corners of the land farther west, metres from the western border of the extract."""
LEAST_LINE = 10.0
"""Least length of a street in a square, metres."""
AGAIN = 6
"""How often a street's square is draped over other land; a larger value gives more squares."""
LEAST_STREETS = 600.0
"""Least length of all streets in a square, metres."""


def land_heights(files: Sequence[Path], crs: str, middle: FloatArray) -> FloatArray:
    """Heights on cells of heights around a point; row 0 is the south."""
    cells = SQUARE + 2 * AROUND
    found = np.full((cells, cells), np.nan)
    corner = from_origin(middle[0] - HALF, middle[1] + HALF, HEIGHT_CELL, HEIGHT_CELL)
    for path in files:
        with rasterio.open(path) as file:
            part = np.full((cells, cells), np.nan)
            reproject(
                rasterio.band(file, 1),
                part,
                dst_transform=corner,
                dst_crs=crs,
                dst_nodata=np.nan,
                resampling=Resampling.cubic_spline,
            )
        found = np.where(np.isnan(found), part, found)
    return found[::-1]


def squares(  # noqa: PLR0913, PLR0917 - what samples follow from
    place: Place,
    bounds: Sequence[float],
    files: Sequence[Path],
    count: int,
    seed: int,
    spots: FloatArray | None = None,
) -> Iterator[tuple[HeightSample, HeightScene]]:
    """Samples around random points of streets, wholly within bounds, with their scenes.

    With two opposite corners (2 x 2, metres) of other land, streets are draped over random places
    of it.
    """
    edges, widths = street_edges(place.streets)
    half = SQUARE * HEIGHT_CELL / 2.0
    inside = np.array(bounds) + half * np.array([1.0, 1.0, -1.0, -1.0])
    ends = shapely.get_coordinates(shapely.line_interpolate_point(edges, 0.5, normalized=True))
    usable = np.flatnonzero(np.all((ends > inside[:2]) & (ends < inside[2:]), axis=1))
    rng = generator(seed, "heights", "places")
    made = 0
    for number in np.tile(rng.permutation(usable), 1 if spots is None else AGAIN).tolist():
        middle = ends[number]
        box = shapely.box(*(middle - half - 60.0), *(middle + half + 60.0))
        parts, owner = shapely.get_parts(shapely.intersection(edges, box), return_index=True)
        long = shapely.length(parts) >= LEAST_LINE
        spot = middle if spots is None else rng.uniform(*spots)
        heights = land_heights(files, place.crs, spot)
        if np.isnan(heights).any() or shapely.length(parts[long]).sum() < LEAST_STREETS:
            continue
        land = land_of_raster(heights, np.full(2, AREA / 2.0))
        lines = [shapely.get_coordinates(part) - middle + AREA / 2.0 for part in parts[long]]
        wide = widths[owner[long]] + 2.0 * SIDEWALK
        scene = HeightScene(lay_streets(lines, wide.tolist(), land.followed), land, "map")
        yield make_height_sample(scene), scene
        made += 1
        if made == count:
            return


@dataclass(frozen=True)
class PlaceWindow(HeightWindow):
    """A window with its streets."""

    surface: RoadSurface


def by_terrain(window: HeightWindow) -> FloatArray:
    """The ground of a build without a network: plane, membrane and banks, on fine cells."""
    assert isinstance(window, PlaceWindow)
    ground = fit_terrain(window.surface, TerrainRules(0.0, 120.0, 0.5), 0, None)
    return on_grid(ground, *[square_centres()] * 2) - window.sample.reference


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("extract", type=Path)
    parser.add_argument("models", type=Path, nargs="+", help="elevation models, any GDAL raster")
    parser.add_argument("--out", type=Path, required=True, help="run folder")
    parser.add_argument("--train", type=int, default=600, help="western squares")
    parser.add_argument("--elsewhere", type=int, default=2400, help="squares farther west")
    parser.add_argument("--measure", type=int, default=64, help="eastern squares")
    parser.add_argument("--images", type=int, default=56000, help="training windows")
    parser.add_argument("--network", default="unet")
    options = parser.parse_args()
    place = read_osm_place(options.extract)
    west, south, east, north = place.bounds()
    cut = (west + east) / 2.0
    left, right = (west, south, cut, north), (cut, south, east, north)
    farther = ELSEWHERE + np.array([west, 0.0])
    train_on = [one for one, _ in squares(place, left, options.models, options.train, 0)]
    more = squares(place, left, options.models, options.elsewhere, 2, farther)
    train_on += [one for one, _ in more]
    nothing = np.zeros((SQUARE, SQUARE), np.float32)
    windows = [
        PlaceWindow(one, nothing, scene.surface)
        for one, scene in squares(place, right, options.models, options.measure, 1)
    ]
    print(f"squares: {len(train_on)} western, {len(windows)} eastern", flush=True)
    ways: dict[str, HeightFill] = {
        "mean of the road": by_mean,
        "nearest road": by_nearest,
        "ground of a build": by_terrain,
        "membrane": by_membrane,
    }
    print(height_table({name: score_heights(windows, way) for name, way in ways.items()}))
    sizes = network_sizes(options.network, "height", streets=True)
    figures = training_figures(sizes, {"images": options.images}, SQUARE, 0)
    weights = train(Run(options.out), train_on, sizes, figures)
    score = score_heights(windows, by_height_network(read_network(weights, "height")))
    print(height_table({"network": score}).splitlines()[-1], flush=True)


if __name__ == "__main__":
    main()

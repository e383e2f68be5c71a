"""Squares of real places as ground truth for networks."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.landuse.area_statistics import box_statistics, environment_statistics
from envgen_usd.landuse.network.data.landuse_scenes import make_scene
from envgen_usd.landuse.network.data.place_sample import AROUND, PlaceSample
from envgen_usd.landuse.osm_landuse import read_osm
from envgen_usd.landuse.place_landuse import PlaceLand, PlaceMap
from envgen_usd.landuse.plot_territories import separate
from envgen_usd.landuse.shape_cells import cells_of_box
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.place import Houses, Place
from envgen_usd.places.building_figures import STOREY, main_buildings
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.places.osm_tags import SIDEWALK
from envgen_usd.recipe.generated_town import streets_of, town_beside

HALVES = ("west", "east")
LEAST_HOUSES = 4
"""Least number of main buildings in a square; a larger value leaves out more open land."""
LEAST_ROAD = 0.01
"""Least share of road in a square; a larger value leaves out more of them."""

_CHUNKS = tuple(Chunk(x, y) for x in range(-1, 3) for y in range(-1, 3))
"""Chunks of a random layout, whose roads meet in the middle of the inner four, and around it."""


@dataclass(frozen=True, eq=False)
class MappedPlace:
    """A place with the land around its buildings.

    Attributes:
        place: Buildings and streets of the whole place.
        houses: Its main buildings.
        land: Its map, in the same metres.
    """

    place: Place
    houses: Houses
    land: PlaceMap

    @classmethod
    def read(cls, path: Path) -> "MappedPlace":
        """Reads an extract of OpenStreetMap.

        Raises:
            EnvgenError: It cannot be read, or holds no building or no road.
        """
        place = read_osm_place(path)
        extract = read_osm(path, place.crs)
        houses = main_buildings(place.houses)
        return cls(place, houses, PlaceMap(extract, place.streets, houses, SIDEWALK))

    def half(self, name: str) -> tuple[float, float, float, float]:
        """Bounds of the western or the eastern half, cut in the middle of the buildings."""
        west, south, east, north = self.place.bounds()
        middle = (west + east) / 2.0
        return (west, south, middle, north) if name == HALVES[0] else (middle, south, east, north)

    def sample(self, corner: tuple[int, int], side: int) -> PlaceSample:
        """Ground truth of a square.

        Args:
            corner: Column and row of its first cell on the map's lattice.
            side: Cells; even.
        """
        wide = side + 2 * AROUND
        land = self.land.cells((corner[0] - AROUND, corner[1] - AROUND), (wide, wide))
        cut = np.s_[AROUND:-AROUND, AROUND:-AROUND]
        bounds = np.array([*corner, corner[0] + side, corner[1] + side]) * CELL_SIZE
        figures = box_statistics(land.classes[cut], self.houses, bounds.tolist(), STOREY)
        return PlaceSample.of(land, figures)


def place_samples(
    mapped: MappedPlace, bounds: tuple[float, float, float, float], side: int, step: int
) -> Iterator[tuple[tuple[int, int], PlaceSample]]:
    """Squares wholly within bounds that hold streets and buildings, row by row from the south.

    Each comes with the column and the row of its first cell on the map's lattice.

    Args:
        mapped: The place.
        bounds: West, south, east and north end, metres.
        side: Side of a square, cells; even.
        step: Cells from one square to the next.
    """
    west, south, east, north = bounds
    columns = range(math.ceil(west / CELL_SIZE), int(east // CELL_SIZE) - side + 1, step)
    rows = range(math.ceil(south / CELL_SIZE), int(north // CELL_SIZE) - side + 1, step)
    middles = shapely.get_coordinates(shapely.centroid(mapped.houses.footprints)) / CELL_SIZE
    for corner in ((column, row) for row in rows for column in columns):
        inside = np.all((middles >= corner) & (middles < np.add(corner, side)), axis=1)
        if np.count_nonzero(inside) < LEAST_HOUSES:
            continue
        sample = mapped.sample(corner, side)
        if np.mean(sample.classes == LanduseClass.ROAD) >= LEAST_ROAD:
            yield corner, sample


def rule_sample(number: int, seed: int, side: int) -> PlaceSample:
    """Ground truth of a town by rules, as of a place: a random layout, environment and town.

    Its condition is what its environment asks for, as in a build, and not what the square has.

    Args:
        number: Position in the stream of layouts; combinations that are held out never come.
        seed: Seed of the stream.
        side: Side of the square, cells; even.
    """
    scene = make_scene("untold", number, seed)
    surface = scene.surface
    town = town_beside(surface, streets_of(surface), scene.profile, seed + number, _CHUNKS)
    middle = LANDUSE_CELLS - side // 2
    corner, wide = (middle - AROUND, middle - AROUND), side + 2 * AROUND
    land = land_of_maps(town.maps, corner, wide)
    houses = town.place.houses
    numbered = zip(houses.footprints, range(1, len(houses) + 1), strict=True)
    built = separate(cells_of_box(corner, (wide, wide), numbered)) & (land.plots > 0)
    figures = environment_statistics(scene.profile)
    return PlaceSample.of(replace(land, built=built), figures, is_real=False)


def land_of_maps(maps: Mapping[Chunk, LanduseMap], corner: tuple[int, int], side: int) -> PlaceLand:
    """A square of landuse maps, without buildings; land beyond all maps is grass.

    Args:
        maps: Landuse of chunks.
        corner: Column and row of its first cell on the map's lattice.
        side: Cells.
    """
    classes = np.full((side, side), LanduseClass.GRASS, np.uint8)
    plots = np.zeros((side, side), np.int64)
    for chunk, landuse in maps.items():
        column, row = np.array([chunk.x, chunk.y]) * LANDUSE_CELLS - corner
        rows, columns = (_overlap(int(start), side) for start in (row, column))
        if rows is None or columns is None:
            continue
        into, part = (rows[0], columns[0]), (rows[1], columns[1])
        classes[into], plots[into] = landuse.classes[part], landuse.plots[part]
    return PlaceLand(classes, plots, np.zeros((side, side), np.bool_))


def _overlap(start: int, side: int) -> tuple[slice, slice] | None:
    """Cells of a square that a chunk covers along an axis, and the same cells of the chunk."""
    low, high = max(start, 0), min(start + LANDUSE_CELLS, side)
    return (slice(low, high), slice(low - start, high - start)) if low < high else None

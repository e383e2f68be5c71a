"""Trees by landuse, clear of roads, buildings and other trees."""

from collections.abc import Sequence

import numpy as np
import shapely

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.plots.spread_places import spread
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.distribution import drawn
from envgen_usd.models.environment_profile import TreeRules
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.seeds import generator

_DARTS = 6
"""Attempts per tree; more attempts hardly fill a dense wood further."""
_HECTARE = 1e4
_DIGITS = 3
TRUNK = (0.018, 0.03)
"""Diameter of a trunk as a share of the tree's height."""


def place_trees(
    scene: Scene,
    landuse: LanduseMap,
    footprints: Sequence[shapely.Polygon],
    rules: TreeRules,
) -> tuple[CityObject, ...]:
    """Returns the trees of a chunk as ``SolitaryVegetationObject``.

    Trees keep half their spacing from the chunk's border, so that trees across the border keep the
    full spacing.

    Args:
        scene: Scene of the chunk.
        landuse: Landuse of the chunk.
        footprints: Buildings in and around the chunk.
        rules: Densities and sizes of the environment.
    """
    draws = generator(scene.seed, "city", landuse.chunk.name, "trees")
    trees = [
        _scatter(landuse, chosen, density, draws) for chosen, density in _densities(landuse, rules)
    ]
    points = np.concatenate([np.empty((0, 2)), *(places for places, _ in trees)])
    group = np.repeat(np.arange(len(trees)), [len(places) for places, _ in trees])
    order = draws.permutation(len(points))
    points, group = points[order], group[order]
    free = _free(points, scene, rules)
    points, group = points[free], group[free]
    apart = spread(points, rules.spacing)
    points, group = points[apart], group[apart]
    wanted = np.array([count for _, count in trees], dtype=np.int64)
    chosen = _first_of_each(group, wanted)
    points = snap(points[chosen])
    positions = np.column_stack([points, snap(scene.ground.heights(points))])
    return _features(positions, house_distances(points, footprints), scene, rules, draws)


def _densities(landuse: LanduseMap, rules: TreeRules) -> list[tuple[BoolArray, float]]:
    """Cells, and their trees per hectare."""
    classes = landuse.classes
    plot = np.isin(classes, (LanduseClass.LAWN, LanduseClass.RUBBLE, LanduseClass.SCHOOL))
    wild = np.isin(classes, (LanduseClass.GRASS, LanduseClass.VERGE, LanduseClass.UNKNOWN))
    return [
        (classes == LanduseClass.WOOD, rules.wood_density),
        (plot, rules.plot_density),
        (classes == LanduseClass.PARK, rules.park_density),
        (wild, rules.density),
    ]


def _scatter(
    landuse: LanduseMap, cells: BoolArray, density: float, draws: np.random.Generator
) -> tuple[FloatArray, int]:
    """Candidate points, N x 2, and the wanted number of trees."""
    rows, columns = np.nonzero(cells)
    expected = density * len(rows) * CELL_SIZE**2 / _HECTARE
    count = int(expected + draws.random())
    if count == 0:
        return np.empty((0, 2)), 0
    picked = draws.integers(len(rows), size=count * _DARTS)
    cell = np.stack([columns[picked], rows[picked]], axis=1)
    places: FloatArray = (cell + draws.random(cell.shape)) * CELL_SIZE + landuse.chunk.origin
    return places, count


def _free(points: FloatArray, scene: Scene, rules: TreeRules) -> BoolArray:
    inside = points - scene.chunk.origin
    edge = rules.spacing / 2
    free: BoolArray = np.all((inside > edge) & (inside < CHUNK_SIZE - edge), axis=1)
    free &= ~scene.road.near(points, rules.clearance)
    free &= ~scene.taken.near(points, rules.clearance)
    return free


def _first_of_each(group: np.ndarray, wanted: np.ndarray) -> BoolArray:
    """Mask of the first `wanted` elements of each group."""
    rank = np.empty(len(group), dtype=np.int64)
    for number in range(len(wanted)):
        members = np.flatnonzero(group == number)
        rank[members] = np.arange(len(members))
    chosen: BoolArray = rank < wanted[group]
    return chosen


def house_distances(points: FloatArray, footprints: Sequence[shapely.Polygon]) -> FloatArray:
    """Distance of each point (N x 2) from the nearest building, metres; infinite without any."""
    room = np.full(len(points), np.inf)
    if len(footprints) and len(points):
        pairs, distances = shapely.STRtree(footprints).query_nearest(
            shapely.points(points), return_distance=True, all_matches=False
        )
        room[pairs[0]] = distances
    return room


def _features(
    positions: FloatArray,
    room: FloatArray,
    scene: Scene,
    rules: TreeRules,
    draws: np.random.Generator,
) -> tuple[CityObject, ...]:
    count = len(positions)
    tall = drawn(draws, rules.height, count)
    share = drawn(draws, rules.crown, count)
    # The crown of a tree beside a house ends at the wall.
    tall = np.minimum(tall, 2.0 * room / share)
    crown = tall * share
    trunk = tall * draws.uniform(*TRUNK, count)
    turn = draws.uniform(-np.pi, np.pi, count)
    name = f"tree_{scene.chunk.prim_name}"
    sizes = np.column_stack([tall, crown, trunk])
    return tuple(
        tree_feature(f"{name}_{i}", "tree", positions[i], sizes[i], float(turn[i]))
        for i in range(count)
    )


def tree_feature(
    name: str, template: str, position: FloatArray, size: FloatArray, turn: float
) -> CityObject:
    """Returns a tree as ``SolitaryVegetationObject``.

    Args:
        name: Id.
        template: Kind of the placement.
        position: 3, foot of the trunk.
        size: Height, diameter of the crown and of the trunk, metres.
        turn: Heading, radians.
    """
    tall, crown, trunk = np.round(size, _DIGITS).tolist()
    return CityObject(
        id=name,
        kind="SolitaryVegetationObject",
        attributes={"height": tall, "crownDiameter": crown, "trunkDiameter": trunk},
        placement=Placement(position, round(turn, 6), np.array([crown, crown, tall]), template),
    )

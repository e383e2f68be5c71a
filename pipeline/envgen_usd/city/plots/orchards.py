"""Orchards: fruit trees in a grid."""

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, Chunk, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.plots.land_rows import at_points, directions_of, row_axes, span_of
from envgen_usd.city.plots.trees import TRUNK, tree_feature
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.seeds import generator

TEMPLATE = "orchard_tree"
"""Kind of the trees, ``props.orchard_tree`` of an environment; others take ``trees``."""
APART = (5.0, 4.0)
"""Distance of rows, and of trees in a row, metres; larger values give fewer trees."""
HEIGHT = (3.2, 4.6)
"""Least and largest height of a tree, metres."""
CROWN = (0.75, 0.9)
"""Least and largest diameter of a crown, share of the height."""
_EDGE = 2.0
"""Distance of trees from the orchard's edge, metres; a larger value leaves more grass."""
_JITTER = 0.12
"""Largest move of a tree from its place in the grid, metres."""
_CLEARANCE = 2.0
"""Distance from roads and objects, metres."""


def place_orchards(scene: Scene, landuse: LanduseMap, profile: Profile) -> tuple[CityObject, ...]:
    """Returns the trees of the orchards of a chunk as ``SolitaryVegetationObject``.

    Rows of a direction follow one grid of the map, so that they go on across borders of chunks.

    Args:
        scene: Scene of the chunk.
        landuse: Landuse of the chunk.
        profile: The environment; ``props.orchard_tree`` says what the trees are.
    """
    inside = landuse.classes == LanduseClass.ORCHARD
    if not inside.any():
        return ()
    draws = generator(scene.seed, "city", landuse.chunk.name, "orchards")
    rows = directions_of(landuse)
    codes = np.unique(rows[inside]).tolist()
    grids = [_grid(landuse.chunk, row_axes(code)) for code in codes]
    points, of = np.concatenate(grids), np.repeat(codes, [len(grid) for grid in grids])
    points = points + draws.uniform(-_JITTER, _JITTER, points.shape)
    heights = draws.uniform(*HEIGHT, len(points))
    crowns = heights * draws.uniform(*CROWN, len(points))
    trunks = heights * draws.uniform(*TRUNK, len(points))
    turns = draws.uniform(-np.pi, np.pi, len(points))
    free = _within(points, inside, landuse) & (at_points(rows, points, landuse.chunk) == of)
    free &= ~scene.road.near(points, _CLEARANCE) & ~scene.taken.near(points, _CLEARANCE)
    points = snap(points)
    positions = np.column_stack([points, snap(scene.ground.heights(points))])
    sizes = np.column_stack([heights, crowns, trunks])
    template = fruit_tree_kind(profile)
    name = f"{TEMPLATE}_{scene.chunk.prim_name}"
    return tuple(
        tree_feature(f"{name}_{i}", template, positions[i], sizes[i], float(turns[i]))
        for i in np.flatnonzero(free).tolist()
    )


def fruit_tree_kind(profile: Profile) -> str:
    """Kind of fruit trees: their own where the environment says what they are, else ``tree``."""
    return TEMPLATE if TEMPLATE in profile.props else "tree"


def _grid(chunk: Chunk, axes: FloatArray) -> FloatArray:
    """Places of the map's grid in and around a chunk, N x 2, metres; rows run along axes[0]."""
    apart = np.array([APART[1], APART[0]])
    low, high = span_of(chunk, axes)
    first, last = np.ceil(low / apart), np.floor(high / apart)
    x, y = np.meshgrid(*(np.arange(a, b + 1.0) for a, b in zip(first, last, strict=True)))
    places: FloatArray = np.stack([x.ravel(), y.ravel()], axis=1) * apart @ axes
    return places


def _within(points: FloatArray, inside: BoolArray, landuse: LanduseMap) -> BoolArray:
    """True for points that keep the distance from the orchard's edge, and from the chunk's."""
    away = ndimage.distance_transform_edt(inside) * CELL_SIZE
    place = points - landuse.chunk.origin
    own = np.all((place > _JITTER) & (place < CHUNK_SIZE - _JITTER), axis=1)
    within: BoolArray = own & (at_points(away, points, landuse.chunk) >= _EDGE)
    return within

"""Rows of trees beside the roads."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from envgen_usd.chunks import chunk_at, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.feature_ids import ncname
from envgen_usd.city.plots.kerb_places import WideSidewalk, at_kerb, wide_sidewalks
from envgen_usd.city.plots.roadside_rows import row_places
from envgen_usd.city.plots.trees import TRUNK, house_distances, tree_feature
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import AVENUE, CityObject
from envgen_usd.models.distribution import drawn
from envgen_usd.models.environment_profile import StreetTreeRules
from envgen_usd.models.road_surface import RoadLine
from envgen_usd.seeds import generator

KIND = "street_tree"
"""Template of the placements."""
_CLEARANCE = 0.6
"""Least distance of a trunk from every road surface and object, metres.

A larger value places fewer trees.
"""
_LEAST = 0.5
"""Least size of a tree beside a house, as a share of its size in the open.

A larger value leaves more places beside houses empty.
"""
_KERB = 0.6
"""Distance of a trunk from the kerb, metres; a larger value narrows the way of pedestrians."""
_SPREAD = (0.88, 1.0 / 0.88)
"""Range of the trees of a row around its mean."""


def place_street_trees(
    scene: Scene, footprints: Sequence[shapely.Polygon], rules: StreetTreeRules
) -> tuple[CityObject, ...]:
    """Returns the street trees of a chunk as ``SolitaryVegetationObject``.

    The row of a road depends only on the seed and the road, so it runs through all chunks. The
    trees of a row have similar heights. They stand in the sidewalk, at the kerb, where it is wide
    enough, and behind it otherwise. Beside a house a crown ends at the wall; where that leaves
    no tree, and on another road or on an existing object, the place stays empty.

    Args:
        scene: Scene of the chunk; motorways and roads within junctions get no trees.
        footprints: Buildings in and around the chunk.
        rules: Spacing, sides and sizes of the environment.
    """
    trees = []
    lanes = wide_sidewalks(scene, rules.pit_width, max(rules.offset))
    for line in scene.roads.lines_near(scene.chunk.bounds, max(rules.offset)):
        if not (line.junction or line.is_motorway or scene.has(KIND, line.road)):
            trees += _row(line, lanes.get(line.road, ()), rules, scene)
    if not trees:
        return ()
    points = snap(np.array([tree.position for tree in trees]))
    size = np.array([tree.size for tree in trees])
    in_pit = np.array([tree.in_pit for tree in trees])
    room = house_distances(points, footprints)
    # The crown of a tree beside a house ends at the wall.
    scale = np.minimum(1.0, 2.0 * room / size[:, 1])
    fits = (scale >= _LEAST) & ~scene.taken.near(points, _CLEARANCE)
    fits &= in_pit | ~scene.road.near(points, _CLEARANCE)
    places = np.column_stack([points, snap(scene.ground.heights(points))])
    features = []
    for i in np.flatnonzero(fits).tolist():
        name = f"{KIND}_{trees[i].road}_{trees[i].number}"
        feature = tree_feature(name, KIND, places[i], size[i] * scale[i], trees[i].turn)
        features.append(replace(feature, attributes={**feature.attributes, AVENUE: trees[i].road}))
    return tuple(features)


@dataclass(frozen=True)
class _Tree:
    """A planned tree: its row, place (2), and height, crown and trunk in metres."""

    road: str
    number: str
    position: FloatArray
    size: FloatArray
    turn: float
    in_pit: bool


def _row(
    line: RoadLine, sidewalks: Sequence[WideSidewalk], rules: StreetTreeRules, scene: Scene
) -> list[_Tree]:
    """The trees of a road in the chunk."""
    road = ncname(line.road)
    draws = generator(scene.seed, "city", KIND, line.road)
    if draws.random() >= rules.share:
        return []
    tall, share = drawn(draws, rules.height), drawn(draws, rules.crown)
    row = []
    for place in row_places(line, rules, draws, scene.chunk):
        own = generator(scene.seed, "city", KIND, line.road, place.number)
        gap, turn = own.random(), float(own.uniform(-np.pi, np.pi))
        height = tall * own.uniform(*_SPREAD)
        size = height * np.array([1.0, share * own.uniform(*_SPREAD), own.uniform(*TRUNK)])
        pit = at_kerb(place, sidewalks, rules.pit_width, max(rules.offset), _KERB)
        position = place.position if pit is None else pit
        if gap >= rules.gaps and chunk_at(position) == scene.chunk:
            row.append(_Tree(road, place.number, position, size, turn, pit is not None))
    return row

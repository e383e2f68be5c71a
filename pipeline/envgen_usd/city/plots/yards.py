"""Containers, pallets and silos on the free ground of plots."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.headings import heading_of
from envgen_usd.city.plots.spread_places import spread
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.environment_profile import YardRules
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.seeds import generator

_HECTARE = 1e4
_OTHER = "1540"
"""SIG3D code list CityFurniture_function: other furniture."""


@dataclass(frozen=True)
class _Item:
    """A kind of object on yards.

    Attributes:
        template: Kind of asset, and field of `YardRules`.
        size: Length, width and height, metres.
        clearance: Metres from its middle to roads and to what stands there.
    """

    template: str
    size: tuple[float, float, float]
    clearance: float


_ITEMS = (
    _Item("silo", (3.2, 3.2, 10.9), 3.0),
    _Item("container", (6.06, 2.44, 2.59), 4.0),
    _Item("pallets", (1.2, 0.8, 0.72), 1.5),
)
"""Kinds by precedence: what comes first keeps its place."""


def place_yards(
    scene: Scene, landuse: LanduseMap, plots: Sequence[Plot], rules: YardRules
) -> tuple[CityObject, ...]:
    """Returns what stands on the yards of a chunk as ``CityFurniture``, in line with the frontage.

    Args:
        scene: Scene of the chunk.
        landuse: Landuse of the chunk; plots are lawn or rubble.
        plots: Plots in and around the chunk.
        rules: Number of each kind on a hectare of free plot.
    """
    rows, columns = np.nonzero(np.isin(landuse.classes, (LanduseClass.LAWN, LanduseClass.RUBBLE)))
    placed: list[CityObject] = []
    if not len(rows):
        return ()
    for item in _ITEMS:
        draws = generator(scene.seed, "city", landuse.chunk.name, "yard", item.template)
        wanted = float(getattr(rules, item.template)) * len(rows) * CELL_SIZE**2 / _HECTARE
        picked = draws.integers(len(rows), size=int(wanted + draws.random()))
        cells = np.column_stack([columns[picked], rows[picked]])
        points = (cells + draws.random(cells.shape)) * CELL_SIZE + landuse.chunk.origin
        turns = draws.integers(4, size=len(points))
        fits = _free(points, scene, item)
        points, turns = snap(points[fits]), turns[fits]
        apart = spread(points, 2 * item.clearance)
        found = [
            _feature(f"{item.template}_{scene.chunk.prim_name}_{number}", item, place, turn, scene)
            for number, (place, turn) in enumerate(
                zip(points[apart], _headings(points[apart], turns[apart], plots), strict=True)
            )
        ]
        placed += found
        scene = replace(scene, taken=scene.taken.joined(found))
    return tuple(placed)


def _headings(points: FloatArray, turns: IntArray, plots: Sequence[Plot]) -> list[float]:
    """Quarter turns from the frontage of the plot at each point (N x 2)."""
    tree = shapely.STRtree([shapely.Polygon(plot.polygon) for plot in plots])
    headings = []
    for place, turn in zip(points, turns.tolist(), strict=True):
        number = tree.nearest(shapely.Point(place))
        start, end = (np.zeros(2), np.ones(2)) if number is None else plots[number].frontage
        along = end - start
        for _ in range(turn):
            along = np.array([-along[1], along[0]])
        headings.append(heading_of(along))
    return headings


def _feature(name: str, item: _Item, place: FloatArray, heading: float, scene: Scene) -> CityObject:
    position = np.append(place, snap(scene.ground.heights(place[None]))[0])
    placement = Placement(position, heading, np.array(item.size), item.template)
    facts = {"class": "1000", "function": _OTHER}
    return CityObject(name, "CityFurniture", facts, placement=placement)


def _free(points: FloatArray, scene: Scene, item: _Item) -> BoolArray:
    inside = points - scene.chunk.origin
    edge = item.clearance
    free: BoolArray = np.all((inside > edge) & (inside < CHUNK_SIZE - edge), axis=1)
    free &= ~scene.road.near(points, item.clearance)
    free &= ~scene.taken.near(points, item.clearance)
    return free

"""Benches, bins, bollards and hydrants on sidewalks."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import Chunk, chunk_at, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.feature_ids import ncname
from envgen_usd.geometry.square_index import are_near
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.environment_profile import FurnitureRules
from envgen_usd.models.road_surface import LaneLine, RoadLine
from envgen_usd.seeds import generator

_END = 5.0
"""Length of a sidewalk's ends that stay free, metres; a larger value removes furniture near ends.

"""
_LEAST_WIDTH = 1.4
_BOLLARD_SPACING = 1.5
_CLEARANCE = 0.6
"""Metres from what stands already."""
_REACH = 1.0
"""Metres beside a sidewalk within which all that belongs to it stands."""


@dataclass(frozen=True)
class _Kind:
    """A kind of sidewalk furniture.

    Attributes:
        template: Kind of asset.
        function: SIG3D code list CityFurniture_function.
        edge: Distance from the sidewalk's border, metres.
        outside: True for the border away from the road.
        group: Number of adjacent objects.
    """

    template: str
    function: str
    edge: float
    outside: bool
    group: int = 1


_KINDS = (
    _Kind("bench", "1530", 0.45, outside=True),
    _Kind("bin", "1200", 0.35, outside=True),
    _Kind("bollard", "1270", 0.25, outside=False, group=4),
    _Kind("hydrant", "1330", 0.35, outside=False),
)


def place_street_furniture(scene: Scene, rules: FurnitureRules) -> tuple[CityObject, ...]:
    """Returns the furniture of a chunk as ``CityFurniture``.

    The furniture of a sidewalk depends on the seed and the sidewalk alone, not on the chunks.

    Args:
        scene: Scene of the chunk; sidewalks within junctions stay free.
        rules: Spacing of each kind along sidewalks, metres.
    """
    roads = scene.roads.lines
    furniture: list[CityObject] = []
    for lane in scene.roads.pieces.lanes_near(scene.chunk.bounds, _REACH):
        fits = lane.lane_type in ("sidewalk", "walking") and not lane.junction
        if fits and lane.road in roads and len(lane.points) > 1:
            for kind in _KINDS:
                spacing = float(getattr(rules, kind.template))
                if spacing > 0.0:
                    furniture += _along(lane, roads[lane.road], kind, spacing, scene)
    return tuple(furniture)


def _along(
    lane: LaneLine, road: RoadLine, kind: _Kind, spacing: float, scene: Scene
) -> Iterator[CityObject]:
    draws = generator(scene.seed, "city", "furniture", lane.id, kind.template)
    steps = np.linalg.norm(np.diff(lane.points, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    count = int(s[-1] / spacing + draws.random())
    places = np.sort(draws.uniform(_END, max(s[-1] - _END, _END), count))
    each = places[:, None] + np.arange(kind.group) * _BOLLARD_SPACING
    fits = (each <= s[-1] - _END / 2) & (np.interp(each, s, lane.width) >= _LEAST_WIDTH)
    fits &= _near(lane, s, each, scene.chunk)
    for number, member in np.argwhere(fits).tolist():
        position, heading = _stand(lane, road, kind, s, float(each[number, member]))
        if _is_free(position, scene):
            name = f"{kind.template}_{ncname(lane.id)}_{number}_{member}"
            yield _feature(name, kind, position, heading)


def _near(lane: LaneLine, s: FloatArray, each: FloatArray, chunk: Chunk) -> BoolArray:
    """Whether what stands on a sidewalk at each place along it (P x M) may stand in a chunk."""
    middle = [np.interp(each.ravel(), s, lane.points[:, axis]) for axis in (0, 1)]
    reach = float(lane.width.max()) / 2 + _REACH
    return are_near(np.column_stack(middle), chunk.bounds, reach).reshape(each.shape)


def _is_free(position: FloatArray, scene: Scene) -> bool:
    """True for a free position in the chunk."""
    inside = chunk_at(position) == scene.chunk
    return inside and not scene.taken.near(position[None], _CLEARANCE).any()


def _stand(
    lane: LaneLine, road: RoadLine, kind: _Kind, s: FloatArray, at: float
) -> tuple[FloatArray, float]:
    """Position (3) on the sidewalk, and the direction towards the road."""
    middle = np.array([np.interp(at, s, lane.points[:, axis]) for axis in range(3)])
    ahead = np.array([np.interp(at + 0.5, s, lane.points[:, axis]) for axis in (0, 1)])
    behind = np.array([np.interp(at - 0.5, s, lane.points[:, axis]) for axis in (0, 1)])
    along = (ahead - behind) / max(float(np.hypot(*(ahead - behind))), 1e-9)
    normal = np.array([-along[1], along[0]])
    to_road = road.points[np.argmin(((road.points[:, :2] - middle[:2]) ** 2).sum(axis=1)), :2]
    towards = normal if (to_road - middle[:2]) @ normal > 0.0 else -normal
    reach = np.interp(at, s, lane.width) / 2 - kind.edge
    place = middle[:2] + towards * (-reach if kind.outside else reach)
    heading = float(np.arctan2(towards[1], towards[0]))
    return snap(np.append(place, middle[2])), round(heading, 6)


def _feature(name: str, kind: _Kind, position: FloatArray, heading: float) -> CityObject:
    placement = Placement(position, heading, np.zeros(3), kind.template)
    return CityObject(
        name, "CityFurniture", {"class": "1000", "function": kind.function}, placement=placement
    )

"""Benches, bins, bollards and hydrants on sidewalks."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE, Chunk, snap
from envgen_usd.city.names import ncname
from envgen_usd.city.scene import Scene
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import CityObject, Placement
from envgen_usd.models.profile import FurnitureRules
from envgen_usd.models.surface import LaneLine, RoadLine
from envgen_usd.seeds import generator

_END = 5.0
"""Metres of a sidewalk's ends that stay free."""
_LEAST_WIDTH = 1.4
_BOLLARD_SPACING = 1.5
_CLEARANCE = 0.6
"""Metres from what stands already."""


@dataclass(frozen=True)
class _Kind:
    """Something that stands on sidewalks.

    Attributes:
        template: Kind of asset.
        function: SIG3D code list CityFurniture_function.
        edge: Distance from the sidewalk's border, metres.
        outside: True at the border away from the road.
        group: How many stand beside one another.
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
    """Returns the furniture that stands in a chunk as ``CityFurniture``.

    All that stands on a sidewalk is drawn from the seed and the sidewalk alone, so that it does
    not depend on the chunks.

    Args:
        scene: The chunk; sidewalks within junctions stay free.
        rules: The environment's metres of sidewalk for each thing.
    """
    roads = {line.road: line for line in scene.surface.roads}
    found: list[CityObject] = []
    for lane in scene.surface.lanes:
        fits = lane.lane_type in ("sidewalk", "walking") and not lane.junction
        if fits and lane.road in roads and len(lane.points) > 1 and _near(lane, scene.chunk):
            for kind in _KINDS:
                spacing = float(getattr(rules, kind.template))
                if spacing > 0.0:
                    found += _along(lane, roads[lane.road], kind, spacing, scene)
    return tuple(found)


def _near(lane: LaneLine, chunk: Chunk) -> bool:
    low, high = lane.points[:, :2].min(axis=0), lane.points[:, :2].max(axis=0)
    x0, y0, x1, y1 = chunk.bounds
    return bool(low[0] < x1 + 5 and low[1] < y1 + 5 and high[0] > x0 - 5 and high[1] > y0 - 5)


def _along(
    lane: LaneLine, road: RoadLine, kind: _Kind, spacing: float, scene: Scene
) -> Iterator[CityObject]:
    draws = generator(scene.seed, "city", "furniture", lane.id, kind.template)
    steps = np.linalg.norm(np.diff(lane.points, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    count = int(s[-1] / spacing + draws.random())
    places = np.sort(draws.uniform(_END, max(s[-1] - _END, _END), count))
    for number, at in enumerate(places.tolist()):
        for member in range(kind.group):
            here = at + member * _BOLLARD_SPACING
            if here <= s[-1] - _END / 2 and np.interp(here, s, lane.width) >= _LEAST_WIDTH:
                position, heading = _stand(lane, road, kind, s, here)
                if _is_free(position, scene):
                    name = f"{kind.template}_{ncname(lane.id)}_{number}_{member}"
                    yield _feature(name, kind, position, heading)


def _is_free(position: FloatArray, scene: Scene) -> bool:
    """Whether a place lies in the chunk and nothing stands there yet."""
    inside = Chunk(*np.floor(position[:2] / CHUNK_SIZE).astype(int).tolist()) == scene.chunk
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

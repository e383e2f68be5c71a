"""Gullies: the gratings that drain a carriageway, in its gutter along the kerb."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.chunks import chunk_at, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.feature_ids import ncname
from envgen_usd.city.headings import heading_of
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.road_surface import LaneLine, RoadLine
from envgen_usd.seeds import generator

_FROM_KERB = 0.32
"""Metres from the carriageway's border to the middle of a gully."""
_END = 2.0
"""Metres of a lane's ends without gullies."""
_OTHER = "1540"
"""SIG3D code list CityFurniture_function: other furniture."""


def gullies(
    sidewalk: LaneLine, road: RoadLine, spacing: float, scene: Scene
) -> Iterator[CityObject]:
    """Yields the gullies of a chunk on the carriageway beside a sidewalk as ``CityFurniture``.

    Args:
        sidewalk: The sidewalk; its carriageway is the outermost lane for vehicles on its side.
        road: Reference line of the road.
        spacing: Metres between gullies.
        scene: Scene of the chunk.
    """
    driven = scene.roads.abreast(sidewalk)
    lane = max(driven, key=lambda each: abs(each.lane), default=None)
    if lane is None or abs(lane.lane) > abs(sidewalk.lane) or len(lane.points) < 2:
        return
    steps = np.linalg.norm(np.diff(lane.points, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    shift = generator(scene.seed, "city", "gully", lane.id).random()
    places = np.arange(_END + shift * spacing, s[-1] - _END, spacing)
    for number, at in enumerate(places.tolist()):
        place, heading = _in_gutter(lane, road, s, at)
        height = scene.roads.height_at(place)
        if height is not None and chunk_at(place) == scene.chunk:
            position = snap(np.append(place, height))
            placement = Placement(position, heading, np.zeros(3), "gully")
            facts = {"class": "1000", "function": _OTHER}
            name = f"gully_{ncname(lane.id)}_{number}"
            yield CityObject(name, "CityFurniture", facts, placement=placement)


def _in_gutter(
    lane: LaneLine, road: RoadLine, s: FloatArray, at: float
) -> tuple[FloatArray, float]:
    """Place (2) beside the kerb, and the direction towards the road's middle."""
    middle = np.array([np.interp(at, s, lane.points[:, axis]) for axis in (0, 1)])
    nearest = road.points[np.argmin(((road.points[:, :2] - middle) ** 2).sum(axis=1))]
    ends = np.array([np.interp((at - 0.5, at + 0.5), s, lane.points[:, axis]) for axis in (0, 1)])
    along = (ends[:, 1] - ends[:, 0]) / max(float(np.hypot(*(ends[:, 1] - ends[:, 0]))), 1e-9)
    normal = np.array([-along[1], along[0]])
    offset = float((middle - nearest[:2]) @ normal)
    away = normal if offset > 0.0 else -normal
    reach = float(np.interp(at, s, lane.width)) / 2 - _FROM_KERB
    return middle + away * reach, heading_of(-away)

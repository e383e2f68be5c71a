"""Street furniture on sidewalks: seats, bins, posts, signs, boxes, bicycles."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import Chunk, chunk_at, snap
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.feature_ids import ncname
from envgen_usd.city.headings import heading_of
from envgen_usd.city.plots.gullies import gullies
from envgen_usd.geometry.square_index import are_near
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.environment_profile import FurnitureRules
from envgen_usd.models.lanes import WALKED
from envgen_usd.models.road_surface import LaneLine, RoadLine
from envgen_usd.seeds import generator

_END = 5.0
"""Length of a sidewalk's ends that stay free, metres; a larger value removes furniture near ends.

"""
_BOLLARD_SPACING = 1.5
_CLEARANCE = 0.6
"""Metres from what stands already."""
_REACH = 1.0
"""Metres beside a sidewalk within which all that belongs to it stands."""
_CELL = 0.25
"""Metres of the cells along a sidewalk that furniture takes; larger cells leave larger gaps."""


@dataclass(frozen=True)
class _Kind:
    """A kind of sidewalk furniture; metres.

    Attributes:
        template: Kind of asset, and field of `FurnitureRules`.
        function: SIG3D code list CityFurniture_function.
        edge: Distance from the sidewalk's border; at the kerb, the nearest part of each kind stays
            0.3 behind it.
        outside: True for the border away from the road.
        group: Number of adjacent objects.
        length: Length that one takes along the sidewalk.
        width: Least width of the sidewalk.
        turn: Angle from the direction towards the road to the front, radians.
    """

    template: str
    function: str
    edge: float
    outside: bool
    group: int = 1
    length: float = 0.6
    width: float = 1.4
    turn: float = 0.0


_KINDS = (
    _Kind("bus_stop", "1110", 0.95, outside=True, length=4.6, width=3.0),
    _Kind("bench", "1530", 0.45, outside=True, length=2.0),
    _Kind("bin", "1200", 0.35, outside=True),
    _Kind("bollard", "1270", 0.45, outside=False, group=4, length=0.3),
    _Kind("hydrant", "1330", 0.55, outside=False),
    _Kind("bicycle_rack", "1540", 1.15, outside=False, length=2.0, width=3.0),
    _Kind("control_box", "1060", 0.35, outside=True, length=1.0, width=1.8),
    _Kind("hoarding", "1090", 0.75, outside=True, length=0.8, width=2.2, turn=np.pi / 2),
    _Kind("mailbox", "1020", 0.4, outside=True),
    _Kind("parking_meter", "1540", 0.55, outside=False),
    _Kind("phone_box", "1010", 0.6, outside=True, length=1.2, width=2.2),
    _Kind("pole", "1270", 0.45, outside=False, width=1.2),
    # The face looks against right-hand traffic beside the sidewalk.
    _Kind("street_sign", "1070", 0.65, outside=False, width=1.2, turn=np.pi / 2),
)
"""Kinds by precedence: what comes first keeps its place."""
FUNCTIONS = {kind.template: kind.function for kind in _KINDS}
"""Code of the SIG3D list CityFurniture_function of each template."""


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
        fits = lane.lane_type in WALKED and not lane.junction
        if fits and lane.road in roads and len(lane.points) > 1:
            furniture += _on_sidewalk(lane, roads[lane.road], rules, scene)
            if rules.gully > 0.0:
                furniture += gullies(lane, roads[lane.road], rules.gully, scene)
    return tuple(furniture)


def _on_sidewalk(
    lane: LaneLine, road: RoadLine, rules: FurnitureRules, scene: Scene
) -> Iterator[CityObject]:
    """Furniture of a sidewalk; each kind leaves free what earlier kinds take on its side."""
    steps = np.linalg.norm(np.diff(lane.points, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    taken = {side: np.zeros(int(s[-1] / _CELL) + 2, dtype=np.int64) for side in (False, True)}
    for kind in _KINDS:
        spacing = float(getattr(rules, kind.template))
        if spacing > 0.0 and not scene.has(kind.template, lane.road):
            yield from _along(lane, road, kind, spacing, s, taken[kind.outside], scene)


def _along(  # noqa: PLR0913, PLR0917 - what a row follows from
    lane: LaneLine,
    road: RoadLine,
    kind: _Kind,
    spacing: float,
    s: FloatArray,
    taken: IntArray,
    scene: Scene,
) -> Iterator[CityObject]:
    """Furniture of a kind; counts its cells in `taken`."""
    draws = generator(scene.seed, "city", "furniture", lane.id, kind.template)
    count = int(s[-1] / spacing + draws.random())
    places = np.sort(draws.uniform(_END, max(s[-1] - _END, _END), count))
    each = places[:, None] + np.arange(kind.group) * _BOLLARD_SPACING
    fits = (each <= s[-1] - _END / 2) & (np.interp(each, s, lane.width) >= kind.width)
    fits &= _untaken(each, kind.length, taken)
    _take(each[fits], kind.length, taken)
    fits &= _near(lane, s, each, scene.chunk)
    for number, member in np.argwhere(fits).tolist():
        position, heading = _stand(lane, road, kind, s, float(each[number, member]))
        if _is_free(position, scene):
            name = f"{kind.template}_{ncname(lane.id)}_{number}_{member}"
            yield _feature(name, kind, position, heading)


def _cells(each: FloatArray, length: float, count: int) -> tuple[IntArray, IntArray]:
    """First cell, and the cell after the last, of what is so long and stands at each place."""
    first = np.clip((each - length / 2) / _CELL, 0, count - 1).astype(np.int64)
    after = np.clip((each + length / 2) / _CELL + 1, 1, count).astype(np.int64)
    return first, after


def _untaken(each: FloatArray, length: float, taken: IntArray) -> BoolArray:
    """Whether the cells of each place are free (any shape)."""
    first, after = _cells(each, length, len(taken))
    before = np.concatenate([[0], np.cumsum(taken > 0)])
    free: BoolArray = before[after] == before[first]
    return free


def _take(each: FloatArray, length: float, taken: IntArray) -> None:
    """Counts the cells of each place (N)."""
    first, after = _cells(each, length, len(taken))
    ends = np.zeros(len(taken) + 1, dtype=np.int64)
    np.add.at(ends, first, 1)
    np.add.at(ends, after, -1)
    taken += np.cumsum(ends)[:-1]


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
    """Position (3) on the sidewalk, and the direction of the front."""
    middle = np.array([np.interp(at, s, lane.points[:, axis]) for axis in range(3)])
    ahead = np.array([np.interp(at + 0.5, s, lane.points[:, axis]) for axis in (0, 1)])
    behind = np.array([np.interp(at - 0.5, s, lane.points[:, axis]) for axis in (0, 1)])
    along = (ahead - behind) / max(float(np.hypot(*(ahead - behind))), 1e-9)
    normal = np.array([-along[1], along[0]])
    to_road = road.points[np.argmin(((road.points[:, :2] - middle[:2]) ** 2).sum(axis=1)), :2]
    towards = normal if (to_road - middle[:2]) @ normal > 0.0 else -normal
    reach = np.interp(at, s, lane.width) / 2 - kind.edge
    place = middle[:2] + towards * (-reach if kind.outside else reach)
    heading = float(np.arctan2(towards[1], towards[0])) + kind.turn
    direction = np.array([np.cos(heading), np.sin(heading)])
    return snap(np.append(place, middle[2])), heading_of(direction)


def _feature(name: str, kind: _Kind, position: FloatArray, heading: float) -> CityObject:
    placement = Placement(position, heading, np.zeros(3), kind.template)
    return CityObject(
        name, "CityFurniture", {"class": "1000", "function": kind.function}, placement=placement
    )

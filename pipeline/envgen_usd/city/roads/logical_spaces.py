"""Reference lines and lane borders as logical spaces."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.chunks import GRID, snap
from envgen_usd.city.feature_ids import ncname
from envgen_usd.city.roads.chunk_pieces import piece_name
from envgen_usd.city.roads.traffic_spaces import RoadPart
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.road_surface import LaneLine


def make_lines(part: RoadPart) -> tuple[CityObject, ...]:
    """Returns reference lines and the borders of all lanes as ``GenericLogicalSpace``.

    Lines are cut at the chunk's border, as centre lines are.
    """
    spaces = []
    for name, points, facts in _lines(part):
        runs = part.pieces.whole_or_cut(points)
        inside = tuple(run for tile, run in runs if tile == part.chunk)
        if inside:
            piece = piece_name(name, {tile for tile, _ in runs}, part.chunk)
            curves = {"lod2MultiCurve": inside}
            spaces.append(CityObject(piece, "GenericLogicalSpace", facts, curves=curves))
    return tuple(spaces)


def _lines(part: RoadPart) -> Iterator[tuple[str, FloatArray, dict[str, Attribute]]]:
    bounds = part.pieces.bounds_of(part.chunk)
    for road in part.roads.lines_near(bounds, GRID):
        facts: dict[str, Attribute] = {"class": "referenceLine", "opendrive_road": road.road}
        yield f"ReferenceLine_{ncname(road.road)}", snap(road.points), facts
    for lane in part.pieces.lanes_near(bounds, GRID):
        for side, sign in (("left", 1.0), ("right", -1.0)):
            facts = {
                "class": "laneBoundary",
                "opendrive_road": lane.road,
                "opendrive_section": lane.section,
                "opendrive_lane": lane.lane,
            }
            yield f"{lane.id}_{side}_border", _border(lane, sign), facts


def _border(lane: LaneLine, side: float) -> FloatArray:
    """Border of a lane, N x 3, in the direction of travel."""
    step = np.gradient(lane.points[:, :2], axis=0)
    along = step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-12)
    normal = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(along))])
    return snap(lane.points + side * lane.width[:, None] / 2 * normal)

"""Reference lines and borders of lanes as logical spaces."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.city.chunk_pieces import piece_name
from envgen_usd.city.names import ncname
from envgen_usd.city.traffic_spaces import RoadPart
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import Attribute, CityObject
from envgen_usd.models.surface import LaneLine


def make_lines(part: RoadPart) -> tuple[CityObject, ...]:
    """Returns reference lines and the borders of all lanes as ``GenericLogicalSpace``.

    Lines are cut at the chunk's border, as centre lines are.
    """
    found = []
    for name, points, facts in _lines(part):
        runs = part.pieces.whole_or_cut(points)
        inside = tuple(run for tile, run in runs if tile == part.chunk)
        if inside:
            piece = piece_name(name, {tile for tile, _ in runs}, part.chunk)
            curves = {"lod2MultiCurve": inside}
            found.append(CityObject(piece, "GenericLogicalSpace", facts, curves=curves))
    return tuple(found)


def _lines(part: RoadPart) -> Iterator[tuple[str, FloatArray, dict[str, Attribute]]]:
    for road in part.surface.roads:
        facts: dict[str, Attribute] = {"class": "referenceLine", "opendrive_road": road.road}
        yield f"ReferenceLine_{ncname(road.road)}", snap(road.points), facts
    for lane in part.surface.lanes:
        for side, sign in (("left", 1.0), ("right", -1.0)):
            facts = {
                "class": "laneBoundary",
                "opendrive_road": lane.road,
                "opendrive_section": lane.section,
                "opendrive_lane": lane.lane,
            }
            yield f"{lane.id}_{side}_border", _border(lane, sign), facts


def _border(lane: LaneLine, side: float) -> FloatArray:
    """Border of a lane, N x 3, seen in the direction of travel."""
    step = np.gradient(lane.points[:, :2], axis=0)
    along = step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-12)
    normal = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(along))])
    return snap(lane.points + side * lane.width[:, None] / 2 * normal)

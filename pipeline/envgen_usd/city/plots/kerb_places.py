"""Places at the kerb of wide sidewalks; where a sidewalk is narrow, they lie behind the road."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.city.city_scene import Scene
from envgen_usd.city.plots.roadside_rows import RowPlace
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanes import WALKED

_END = 5.0
"""Length of a sidewalk's ends with nothing at the kerb, metres; more keeps crossings in view."""
_STEP = 0.5
"""Metres by which a place may lie farther from its sidewalk than its offset says."""


@dataclass(frozen=True)
class WideSidewalk:
    """A sidewalk.

    Attributes:
        line: Centre line in plan.
        s: Distances along it, N, metres.
        width: Width at each, N, metres.
    """

    line: shapely.LineString
    s: FloatArray
    width: FloatArray


def wide_sidewalks(
    scene: Scene, width: float, reach: float
) -> Mapping[str, Sequence[WideSidewalk]]:
    """Sidewalks outside of junctions that are wide somewhere, by road.

    Args:
        scene: Scene of a chunk.
        width: Least width, metres.
        reach: Metres around the chunk in which sidewalks are wanted.
    """
    found: dict[str, list[WideSidewalk]] = defaultdict(list)
    for lane in scene.roads.pieces.lanes_near(scene.chunk.bounds, reach):
        wide = lane.width.max(initial=0.0) >= width
        if wide and lane.lane_type in WALKED and not lane.junction:
            plan = lane.points[:, :2]
            s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(plan, axis=0), axis=1))])
            found[lane.road].append(WideSidewalk(shapely.LineString(plan), s, lane.width))
    return found


def at_kerb(
    place: RowPlace, sidewalks: Sequence[WideSidewalk], width: float, offset: float, away: float
) -> FloatArray | None:
    """The place (2) at the kerb of the sidewalk before a place; `None` without a wide one.

    Args:
        place: A place behind the road.
        sidewalks: Wide sidewalks of the road.
        width: Least width of the sidewalk there, metres.
        offset: Largest distance of places from the road's outer border, metres.
        away: Distance from the kerb, metres.
    """
    for sidewalk in sidewalks:
        line = sidewalk.line
        at = line.project(shapely.Point(place.position))
        foot = np.array(line.interpolate(at).coords[0])
        there = float(np.interp(at, sidewalk.s, sidewalk.width))
        distance = float(np.hypot(*(place.position - foot)))
        if (
            _END <= at <= line.length - _END
            and there >= width
            and distance <= there / 2 + offset + _STEP
        ):
            towards = np.array([np.cos(place.heading), np.sin(place.heading)])
            kerb: FloatArray = foot + towards * (there / 2 - away)
            return kerb
    return None

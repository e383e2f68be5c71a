"""Borders of the lanes of a section: t, height and position (1.8.1, 11.4 to 11.7)."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.built_lanes import built_lanes
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate
from envgen_usd.opendrive.geometry.lateral_profile import lateral_height
from envgen_usd.opendrive.geometry.road_frame import road_frames
from envgen_usd.opendrive.geometry.section_stack import SectionStack


@dataclass(frozen=True)
class LaneBorders:
    """Borders of L lanes of a section at N positions, from the leftmost to the rightmost.

    Attributes:
        s: N, metres along the reference line.
        t: N x (L + 1), metres, t of each border, descending along a row.
        lanes: L lanes from left to right, without the centre lane.
        height_left: N x L, metres above the road at each lane's left border.
        height_right: N x L, metres above the road at each lane's right border.
    """

    s: FloatArray
    t: FloatArray
    lanes: tuple[Lane, ...]
    height_left: FloatArray
    height_right: FloatArray


def lane_borders(road: Road, section: LaneSection, s: FloatArray) -> LaneBorders:
    """Evaluates all lanes of a section at each s (N, metres).

    Width has priority over border; negative widths count as zero.
    """
    stack, owner = SectionStack([(road, section)]), np.zeros(len(s), dtype=np.int64)
    lanes = built_lanes(section)
    return LaneBorders(s, stack.borders(owner, s), lanes, *stack.heights(owner, s))


def stacked_points(
    stack: SectionStack, owner: IntArray, s: FloatArray, t: FloatArray
) -> FloatArray:
    """Returns points of stacked sections; see `section_points`.

    Args:
        stack: Lane sections.
        owner: N ascending, index of the section.
        s: N, metres along the reference line.
        t: N x K, metres to the left.

    Returns:
        N x K x 3, metres, road frame.
    """
    points = _level_points(*stack.line(owner, s), stack.elevation(owner, s), t)
    for number, (road, section) in enumerate(stack.places):
        if not _is_plain(road, section):
            rows = slice(*np.searchsorted(owner, [number, number + 1]))
            points[rows] = section_points(road, section, s[rows], t[rows])
    return points


def section_points(road: Road, section: LaneSection, s: FloatArray, t: FloatArray) -> FloatArray:
    """Returns points on the road without lane heights; ``level`` lanes do not tilt (11.4).

    Args:
        road: The road.
        section: Lane section of all s.
        s: N, metres along the reference line.
        t: N x K, metres to the left.

    Returns:
        N x K x 3, metres, road frame.
    """
    if _is_plain(road, section):
        return _level_points(*evaluate(road.plan_view, s), road.elevation(s), t)
    lowest, highest = _tilting_range(road, section, s)
    tilting = np.clip(t, lowest[:, None], highest[:, None])
    frames = road_frames(road, s)
    columns = t.shape[1]
    height = lateral_height(road, np.repeat(s, columns), tilting.ravel()).reshape(t.shape)
    level = np.column_stack([-frames.forward[:, 1], frames.forward[:, 0], np.zeros(len(s))])
    level /= np.maximum(np.linalg.norm(level, axis=1), 1e-12)[:, None]
    points: FloatArray = (
        frames.origin[:, None]
        + tilting[..., None] * frames.left[:, None]
        + height[..., None] * frames.up[:, None]
        + (t - tilting)[..., None] * level[:, None]
    )
    return points


def _level_points(
    x: FloatArray, y: FloatArray, heading: FloatArray, z: FloatArray, t: FloatArray
) -> FloatArray:
    """Returns points (N x K x 3) to the left of a line, at its height."""
    points = np.empty((*t.shape, 3))
    points[..., 0] = x[:, None] - t * np.sin(heading)[:, None]
    points[..., 1] = y[:, None] + t * np.cos(heading)[:, None]
    points[..., 2] = z[:, None]
    return points


def _is_plain(road: Road, section: LaneSection) -> bool:
    """Returns whether the road is level across everywhere, so that t lies in the plan."""
    if road.cross_section is not None or road.shapes is not None:
        return False
    if road.superelevation.coefficients.any():
        return False
    return not any(lane.level for lane in (*section.left, *section.right))


def _tilting_range(
    road: Road, section: LaneSection, s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns the lowest and highest t of the tilted part: inner borders of first level lanes."""
    t = lane_borders(road, section, s).t
    limits = []
    for lanes, sign in ((section.right, -1), (section.left, 1)):
        first = next((k for k, lane in enumerate(lanes) if lane.level), None)
        inner = None if first is None else t[:, len(section.left) - sign * first]
        limits.append(np.full_like(s, sign * np.inf) if inner is None else inner)
    return limits[0], limits[1]

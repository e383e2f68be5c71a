"""Borders of the lanes of a section: t, height and position (1.8.1, 11.4 to 11.7)."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.built_lanes import built_lanes
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate
from envgen_usd.opendrive.geometry.lateral_profile import lateral_height
from envgen_usd.opendrive.geometry.road_frame import road_frames


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
    ds = s - section.s
    centre = road.lane_offset(s)
    left = _side(section.left, ds, centre, 1.0)
    right = _side(section.right, ds, centre, -1.0)
    t = np.column_stack([*reversed(left), centre, *right])
    lanes = built_lanes(section)
    height_left, height_right = np.zeros((2, len(s), len(lanes)))
    for column, lane in enumerate(lanes):
        if len(lane.height):
            inner, outer = _lane_height(lane, ds)
            height_left[:, column] = outer if lane.id > 0 else inner
            height_right[:, column] = inner if lane.id > 0 else outer
    return LaneBorders(s, t, lanes, height_left, height_right)


def _side(
    lanes: tuple[Lane, ...], ds: FloatArray, centre: FloatArray, sign: float
) -> list[FloatArray]:
    """Returns the outer border of each lane as t, outwards."""
    borders = []
    inner = centre
    for lane in lanes:
        if len(lane.width.start) or not len(lane.border.start):
            outer = inner + sign * np.maximum(lane.width(ds), 0.0)
        else:
            outer = lane.border(ds)
            outer = np.maximum(outer, inner) if sign > 0 else np.minimum(outer, inner)
        borders.append(outer)
        inner = outer
    return borders


def _lane_height(lane: Lane, ds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns inner and outer height, N each; constant from each entry to the next."""
    entry = np.searchsorted(lane.height[:, 0], ds + 1e-9, side="right") - 1
    heights = np.where((entry >= 0)[:, None], lane.height[np.maximum(entry, 0), 1:], 0.0)
    return heights[:, 0], heights[:, 1]


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
        x, y, heading = evaluate(road.plan_view, s)
        plain = np.empty((*t.shape, 3))
        plain[..., 0] = x[:, None] - t * np.sin(heading)[:, None]
        plain[..., 1] = y[:, None] + t * np.cos(heading)[:, None]
        plain[..., 2] = road.elevation(s)[:, None]
        return plain
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
    centre = road.lane_offset(s)
    limits = []
    for lanes, sign in ((section.right, -1.0), (section.left, 1.0)):
        first = next((k for k, lane in enumerate(lanes) if lane.level), None)
        if first is None:
            limits.append(np.full_like(s, sign * np.inf))
        else:
            inner = [centre, *_side(lanes[:first], s - section.s, centre, sign)]
            limits.append(inner[-1])
    return limits[0], limits[1]

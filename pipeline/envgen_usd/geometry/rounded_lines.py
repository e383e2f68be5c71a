"""Polylines with rounded corners: straight pieces and arcs with continuous heading."""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray

_LEAST_TURN = 1e-4
"""Turn in radians below which a corner stays; a larger value leaves visible kinks."""
_BACK = np.radians(160.0)
"""Turn from which a polyline goes back and has no arc."""
_LEAST_PIECE = 0.02
"""Least length of a piece, metres; shorter ones join their neighbour's end."""


@dataclass(frozen=True, eq=False)
class RoundedLine:
    """Lines and arcs, one after the other.

    Attributes:
        s: P, distance of each piece's begin, metres.
        start: P x 2, where it begins.
        heading: P, radians from x.
        curvature: P, 1/m, positive to the left; 0 for a line.
        length: Metres of the whole.
    """

    s: FloatArray
    start: FloatArray
    heading: FloatArray
    curvature: FloatArray
    length: float

    def __call__(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points (N x 2) and headings (N) at distances along it."""
        piece = np.clip(np.searchsorted(self.s, s, "right") - 1, 0, len(self.s) - 1)
        ahead, bend = np.asarray(s) - self.s[piece], self.curvature[piece]
        # A chord of an arc of length l turns by half of the arc, and has length l sinc(l k / 2).
        half = 0.5 * ahead * bend
        chord = ahead * np.sinc(half / np.pi)
        way = self.heading[piece] + half
        points = self.start[piece] + chord[:, None] * np.stack([np.cos(way), np.sin(way)], axis=1)
        return points, self.heading[piece] + 2.0 * half

    def part(self, first: float, last: float) -> "RoundedLine":
        """The part between two distances."""
        inner = self.s[(self.s > first + _LEAST_PIECE) & (self.s < last - _LEAST_PIECE)]
        s = np.concatenate([[first], inner])
        start, heading = self(s)
        # The first distance may lie just before a piece that is left out.
        middle = (s + np.append(s[1:], last)) / 2.0
        piece = np.clip(np.searchsorted(self.s, middle, "right") - 1, 0, len(self.s) - 1)
        return RoundedLine(s - first, start, heading, self.curvature[piece], last - first)


def rounded_line(points: FloatArray, radius: float, most_away: float) -> RoundedLine:
    """Rounds the corners of a polyline by arcs that touch both sides.

    An arc of radius R at a corner that turns by w touches R tan(w / 2) before and after it, and
    passes it at R (1 / cos(w / 2) - 1). Arcs take at most half of a side.

    Args:
        points: N x 2, none equal to its neighbour.
        radius: Least radius where there is room, metres.
        most_away: Distance from a corner up to which a larger radius is taken, metres.
    """
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    way = np.arctan2(steps[:, 1], steps[:, 0])
    turn = (np.diff(way) + np.pi) % (2.0 * np.pi) - np.pi
    half = np.minimum(np.abs(turn) / 2.0, np.radians(80.0))
    beyond = np.maximum(1.0 / np.cos(half) - 1.0, 1e-12)
    wanted = np.maximum(radius, most_away / beyond)
    reach = np.minimum(wanted * np.tan(half), 0.499 * np.minimum(lengths[:-1], lengths[1:]))
    reach = np.where((np.abs(turn) < _LEAST_TURN) | (np.abs(turn) > _BACK), 0.0, reach)
    bend = np.sign(turn) * np.tan(half) / np.maximum(reach, 1e-9)
    before, after = np.append(0.0, reach), np.append(reach, 0.0)
    units = steps / lengths[:, None]
    straight = lengths - before - after
    arc = np.abs(turn) * np.where(reach > 0.0, 1.0 / np.maximum(np.abs(bend), 1e-12), 0.0)
    count = 2 * len(lengths) - 1
    starts, headings, sizes, bends = (
        np.zeros((count, 2)), np.zeros(count), np.zeros(count), np.zeros(count)
    )  # fmt: skip
    starts[::2], headings[::2], sizes[::2] = points[:-1] + before[:, None] * units, way, straight
    starts[1::2] = points[1:-1] - reach[:, None] * units[:-1]
    headings[1::2], sizes[1::2], bends[1::2] = way[:-1], arc, np.where(reach > 0.0, bend, 0.0)
    kept = sizes > 1e-6
    ends = np.cumsum(sizes[kept])
    return RoundedLine(
        np.append(0.0, ends[:-1]), starts[kept], headings[kept], bends[kept], float(ends[-1])
    )


def thinned(points: FloatArray, away: float, nearest: float) -> FloatArray:
    """A polyline without points that lie nearly on it or close to their predecessor.

    Args:
        points: N x 2.
        away: Largest distance of a point that is left out from the line, metres.
        nearest: Least distance between points, metres; ends stay.
    """
    simple = shapely.get_coordinates(shapely.simplify(shapely.LineString(points), away))
    kept = [simple[0]]
    for point in simple[1:-1]:
        if np.hypot(*(point - kept[-1])) >= nearest:
            kept.append(point)
    if len(kept) > 1 and np.hypot(*(simple[-1] - kept[-1])) < nearest:
        kept.pop()
    return np.array([*kept, simple[-1]])

"""Smooth reference lines along a border, square to the seams at both ends."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import diags, eye
from scipy.sparse.linalg import splu

from envgen_usd.geometry.hermite_curves import Cubic, hermite_cubic
from envgen_usd.models.array_types import FloatArray
from envgen_usd.streets.lanelets.road_seams import Seam

OVERHANG = 12.0
"""Length by which borders go on beyond both ends of their road, metres."""
_STEP = 1.0
"""Distance of the points that are smoothed, metres."""
_STIFF = 20.0
"""Weight of bends against distances; a larger value cuts corners of the border more."""
_OFF = 0.02
"""Largest distance of a cubic from the smoothed points, metres."""
_DENSE = 0.25
"""Distance of the points at which a curve is looked up, metres."""
_BEYOND = 30.0
"""Length by which a curve goes on straight beyond its ends for the lookup, metres."""
_LEAST = 0.05
"""Least length of a road, metres."""
_NEWTON = 4
_RING = 4.0
"""Turn of a curve from which it comes near itself, radians."""
_LOOKUP = (64, 20.0), (8, 3.0)
"""Number of points that are looked up at a time, and the length by which they may lie farther on
than their own, metres: on any curve, and on one that comes near itself."""


@dataclass(frozen=True, eq=False)
class ReferenceCurve:
    """Cubics with continuous heading, with places by s as OpenDRIVE has them.

    Attributes:
        pieces: The cubics.
    """

    pieces: tuple[Cubic, ...]

    @cached_property
    def starts(self) -> FloatArray:
        """S at which each piece begins, and the length."""
        lengths = np.array([piece.length for piece in self.pieces])
        return np.concatenate([[0.0], np.cumsum(lengths)])

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.starts[-1])

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places (N x 2) and headings (N) at distances along it; straight on beyond its ends."""
        inside = np.clip(s, 0.0, self.length)
        n = np.clip(np.searchsorted(self.starts, inside, "right") - 1, 0, len(self.pieces) - 1)
        p = (inside - self.starts[n]) / np.array([piece.length for piece in self.pieces])[n]
        powers = np.stack([p, p**2, p**3])
        slopes = np.stack([np.ones_like(p), 2.0 * p, 3.0 * p**2])
        along = np.array([piece.along for piece in self.pieces])[n].T
        across = np.array([piece.across for piece in self.pieces])[n].T
        u, v = (along * powers).sum(0), (across * powers).sum(0)
        turn = np.arctan2((across * slopes).sum(0), (along * slopes).sum(0))
        first = np.array([piece.heading for piece in self.pieces])[n]
        cosine, sine = np.cos(first), np.sin(first)
        start = np.array([piece.start for piece in self.pieces])[n]
        places = start + np.column_stack([u * cosine - v * sine, u * sine + v * cosine])
        heading = first + turn
        out = (s - inside)[:, None]
        return places + out * np.column_stack([np.cos(heading), np.sin(heading)]), heading

    @cached_property
    def _dense(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        count = max(int(np.ceil(self.length / _DENSE)), 4)
        outer = np.arange(_DENSE, _BEYOND + _DENSE, _DENSE)
        s = np.concatenate([-outer[::-1], np.linspace(0.0, self.length, count + 1)])
        s = np.concatenate([s, self.length + outer])
        places, heading = self.at(s)
        return s, places, np.unwrap(heading)

    def located(
        self, points: FloatArray, begin: float | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """S and t of the points of a line (N x 2) that runs along the curve.

        Each block of points is looked up near the one before it, so that a curve that comes near
        itself is not left.

        Args:
            points: The points, metres.
            begin: S near which the first point lies; without it, it is looked up everywhere.
        """
        s, places, heading = self._dense
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        block, slack = _LOOKUP[bool(np.ptp(heading) > _RING)]
        at = -1 if begin is None else int(np.searchsorted(s, begin))
        found = _followed(points, places, steps, at, (block, int(slack / _DENSE)))
        value = s[found]
        for _ in range(_NEWTON):
            here, turn = self.at(value)
            away = points - here
            ahead = (away * np.column_stack([np.cos(turn), np.sin(turn)])).sum(1)
            t = -away[:, 0] * np.sin(turn) + away[:, 1] * np.cos(turn)
            bend = np.interp(value, 0.5 * (s[1:] + s[:-1]), np.diff(heading) / np.diff(s))
            value += np.clip(ahead / np.maximum(1.0 - bend * t, 0.2), -_DENSE, _DENSE)
        here, turn = self.at(value)
        away = points - here
        return value, -away[:, 0] * np.sin(turn) + away[:, 1] * np.cos(turn)


def _followed(
    points: FloatArray,
    places: FloatArray,
    steps: FloatArray,
    at: int,
    lookup: tuple[int, int],
) -> FloatArray:
    """Nearest places of a line's points, found in blocks along the line.

    A block of points lies within a window after the nearest place of the point before it: place
    number `at` for the first one, anywhere where that is negative.
    """
    block, slack = lookup
    found = np.empty(len(points), int)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    for first in range(0, len(points), block):
        rows = slice(first, min(first + block, len(points)))
        if at < 0:
            low, high = 0, len(places)
        else:
            length = along[rows.stop - 1] - along[max(first - 1, 0)]
            reach = int(2.0 * length / _DENSE) + slack
            low, high = max(at - slack, 0), min(at + reach, len(places))
        near = places[low:high]
        square = ((points[rows, None] - near[None]) ** 2).sum(2)
        found[rows] = low + square.argmin(1)
        at = int(found[rows.stop - 1])
    return found


def crossing(line: FloatArray, end: int, seam: Seam) -> tuple[FloatArray, FloatArray]:
    """Where a border meets a seam near its end, and the part of the border up to it.

    Args:
        line: Points of the border with what goes on beyond both ends, N x 2.
        end: 0 for the seam at its begin, 1 for that at its end.
        seam: The cut, along the border.

    Returns:
        The place on the cut, and the points on this side of it in the border's order.
    """
    ahead = (line - seam.place) @ seam.ahead
    kept = ahead > 1e-6 if end == 0 else ahead < -1e-6
    across = (line - seam.place) @ seam.left
    order = np.flatnonzero(kept)
    if not len(order):
        t = float(across[-end])
        return seam.place + t * seam.left, line[:0]
    # The crossing nearest to the border's own end: a ring comes by the seam again.
    change = np.flatnonzero(kept[1:] != kept[:-1])
    wanted = change[kept[change + 1] == (end == 0)]
    if not len(wanted):
        return seam.place + float(across[-end]) * seam.left, line
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    away = along[-1] - along if end else along
    n = int(wanted[np.argmin(np.abs(away[wanted] - OVERHANG))])
    share = ahead[n] / (ahead[n] - ahead[n + 1])
    place = line[n] + share * (line[n + 1] - line[n])
    return place, line[n + 1 :] if end == 0 else line[: n + 1]


def reference_curve(
    line: FloatArray, seams: tuple[Seam, Seam], ends: tuple[float, float]
) -> ReferenceCurve:
    """A smooth curve near a border from seam to seam.

    Args:
        line: Points of the border with what goes on beyond both ends, N x 2.
        seams: The cuts at its begin and its end, along it.
        ends: Places of its begin and its end on the cuts, metres to the left of their middles.
    """
    first, last = (seam.place + t * seam.left for seam, t in zip(seams, ends, strict=True))
    _, rest = crossing(line, 0, seams[0])
    _, rest = crossing(rest if len(rest) else line, 1, seams[1])
    points = np.concatenate([[first], rest, [last]])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    points = points[np.concatenate([[True], steps > 1e-6])]
    if len(points) < 2:
        points = np.array([first, first + _LEAST * seams[0].ahead])
    smooth = _smoothed(points, seams)
    return ReferenceCurve(tuple(_pieces(smooth, seams)))


def resampled(points: FloatArray, step: float) -> FloatArray:
    """Points at equal distances of at most a step along a line, N x D, by its length in plan."""
    lengths = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(int(np.ceil(along[-1] / step)), 1)
    at = np.linspace(0.0, along[-1], count + 1)
    return np.column_stack([np.interp(at, along, column) for column in points.T])


def densified(points: FloatArray, step: float) -> FloatArray:
    """A line's points with more between them, at most a step apart, N x D."""
    lengths = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(int(np.ceil(along[-1] / step)), 1)
    at = np.union1d(np.linspace(0.0, along[-1], count + 1), along)
    return np.column_stack([np.interp(at, along, column) for column in points.T])


def _smoothed(points: FloatArray, seams: tuple[Seam, Seam]) -> FloatArray:
    """Points 1 m apart of least squared distance and bend (Whittaker), with fixed end headings."""
    even = resampled(points, _STEP)
    if len(even) < 6:
        even = resampled(points, max(float(np.linalg.norm(points[-1] - points[0])) / 6.0, 1e-3))
    count = len(even)
    step = np.linalg.norm(even[1] - even[0])
    goal = even.copy()
    goal[1] = even[0] + step * seams[0].ahead
    goal[-2] = even[-1] - step * seams[1].ahead
    weight = np.ones(count)
    weight[[0, 1, -2, -1]] = 1e6
    bends = diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(count - 2, count))
    system = diags(weight) + _STIFF * (bends.T @ bends) + 1e-12 * eye(count)
    smooth: FloatArray = splu(system.tocsc()).solve(weight[:, None] * goal)
    smooth[0], smooth[-1] = even[0], even[-1]
    return smooth


def _pieces(points: FloatArray, seams: tuple[Seam, Seam]) -> list[Cubic]:
    """Cubics through some of the points, as few as stay near the others."""
    tangents = np.gradient(points, axis=0)
    tangents[0], tangents[-1] = seams[0].ahead, seams[1].ahead
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-9)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    found: list[Cubic] = []
    stack: list[tuple[int, int]] = [(0, len(points) - 1)]
    while stack:
        first, last = stack.pop()
        size = along[last] - along[first]
        cubic = hermite_cubic(
            points[first], points[last], size * tangents[first], size * tangents[last]
        )
        if last - first > 1 and _away(cubic, points[first : last + 1]) > _OFF:
            middle = (first + last) // 2
            stack += [(middle, last), (first, middle)]
        else:
            found.append(cubic)
    return found


def _away(cubic: Cubic, points: FloatArray) -> float:
    """Largest distance of points from the cubic at equal shares of it."""
    p = np.linspace(0.0, 1.0, len(points))
    powers = np.stack([p, p**2, p**3])
    u, v = cubic.along @ powers, cubic.across @ powers
    x, y = np.cos(cubic.heading), np.sin(cubic.heading)
    places = cubic.start + np.column_stack([u * x - v * y, u * y + v * x])
    return float(np.linalg.norm(places - points, axis=1).max())

"""Borders of lanes as functions of s: cubics of t and of height, near the map's linestrings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from envgen_usd.models.array_types import FloatArray
from envgen_usd.streets.lanelets.reference_curves import OVERHANG, ReferenceCurve, densified
from envgen_usd.streets.lanelets.road_seams import Seam
from envgen_usd.streets.road_elements import Width

_STEP = 0.5
"""Distance of the places where borders are looked up, metres."""
_CLOSE = 0.015
"""Largest distance of the cubics from the borders, metres."""
_CLOSE_HEIGHT = 0.015
"""Largest distance of the height's cubics from the map's heights, metres."""
_CLOSE_SLOPE = 0.002
"""Largest error of the cross slope."""
_THIN = 0.05
"""Width of a lane below which its borders are straight between knots, metres."""
_FADE = 6.0, 0.3
"""Length over which a border fades to its place on a seam, metres, and at most as a share."""
_GRADE = 0.005, 3.0
"""Difference of grades from which an elevation bends to that of a seam, and the length, metres."""
_DIGITS = 12
"""Decimals of coefficients; a cubic over 1 km keeps its value to 1 mm."""


@dataclass(frozen=True, eq=False)
class RoadShape:
    """The borders of a road along its reference line.

    Attributes:
        curve: The reference line.
        s: K knots, metres.
        t: K x (N + 1), t of the borders from left to right at the knots.
        slope: K x (N + 1), their derivatives.
        straight: K - 1, True where the borders are straight between two knots.
        error: Largest distance of the cubics from the linestrings, metres.
        elevation: Cubics of the height of the reference line.
        superelevation: Cubics of the cross slope in radians; empty for a level road.
        above: Mean height of each border above the plane of the lanes for vehicles, metres.
    """

    curve: ReferenceCurve
    s: FloatArray
    t: FloatArray
    slope: FloatArray
    straight: FloatArray
    error: float
    elevation: tuple[Width, ...]
    superelevation: tuple[Width, ...]
    above: FloatArray

    def cubics(self, weights: FloatArray, start: float, end: float) -> list[Width]:
        """Cubics of a weighted sum of borders between two s, counted from `start`."""
        value, slope = self.t @ weights, self.slope @ weights
        pieces = _cubics(self.s, value, slope, self.straight)
        return cut(pieces, start, end)

    def at(self, s: FloatArray) -> FloatArray:
        """T of all borders at distances along the road, N x (borders)."""
        columns = []
        for n in range(self.t.shape[1]):
            pieces = np.array(_cubics(self.s, self.t[:, n], self.slope[:, n], self.straight))
            k = np.clip(np.searchsorted(pieces[:, 0], s, "right") - 1, 0, len(pieces) - 1)
            d = s - pieces[k, 0]
            _, a, b, c, e = pieces[k].T
            columns.append(a + d * (b + d * (c + d * e)))
        return np.column_stack(columns)


def road_shape(
    curve: ReferenceCurve,
    borders: Sequence[FloatArray],
    seams: tuple[Seam, Seam],
    ends: tuple[FloatArray, FloatArray],
    paved: tuple[int, int],
) -> RoadShape:
    """Fits the borders of a road.

    Args:
        curve: The reference line.
        borders: Points of each border with what goes on beyond both ends, N x 3.
        seams: The cuts at the ends.
        ends: T of the borders at the begin and at the end.
        paved: Numbers of the outer borders of the lanes for vehicles.
    """
    stations, t, z = _looked_up(curve, borders)
    t = _faded(stations, t, ends)
    knots = _knots(stations, t, np.full(t.shape[1], _CLOSE))
    value = t[knots]
    s = stations[knots]
    slope = _slopes(s, value)
    thin = np.diff(-value, axis=1).min(1) < _THIN
    straight = thin[1:] | thin[:-1]
    shape = RoadShape(curve, s, value, slope, straight, 0.0, (), (), np.zeros(t.shape[1]))
    error = float(np.abs(shape.at(stations) - t).max())
    elevation, tilt, above = _heights(stations, t, z, curve, seams, paved)
    return RoadShape(curve, s, value, slope, straight, error, elevation, tilt, above)


def cut(pieces: Sequence[Width], start: float, end: float) -> list[Width]:
    """Cubics between two s, with s counted from the first."""
    found: list[Width] = []
    for n, (s, a, b, c, d) in enumerate(pieces):
        after = pieces[n + 1][0] if n + 1 < len(pieces) else np.inf
        if after <= start + 1e-6 or s >= end - 1e-6:
            continue
        move = max(start - s, 0.0)
        value, slope = a + move * (b + move * (c + move * d)), b + move * (2 * c + 3 * move * d)
        piece = (s + move - start, value, slope, c + 3 * move * d, d)
        if found and _goes_on(found[-1], piece):
            continue
        found.append(piece)
    return found


def _goes_on(before: Width, piece: Width) -> bool:
    """True where a piece is what the one before it is there, too."""
    h = piece[0] - before[0]
    _, a, b, c, d = before
    moved = (a + h * (b + h * (c + h * d)), b + h * (2 * c + 3 * h * d), c + 3 * h * d, d)
    return bool(np.allclose(moved, piece[1:], rtol=0.0, atol=1e-7))


def _looked_up(
    curve: ReferenceCurve, borders: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Stations, and t and height of each border there."""
    located, corners = [], []
    for line in borders:
        dense = densified(line, _STEP)
        s, t = curve.located(dense[:, :2], -OVERHANG)
        s = np.maximum.accumulate(s)
        s += np.arange(len(s)) * 1e-9
        located.append((s, t, dense[:, 2]))
        corners.append(curve.located(line[:, :2], -OVERHANG)[0])
    length = curve.length
    count = max(int(np.ceil(length / _STEP)), 2)
    inner = np.concatenate(corners)
    inner = inner[(inner > 0.05) & (inner < length - 0.05)]
    stations = np.union1d(np.linspace(0.0, length, count + 1), np.round(inner, 3))
    stations = stations[np.concatenate([[True], np.diff(stations) > 0.02])]
    stations[-1] = length
    t = np.column_stack([np.interp(stations, s, t) for s, t, _ in located])
    z = np.column_stack([np.interp(stations, s, z) for s, _, z in located])
    return stations, np.minimum.accumulate(t, axis=1), z


def _faded(s: FloatArray, t: FloatArray, ends: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Borders that end at given t; they leave their linestrings near the ends alone.

    Where lanes part before a slanted end has come to the cut, linestrings cross it at several t.
    """
    length = float(s[-1])
    reach = min(_FADE[0], _FADE[1] * length)
    for wanted, own, away in ((ends[0], t[0], s), (ends[1], t[-1], length - s)):
        share = np.clip(1.0 - away / reach, 0.0, 1.0)
        t = t + (share**2 * (3.0 - 2.0 * share))[:, None] * (wanted - own)
    return np.minimum.accumulate(t, axis=1)


def _knots(s: FloatArray, values: FloatArray, close: FloatArray) -> FloatArray:
    """Indices of stations through which cubics stay near all values.

    The worst station of each piece becomes a knot until all errors are small.
    """
    knots = np.array([0, len(s) - 1])
    while len(knots) < len(s):
        fit = (
            PchipInterpolator(s[knots], values[knots])(s)
            if len(knots) > 2
            else values[0] + (s / s[-1])[:, None] * (values[-1] - values[0])
        )
        error = (np.abs(fit - values) / close).max(1)
        piece = np.searchsorted(knots, np.arange(len(s)), "right") - 1
        order = np.lexsort((error, piece))
        last = np.concatenate([piece[order][1:] != piece[order][:-1], [True]])
        worst = order[last]
        new = np.setdiff1d(worst[error[worst] > 1.0], knots)
        if not len(new):
            break
        knots = np.union1d(knots, new)
    return knots


def _cubics(
    s: FloatArray, value: FloatArray, slope: FloatArray, straight: FloatArray | None = None
) -> list[Width]:
    """Hermite cubics between knots; lines where they are straight."""
    h, rise = np.diff(s), np.diff(value)
    chord = rise / h
    first, last = slope[:-1], slope[1:]
    if straight is not None:
        first, last = np.where(straight, chord, first), np.where(straight, chord, last)
    square = (3.0 * chord - 2.0 * first - last) / h
    cube = (first + last - 2.0 * chord) / h**2
    columns = np.round(np.column_stack([s[:-1], value[:-1], first, square, cube]), _DIGITS)
    return [(float(a), float(b), float(c), float(d), float(e)) for a, b, c, d, e in columns]


def _heights(  # noqa: PLR0913, PLR0917 - what heights follow from
    s: FloatArray,
    t: FloatArray,
    z: FloatArray,
    curve: ReferenceCurve,
    seams: tuple[Seam, Seam],
    paved: tuple[int, int],
) -> tuple[tuple[Width, ...], tuple[Width, ...], FloatArray]:
    """Cubics of height and cross slope, and the mean height of each border above their plane."""
    near, high = t[:, paved[0] : paved[1] + 1], z[:, paved[0] : paved[1] + 1]
    middle, mean = near.mean(1, keepdims=True), high.mean(1, keepdims=True)
    spread = ((near - middle) ** 2).sum(1)
    slope = ((near - middle) * (high - mean)).sum(1) / np.maximum(spread, 0.25)
    slope = np.clip(slope, -0.15, 0.15)
    for n, seam in ((0, seams[0]), (-1, seams[1])):
        slope[n] = seam.slope
    level = bool(np.abs(slope).max() < 0.006 and not seams[0].slope and not seams[1].slope)
    if level:
        slope = np.zeros_like(slope)
    height = mean[:, 0] - slope * middle[:, 0]
    places = curve.at(np.array([0.0, curve.length]))[0]
    for n, seam in ((0, seams[0]), (-1, seams[1])):
        height[n] = seam.height + seam.slope * float((places[n] - seam.place) @ seam.left)
    above = np.median(z - height[:, None] - slope[:, None] * t, axis=0)
    elevation = _fitted(s, height, _CLOSE_HEIGHT, (seams[0].grade, seams[1].grade))
    return elevation, () if level else _fitted(s, np.arctan(slope), _CLOSE_SLOPE), above


def _fitted(
    s: FloatArray, value: FloatArray, close: float, ends: tuple[float, float] | None = None
) -> tuple[Width, ...]:
    """Cubics near values at s, with given slopes at both ends or free ones."""
    knots = _knots(s, value[:, None], np.array([close]))
    slope = _slopes(s[knots], value[knots])
    if ends is not None and np.abs(slope[[0, -1]] - ends).max() > _GRADE[0]:
        near = np.array([_GRADE[1], s[-1] - _GRADE[1]])
        inner = np.searchsorted(s, near[(near > 1.0) & (near < s[-1] - 1.0)])
        knots = np.union1d(knots, inner)
        slope = _slopes(s[knots], value[knots])
    if ends is not None:
        slope[[0, -1]] = ends
    return tuple(cut(_cubics(s[knots], value[knots], slope), 0.0, float(s[-1])))


def _slopes(s: FloatArray, value: FloatArray) -> FloatArray:
    """Derivatives at knots."""
    if len(s) == 2:
        return np.repeat(np.diff(value, axis=0) / (s[1] - s[0]), 2, axis=0)
    slope: FloatArray = PchipInterpolator(s, value).derivative()(s)
    return slope

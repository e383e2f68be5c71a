"""What the panes of a car show: seats, steering wheel and dashboard before the windows opposite.

Colours are those behind glass that lets 0.75 of the light through, twice: a cabin of 0.05 to 0.1
seems half as bright, and through two panes the street opposite still shows.
"""

from typing import Literal

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Texture
from envgen_usd.assets.textures.texture_noise import grid, spectral
from envgen_usd.models.array_types import BoolArray, FloatArray

Cell = Literal["windscreen", "back_window", "front_window", "rear_window"]
CELLS: dict[Cell, tuple[float, float]] = {
    "windscreen": (0.0, 0.0),
    "back_window": (0.5, 0.0),
    "front_window": (0.0, 0.5),
    "rear_window": (0.5, 0.5),
}
"""Lower left corner of each cell, whose sides are half of the texture's."""
SIZE = 256
"""Pixels of a cell's side: at 5 m, a windscreen covers about as many in the cameras of rigs."""
_CABIN = 0.020
_SEAT = 0.012
_TRIM = 0.030
_OPPOSITE = 0.085
"""Reflectances: the dim cabin, seats, dashboard and shelf, and the street beyond the far panes."""


def car_cabin(rng: np.random.Generator) -> Texture:
    """Four pictures of a cabin, lighter below the roof's edge and smooth as seen through glass."""
    u, v = grid(SIZE)
    cells = {
        "windscreen": _windscreen(u, v),
        "back_window": _back_window(u, v),
        "front_window": _front_window(u, v),
        "rear_window": _rear_window(u, v),
    }
    lower = np.concatenate([cells["windscreen"], cells["back_window"]], axis=1)
    upper = np.concatenate([cells["front_window"], cells["rear_window"]], axis=1)
    light = np.concatenate([lower, upper], axis=0)
    light = light * (1.0 + 0.06 * spectral(rng, 2 * SIZE, 2.0, 16.0))
    # Glass of cars is a little green.
    return Texture(1.0, light[..., None] * np.array([0.94, 1.0, 0.98]))


def _windscreen(u: FloatArray, v: FloatArray) -> FloatArray:
    """From ahead: a steering wheel on the car's left, two seats, the back window between them."""
    light = np.full(u.shape, _CABIN)
    light[_rounded(u, v, (0.30, 0.70), (0.42, 0.78))] = _OPPOSITE
    for middle in (0.27, 0.73):
        light[_rounded(u, v, (middle - 0.12, middle + 0.12), (-0.2, 0.60))] = _SEAT
        light[_rounded(u, v, (middle - 0.065, middle + 0.065), (0.64, 0.84))] = _SEAT
    away = np.hypot((u - 0.73) / 0.13, (v - 0.20) / 0.22)
    light[np.abs(away - 1.0) < 0.10] = 0.4 * _SEAT
    light[_rounded(u, v, (0.44, 0.56), (0.86, 0.95))] = 0.4 * _SEAT
    light[v < 0.14 + 0.04 * np.cos(2 * np.pi * (u - 0.73))] = _TRIM
    return _framed(light, u, v)


def _back_window(u: FloatArray, v: FloatArray) -> FloatArray:
    """From behind: a shelf, head rests of three places, the windscreen beyond them."""
    light = np.full(u.shape, _CABIN)
    light[_rounded(u, v, (0.16, 0.84), (0.40, 0.86))] = _OPPOSITE
    for middle in (0.30, 0.70):
        light[_rounded(u, v, (middle - 0.075, middle + 0.075), (0.38, 0.72))] = _SEAT
    for middle in (0.20, 0.5, 0.80):
        light[_rounded(u, v, (middle - 0.075, middle + 0.075), (0.12, 0.40))] = _SEAT
    light[v < 0.13] = _TRIM
    return _framed(light, u, v)


def _front_window(u: FloatArray, v: FloatArray) -> FloatArray:
    """From the side, the front at the right: seat, head rest, wheel, the window opposite."""
    light = np.full(u.shape, _OPPOSITE)
    light[(v < 0.16) | (v > 0.90)] = _CABIN
    light[u < 0.06] = _CABIN
    lean = u + 0.10 * v
    light[_rounded(lean, v, (0.10, 0.34), (-0.2, 0.58))] = _SEAT
    light[_rounded(lean, v, (0.17, 0.31), (0.62, 0.90))] = _SEAT
    away = np.hypot((u + 0.22 * v - 0.72) / 0.045, (v - 0.28) / 0.22)
    light[np.abs(away - 1.0) < 0.28] = 0.4 * _SEAT
    light[v < 0.22 * (u - 0.52) / 0.48 + 0.02] = _TRIM
    return light


def _rear_window(u: FloatArray, v: FloatArray) -> FloatArray:
    """From the side, the front at the right: the rear bench, the back of the front seat."""
    light = np.full(u.shape, _OPPOSITE)
    light[(v < 0.18) | (v > 0.90)] = _CABIN
    light[(u < 0.08) | (u > 0.95)] = _CABIN
    lean = u + 0.14 * v
    light[_rounded(lean, v, (0.02, 0.34), (-0.2, 0.50))] = _SEAT
    light[_rounded(lean, v, (0.16, 0.30), (0.54, 0.78))] = _SEAT
    light[_rounded(lean, v, (0.92, 1.20), (-0.2, 0.60))] = _SEAT
    return light


def _framed(light: FloatArray, u: FloatArray, v: FloatArray) -> FloatArray:
    """The picture with the printed border of glued panes."""
    border = np.minimum(np.minimum(u, 1.0 - u), np.minimum(v, 1.0 - v)) < 0.03
    return np.where(border, 0.5 * _SEAT, light)


def _rounded(
    u: FloatArray, v: FloatArray, across: tuple[float, float], up: tuple[float, float]
) -> BoolArray:
    """Pixels within a shape between a rectangle and an ellipse."""
    x = (2.0 * u - across[0] - across[1]) / (across[1] - across[0])
    y = (2.0 * v - up[0] - up[1]) / (up[1] - up[0])
    inside: BoolArray = x**4 + y**4 < 1.0
    return inside

"""Data of a procedural texture."""

from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np

from envgen_usd.models.array_types import ByteArray, FloatArray

Colour: TypeAlias = tuple[float, float, float]
"""Linear reflectance of red, green and blue."""
_STEPS = 65536
"""Steps of the table of sRGB values; a power of two, so that a value's step is exact."""


@dataclass(frozen=True)
class Texture:
    """A square texture that tiles in both directions; row 0 is its lower edge.

    Attributes:
        size: Side length, metres.
        albedo: S x S x 3, linear reflectance, 0 to 1.
        height: S x S, metres towards the viewer, or `None` for a flat surface.
        roughness: S x S, 0 to 1, or `None` for the uniform roughness of the material.
        opacity: S x S, 0 to 1, or `None` for opaque textures.
        glow: S x S x 3, emitted light in any unit, or `None` for even light or none.
    """

    size: float
    albedo: FloatArray
    height: FloatArray | None = None
    roughness: FloatArray | None = None
    opacity: FloatArray | None = None
    glow: FloatArray | None = None


def to_srgb(linear: FloatArray) -> ByteArray:
    """Linear reflectance to 8-bit sRGB (IEC 61966-2-1).

    A table has the pixels of nearly all values; powers are taken of the others alone.
    """
    value = np.clip(linear, 0.0, 1.0)
    least, most = _srgb_table()
    place = (value * _STEPS).astype(np.int32)
    pixels = least[place]
    unsure = (least != most)[place]
    pixels[unsure] = np.round(_curve(value[unsure])).astype(np.uint8)
    return pixels


@cache
def _srgb_table() -> tuple[ByteArray, ByteArray]:
    """Pixels at the lower and at the upper end of each step of the linear values."""
    ends = np.arange(_STEPS + 2) / _STEPS
    curve = _curve(ends)
    # Powers may be off by some last digits.
    low, high = np.round(curve[:-1] - 1e-6), np.round(curve[1:] + 1e-6)
    return low.clip(0, 255).astype(np.uint8), high.clip(0, 255).astype(np.uint8)


def _curve(value: FloatArray) -> FloatArray:
    """Encoded values, 0 to 255, before they are rounded."""
    curve: FloatArray = 1.055 * value ** (1 / 2.4) - 0.055
    dark = value <= 0.0031308
    curve[dark] = 12.92 * value[dark]
    curve *= 255
    return curve


def to_normals(height: FloatArray, size: float) -> ByteArray:
    """Tangent-space normals (x right, y up) of a height field that tiles, as 8-bit RGB."""
    step = 2 * size / len(height)
    dx = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) / step
    dy = (np.roll(height, -1, axis=0) - np.roll(height, 1, axis=0)) / step
    normals = np.stack([-dx, -dy, np.ones_like(height)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.round((normals * 0.5 + 0.5) * 255).astype(np.uint8)

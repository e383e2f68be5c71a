"""Data of a procedural texture."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from envgen_usd.models.array_types import ByteArray, FloatArray

Colour: TypeAlias = tuple[float, float, float]
"""Linear reflectance of red, green and blue."""


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
    """Linear reflectance to 8-bit sRGB (IEC 61966-2-1)."""
    value = np.clip(linear, 0.0, 1.0)
    curve = 1.055 * value ** (1 / 2.4) - 0.055
    dark = value <= 0.0031308
    curve[dark] = 12.92 * value[dark]
    curve *= 255
    return np.round(curve, out=curve).astype(np.uint8)


def to_normals(height: FloatArray, size: float) -> ByteArray:
    """Tangent-space normals (x right, y up) of a height field that tiles, as 8-bit RGB."""
    step = 2 * size / len(height)
    dx = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) / step
    dy = (np.roll(height, -1, axis=0) - np.roll(height, 1, axis=0)) / step
    normals = np.stack([-dx, -dy, np.ones_like(height)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.round((normals * 0.5 + 0.5) * 255).astype(np.uint8)

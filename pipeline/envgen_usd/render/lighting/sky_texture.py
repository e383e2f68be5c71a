"""The light of an atmosphere on the GPU: sky map, spherical harmonics, sun."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.light.daylight import LUMINANCE
from envgen_usd.light.sky_directions import (
    ground_illuminance,
    sky_directions,
    solid_angles,
)
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.atmosphere import GROUND, STAGE_UNIT, Atmosphere
from envgen_usd.render.opengl import gpu

LIT_STREET = 0.02
"""Illuminance of a street that lamps light, klx."""
_COARSE = 32
"""Rows of the map that the harmonics are computed from."""
_BAND_WEIGHTS = np.array([1.0, *[2.0 / 3.0] * 3, *[1.0 / 4.0] * 5])
"""Irradiance over pi of each harmonic: R. Ramamoorthi and P. Hanrahan (SIGGRAPH 2001)."""


class SkyTexture:
    """The sky of the current frame."""

    def __init__(self, unit: int) -> None:
        """Reserves a texture unit; nothing is uploaded yet."""
        self._unit = unit
        self._handle = 0
        self._atmosphere: Atmosphere | None = None
        self._uniforms: dict[str, float | FloatArray] = {}
        self.white = 0.0

    def show(self, atmosphere: Atmosphere) -> None:
        """Uploads the sky, unless it is the current sky already."""
        if atmosphere is self._atmosphere:
            return
        if self._handle:
            gl.glDeleteTextures([self._handle])
        self._atmosphere = atmosphere
        self.white = white_level(atmosphere)
        atmosphere = exposed(atmosphere)
        self._handle = _upload(atmosphere.sky)
        height = max(float(atmosphere.sun_direction[2]), 0.0)
        around = GROUND * (ground_illuminance(atmosphere.sky) + atmosphere.sun * height) / np.pi
        self._uniforms = {
            "sun_direction": atmosphere.sun_direction,
            "sun_light": atmosphere.sun / np.pi,
            "sky_harmonics": harmonics(atmosphere.sky),
            "bounced_light": around,
            "haze": atmosphere.extinction,
            "wetness": atmosphere.wetness,
            "lamp_unit": atmosphere.lamp_unit,
        }

    @property
    def lamp_unit(self) -> float:
        """Illuminance by a lamp of intensity 1 on the stage; white open ground has pi."""
        return float(self._uniforms["lamp_unit"])

    @property
    def wetness(self) -> float:
        """Share of the ground that water covers."""
        return float(self._uniforms["wetness"])

    @property
    def has_sun(self) -> bool:
        """True if the sun shines: clouds may hide it."""
        return bool(np.any(self._uniforms["sun_light"]))

    def bind(self) -> Mapping[str, gpu.Value]:
        """Binds the sky's texture, and returns the uniforms of the light."""
        gpu.bind_texture(self._unit, self._handle)
        return {"sky_map": self._unit, **self._uniforms}


def exposed(atmosphere: Atmosphere) -> Atmosphere:
    """Scales the light so that a white surface on open ground has a radiance of 1.

    In the dark, it has the radiance of a street that lamps light.
    """
    scale = np.pi / open_illuminance(atmosphere)
    return replace(
        atmosphere,
        sun=atmosphere.sun * scale,
        sky=(atmosphere.sky * scale).astype(np.float32),
        lamp_unit=atmosphere.lamp_unit * scale,
    )


def white_level(atmosphere: Atmosphere) -> float:
    """Returns the illuminance in klx of a white surface that `exposed` gives a radiance of 1."""
    return open_illuminance(atmosphere) * STAGE_UNIT / atmosphere.lamp_unit


def open_illuminance(atmosphere: Atmosphere) -> float:
    """Returns the illuminance of open ground in the unit of the atmosphere, or of a lit street."""
    height = max(float(atmosphere.sun_direction[2]), 0.0)
    total = ground_illuminance(atmosphere.sky) + atmosphere.sun * height
    lit_street = LIT_STREET / STAGE_UNIT * atmosphere.lamp_unit
    return max(float(total @ LUMINANCE), lit_street, 1e-12)


def harmonics(sky: NDArray[np.floating]) -> FloatArray:
    """Returns factors (9 x 3) of the harmonics whose sum is irradiance over pi by the upper sky.

    Args:
        sky: H x 2 H x 3, a sky map.
    """
    step = max(len(sky) // _COARSE, 1)
    rows = len(sky) // step
    blocks = sky[: rows * step, : 2 * rows * step].reshape(rows, step, -1)
    # Whole rows first: they are added several times faster than pixels of three colours.
    lines = blocks.sum(axis=1, dtype=np.float64).reshape(rows, 2 * rows, step, 3)
    coarse = lines.sum(axis=2) / step**2
    directions = sky_directions(rows)
    weight = np.where(directions[..., 2] > 0.0, solid_angles(rows), 0.0)
    basis = _basis(directions)
    moments = np.einsum("ijb,ij,ijk->bk", basis, weight, coarse)
    factors: FloatArray = moments * _BAND_WEIGHTS[:, None]
    return factors


def _basis(directions: FloatArray) -> FloatArray:
    """Real spherical harmonics up to band 2, in the order of `sky.glsl`: ... x 9."""
    x, y, z = np.moveaxis(directions, -1, 0)
    return np.stack(
        [
            np.full_like(x, 0.282095),
            0.488603 * y,
            0.488603 * z,
            0.488603 * x,
            1.092548 * x * y,
            1.092548 * y * z,
            0.315392 * (3.0 * z * z - 1.0),
            1.092548 * x * z,
            0.546274 * (x * x - y * y),
        ],
        axis=-1,
    )


def _upload(sky: NDArray[np.float32]) -> int:
    handle = int(gl.glGenTextures(1))
    gl.glBindTexture(gl.GL_TEXTURE_2D, handle)
    height, width = sky.shape[:2]
    levels = max(height, width).bit_length()
    gl.glTexStorage2D(gl.GL_TEXTURE_2D, levels, gl.GL_RGB16F, width, height)
    gl.glPixelStorei(gl.GL_UNPACK_ALIGNMENT, 1)
    data = np.ascontiguousarray(sky, np.float32)
    gl.glTexSubImage2D(gl.GL_TEXTURE_2D, 0, 0, 0, width, height, gl.GL_RGB, gl.GL_FLOAT, data)
    gl.glGenerateMipmap(gl.GL_TEXTURE_2D)
    wraps = gl.GL_REPEAT, gl.GL_CLAMP_TO_EDGE
    gpu.set_sampling((gl.GL_LINEAR_MIPMAP_LINEAR, gl.GL_LINEAR), wraps)
    return handle

"""A camera: its intrinsics, its lens, and its projection."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from msgspec import Meta

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.lens_models import PINHOLE, Lens

_TINY = 1e-6
"""Angle in radians over which the focal length in the middle of a lens is taken."""
MOST_PIXELS = 16384
"""Largest width and height of images, pixels; the usual limit of OpenGL implementations."""


@dataclass(frozen=True)
class Camera:
    """A camera as in OpenCV: x right, y down, z forward; pixel centres are integers.

    Attributes:
        width: Image width, pixels.
        height: Image height, pixels.
        fx: Horizontal focal length, pixels.
        fy: Vertical focal length, pixels.
        cx: Column of the principal point.
        cy: Row of the principal point.
        mount: Height above the lane, metres.
        near: Near clipping distance along the optical axis, metres; there is no far plane.
        lens: Lens model; a pinhole by default.
    """

    width: Annotated[int, Meta(ge=1, le=MOST_PIXELS)]
    height: Annotated[int, Meta(ge=1, le=MOST_PIXELS)]
    fx: Annotated[float, Meta(ge=1.0, le=1e6)]
    fy: Annotated[float, Meta(ge=1.0, le=1e6)]
    cx: Annotated[float, Meta(ge=-1e6, le=1e6)]
    cy: Annotated[float, Meta(ge=-1e6, le=1e6)]
    mount: Annotated[float, Meta(ge=-1000.0, le=1000.0)] = 1.55
    near: Annotated[float, Meta(ge=0.001, le=100.0)] = 0.3
    lens: Lens = PINHOLE

    def clip_matrix(self) -> FloatArray:
        """Pinhole projection from camera to clip space, with reversed depth (near 1, infinity 0).

        Image rows grow downwards, and y in clip space grows upwards.
        """
        ahead_x = (2.0 * self.cx + 1.0) / self.width - 1.0
        ahead_y = 1.0 - (2.0 * self.cy + 1.0) / self.height
        return np.array(
            [
                [2.0 * self.fx / self.width, 0.0, ahead_x, 0.0],
                [0.0, -2.0 * self.fy / self.height, ahead_y, 0.0],
                [0.0, 0.0, 0.0, self.near],
                [0.0, 0.0, 1.0, 0.0],
            ]
        )

    @property
    def central_focal(self) -> tuple[float, float]:
        """Focal lengths across and down in the middle of the lens, pixels a radian."""
        middle = self.lens.project(np.array([(_TINY, 0.0, 1.0), (0.0, _TINY, 1.0)]))
        return self.fx * float(middle[0, 0]) / _TINY, self.fy * float(middle[1, 1]) / _TINY

    def lens_uniforms(self) -> dict[str, tuple[float, ...]]:
        """Camera intrinsics as uniforms of the full-screen shaders."""
        return {
            "lens": (self.fx, self.fy, self.cx, self.cy),
            "image_size": (float(self.width), float(self.height)),
        }

"""Where shadow maps look: squares before the camera, seen from the sun or from above."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.arrays import FloatArray

DEPTH = 600.0
"""Metres along the light's direction; what stands nearer to the light is pressed to the front."""


@dataclass(frozen=True)
class Cascade:
    """A square before the camera that one shadow map covers.

    Attributes:
        reach: Half its side, metres.
        ahead: Distance of its middle from the camera, metres.
        step: The square stays where it is while the camera moves within a cell of this size,
            metres. Its content follows from the cell alone, whichever frames came before.
        side: Pixels along each side of the map.
    """

    reach: float
    ahead: float
    step: float
    side: int


CASCADES = (
    Cascade(reach=28.0, ahead=20.0, step=0.0, side=2048),
    Cascade(reach=128.0, ahead=80.0, step=32.0, side=2048),
)
"""The near and the far square of the sun's shadows."""
HEIGHTS = Cascade(reach=128.0, ahead=80.0, step=32.0, side=512)
"""The square of the map of heights, seen from above."""


@dataclass(frozen=True)
class ShadowView:
    """A shadow map's view.

    Attributes:
        middle: 3, of the square, world.
        clip: 4 x 4, from positions relative to the middle to clip space, depth 0 to 1.
        texel: Metres that a pixel covers.
    """

    middle: FloatArray
    clip: FloatArray
    texel: float

    def clip_from(self, eye: FloatArray) -> FloatArray:
        """From positions relative to a camera at `eye` (3) to clip space: 4 x 4."""
        moved = self.clip.copy()
        moved[:3, 3] += self.clip[:3, :3] @ (eye - self.middle)
        return moved


def shadow_view(cascade: Cascade, pose: FloatArray, light_direction: FloatArray) -> ShadowView:
    """View of a cascade for a camera.

    The square moves in steps of whole pixels at least, so that shadows do not crawl from frame to
    frame.

    Args:
        cascade: Which square.
        pose: 4 x 4, camera to world.
        light_direction: 3, towards the light.
    """
    axes = _light_axes(light_direction)
    texel = 2.0 * cascade.reach / cascade.side
    ahead = pose[:3, 2] * (1.0, 1.0, 0.0)
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-9)
    middle = axes @ (pose[:3, 3] + ahead * cascade.ahead)  # 3, along the light's axes
    grid = max(round(cascade.step / texel), 1) * texel
    middle = np.round(middle / grid) * grid
    clip = np.eye(4)
    clip[:3, :3] = axes / np.array([[cascade.reach], [cascade.reach], [DEPTH]])
    clip[2, 3] = 0.5
    return ShadowView(axes.T @ middle, clip, texel)


def _light_axes(light_direction: FloatArray) -> FloatArray:
    """Rows: right, up, and away from the light."""
    away = -light_direction / np.linalg.norm(light_direction)
    helper = np.array([0.0, 1.0, 0.0] if abs(away[1]) < 0.9 else [1.0, 0.0, 0.0])
    right = np.cross(helper, away)
    right = right / np.linalg.norm(right)
    return np.stack((right, np.cross(away, right), away))

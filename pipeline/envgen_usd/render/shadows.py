"""Where the sun's shadow maps look: two squares before the camera, near and far."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.arrays import FloatArray

SIDE = 2048
"""Pixels along each side of a shadow map."""
REACHES = (26.0, 110.0)
"""Half the side of the near and of the far square, metres."""
_AHEAD = 0.75
"""How far the squares' middle lies before the camera, as a share of their reach."""
_DEPTH = 600.0
"""Metres along the sun's direction; what stands nearer to the sun is pressed to the front."""


@dataclass(frozen=True)
class ShadowView:
    """A shadow map's view.

    Attributes:
        clip: 4 x 4, from positions relative to the camera to clip space, depth 0 to 1.
        texel: Metres that a pixel covers.
    """

    clip: FloatArray
    texel: float


def shadow_views(pose: FloatArray, sun_direction: FloatArray) -> tuple[ShadowView, ShadowView]:
    """Views for a camera.

    The squares move in steps of whole pixels, so that shadows do not crawl from frame to frame.

    Args:
        pose: 4 x 4, camera to world.
        sun_direction: 3, towards the sun.
    """
    axes = _light_axes(sun_direction)
    near, far = (_view(pose, axes, reach) for reach in REACHES)
    return near, far


def _light_axes(sun_direction: FloatArray) -> FloatArray:
    """Rows: right, up, and away from the sun."""
    away = -sun_direction / np.linalg.norm(sun_direction)
    helper = np.array([0.0, 1.0, 0.0] if abs(away[1]) < 0.9 else [1.0, 0.0, 0.0])
    right = np.cross(helper, away)
    right = right / np.linalg.norm(right)
    return np.stack((right, np.cross(away, right), away))


def _view(pose: FloatArray, axes: FloatArray, reach: float) -> ShadowView:
    eye, ahead = pose[:3, 3], pose[:3, 2] * (1.0, 1.0, 0.0)
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-9)
    texel = 2.0 * reach / SIDE
    middle = axes @ (eye + ahead * reach * _AHEAD)  # 3, in the light's axes
    middle[:2] = np.round(middle[:2] / texel) * texel
    offset = axes @ eye - middle
    clip = np.eye(4)
    clip[:3, :3] = axes / np.array([[reach], [reach], [_DEPTH]])
    clip[:3, 3] = offset / (reach, reach, _DEPTH)
    clip[2, 3] += 0.5
    return ShadowView(clip, texel)

"""Views of the shadow maps: squares before the camera, seen from the sun or from above."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray

DEPTH = 600.0
"""Depth range of shadow maps, metres; casters beyond the front are clamped to it."""


@dataclass(frozen=True)
class Cascade:
    """A square before the camera that a shadow map covers.

    Attributes:
        reach: Half its side length, metres.
        ahead: Distance of its centre from the camera, metres.
        step: Grid size by which the square follows the camera, metres. The square depends on the
            grid cell alone, whatever the earlier frames.
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
"""The square of the height map, seen from above."""


@dataclass(frozen=True)
class ShadowView:
    """View of a shadow map.

    Attributes:
        middle: 3, centre of the square, world.
        clip: 4 x 4, from positions relative to the centre to clip space, depth 0 to 1.
        texel: Side length of a texel, metres.
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

    The square moves in steps of whole texels at least, so that shadows do not flicker.

    Args:
        cascade: Cascade.
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

"""Rain in the air: streaks of drops that fall through the view while the shutter is open.

The sizes of the drops are those of J. S. Marshall and W. M. Palmer, "The distribution of raindrops
with size" (1948), their speeds those of D. Atlas, R. Srivastava and R. Sekhon (1973). A drop
refracts light of a wide cone, so it shows the mean light around; its streak covers the background
for the share of the exposure that the drop spends before it (K. Garg and S. K. Nayar, "Vision and
rain", 2007).
"""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.camera_rig import Camera
from envgen_usd.render.render_scene import Floats

_SHUTTER = 1.0 / 250.0
"""Time of exposure in seconds; a larger value gives longer and fainter streaks."""
_NEAREST, _FARTHEST = 0.4, 6.0
"""Depths in metres of drawn drops. Farther drops are part of the haze."""
_SMALLEST = 1.0
"""Least diameter in millimetres of a drop that shows."""
_PER_MM = 8000.0
"""Drops per cubic metre and millimetre of diameter, at a diameter of 0 (Marshall and Palmer)."""
_MOST = 60_000
"""Largest number of streaks in a frame."""
_FOCUS = 8.0
"""Depth in metres at which the camera is sharp."""
_APERTURE = 0.003
"""Diameter of the aperture in metres; a larger value blurs near drops more."""
_WIDEST = 8
"""Half of the widest streak, pixels; a larger value shows the nearest drops whole."""
_WIND = 1.5
"""Standard deviation of the wind across and along the view, m/s."""


@dataclass(frozen=True)
class _Streaks:
    """Streaks in the image; columns and rows of both ends in pixels.

    Attributes:
        ends: N x 2 x 2, image positions (x, y) at the start and the end of the exposure.
        width: N, pixels, with the blur.
        cover: N, share of the exposure for which the drop hides a pixel of its streak.
        depth: N, metres.
    """

    ends: FloatArray
    width: FloatArray
    cover: FloatArray
    depth: FloatArray


def add_rain(
    radiance: Floats, depth: Floats, camera: Camera, rate: float, rng: np.random.Generator
) -> Floats:
    """Returns the picture with streaks of rain.

    Args:
        radiance: H x W x 3, linear.
        depth: H x W, metres; 0 in the sky.
        camera: The camera.
        rate: Rain, mm/h; 0 returns the picture as it is.
        rng: Draws the drops.
    """
    if rate <= 0.0:
        return radiance
    streaks = _draw_streaks(camera, rate, rng)
    # A drop shows light from far above and below the view; the mean of the picture stands for it.
    light = radiance.mean(axis=(0, 1))
    cover = _coverage(streaks, np.where(depth > 0.0, depth, np.inf))[..., None]
    rained: Floats = (radiance + cover * (light - radiance)).astype(np.float32)
    return rained


def _draw_streaks(camera: Camera, rate: float, rng: np.random.Generator) -> _Streaks:
    slope = 4.1 * rate**-0.21  # per millimetre
    density = _PER_MM / slope * np.exp(-slope * _SMALLEST)  # visible drops per cubic metre
    # The frustum, a little larger than the image, so that streaks enter from outside.
    wide, high = 1.2 * camera.width / camera.fx, 1.4 * camera.height / camera.fy
    volume = wide * high * (_FARTHEST**3 - _NEAREST**3) / 3.0
    count = min(int(rng.poisson(density * volume)), _MOST)
    depth = np.cbrt(rng.uniform(_NEAREST**3, _FARTHEST**3, count))
    aside = wide * (rng.random(count) - 0.5) + _middle(camera.width, camera.cx, camera.fx)
    below = high * (rng.random(count) - 0.5) + _middle(camera.height, camera.cy, camera.fy)
    size = _SMALLEST + rng.exponential(1.0 / slope, count)
    speed = 9.65 - 10.3 * np.exp(-0.6 * size)
    moved = _SHUTTER * np.stack([np.full(count, rng.normal() * _WIND), speed], axis=1)
    focal = np.array([camera.fx, camera.fy])
    start = np.stack([aside, below], axis=1) * focal + (camera.cx, camera.cy)
    ends = np.stack([start, start + moved / depth[:, None] * focal], axis=1)
    sharp = size / 1000.0 * camera.fx / depth
    blur = _APERTURE * camera.fx * np.abs(1.0 / depth - 1.0 / _FOCUS)
    width = np.maximum(np.hypot(sharp, blur), 1.0)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) + width
    cover = np.minimum(sharp**2 / (width * length), 1.0)
    return _Streaks(ends, width, cover, depth)


def _middle(size: int, centre: float, focal: float) -> float:
    """Tangent of the angle to the middle of the image."""
    return (0.5 * (size - 1) - centre) / focal


def _coverage(streaks: _Streaks, depth: FloatArray) -> Floats:
    """Returns the share of each pixel's light that drops before it replace: H x W."""
    height, width = depth.shape
    open_share = np.zeros((height, width))
    vector = streaks.ends[:, 1] - streaks.ends[:, 0]
    steps = np.ceil(np.linalg.norm(vector, axis=1)).astype(int) + 1
    owner = np.repeat(np.arange(len(steps)), steps)
    along = (np.arange(len(owner)) - np.repeat(np.cumsum(steps) - steps, steps) + 0.5) / steps[
        owner
    ]
    places = streaks.ends[owner, 0] + along[:, None] * vector[owner]
    widest = min(int(streaks.width.max(initial=0.0) / 2.0 + 0.5), _WIDEST)
    for offset in range(-widest, widest + 1):
        share = np.clip(streaks.width[owner] / 2 - abs(offset) + 0.5, 0.0, 1.0)
        column, row = np.floor(places[:, 0] + offset + 0.5), np.floor(places[:, 1] + 0.5)
        seen = (share > 0) & (column >= 0) & (column < width) & (row >= 0) & (row < height)
        column, row = column[seen].astype(int), row[seen].astype(int)
        before = streaks.depth[owner[seen]] < depth[row, column]
        hidden = np.minimum(streaks.cover[owner[seen]] * share[seen], 0.95)[before]
        np.add.at(open_share, (row[before], column[before]), np.log1p(-hidden))
    covered: Floats = (1.0 - np.exp(open_share)).astype(np.float32)
    return covered

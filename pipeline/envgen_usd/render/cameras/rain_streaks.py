"""Rain in the air: streaks of drops that fall through the view while the shutter is open.

The sizes of the drops are those of J. S. Marshall and W. M. Palmer, "The distribution of raindrops
with size" (1948), their speeds those of D. Atlas, R. Srivastava and R. Sekhon (1973). A drop
refracts light of a wide cone, so it shows the mean light around; its streak covers the background
for the share of the exposure that the drop spends before it (K. Garg and S. K. Nayar, "Vision and
rain", 2007).
"""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.cameras.camera_rig import Camera
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
        depth: N, metres, as the lens measures them.
    """

    ends: FloatArray
    width: FloatArray
    cover: FloatArray
    depth: FloatArray


def add_rain(  # noqa: PLR0913, PLR0917 - what the rain in a picture follows from
    radiance: Floats,
    depth: Floats,
    camera: Camera,
    rate: float,
    rng: np.random.Generator,
    inside: BoolArray | None = None,
) -> Floats:
    """Returns the picture with streaks of rain.

    Args:
        radiance: H x W x 3, linear.
        depth: H x W, metres as the lens of the camera measures them; 0 in the sky.
        camera: The camera.
        rate: Rain, mm/h; 0 returns the picture as it is.
        rng: Draws the drops.
        inside: H x W, True within the image circle of the lens; `None` for the whole image.
    """
    if rate <= 0.0:
        return radiance
    streaks = _draw_streaks(camera, rate, rng)
    # A drop shows light from far above and below the view; the mean of the picture stands for it.
    shown = np.ones(depth.shape, bool) if inside is None else inside
    light = radiance[shown].mean(axis=0)
    cover = _coverage(streaks, np.where((depth <= 0.0) & shown, np.inf, depth))[..., None]
    rained: Floats = (radiance + cover * (light - radiance)).astype(np.float32)
    return rained


def _draw_streaks(camera: Camera, rate: float, rng: np.random.Generator) -> _Streaks:
    slope = 4.1 * rate**-0.21  # per millimetre
    density = _PER_MM / slope * np.exp(-slope * _SMALLEST)  # visible drops per cubic metre
    drops = _drops(camera, density, rng)
    count = len(drops)
    size = _SMALLEST + rng.exponential(1.0 / slope, count)
    speed = 9.65 - 10.3 * np.exp(-0.6 * size)
    wind = np.full(count, rng.normal() * _WIND)
    fallen = drops + _SHUTTER * np.stack([wind, speed, np.zeros(count)], axis=1)
    ends = np.stack([_pixels(camera, drops), _pixels(camera, fallen)], axis=1)
    shown = np.isfinite(ends).all(axis=(1, 2))
    ends, drops, size = ends[shown], drops[shown], size[shown]
    depth = np.linalg.norm(drops, axis=1) if camera.lens.has_ranges else drops[:, 2]
    focal = camera.central_focal[0]
    sharp = size / 1000.0 * focal / depth
    blur = _APERTURE * focal * np.abs(1.0 / depth - 1.0 / _FOCUS)
    width = np.maximum(np.hypot(sharp, blur), 1.0)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) + width
    cover = np.minimum(sharp**2 / (width * length), 1.0)
    return _Streaks(ends, width, cover, depth)


def _drops(camera: Camera, density: float, rng: np.random.Generator) -> FloatArray:
    """Positions (N x 3) of drops in camera space, a little beyond the field of the camera."""
    cubes = (_FARTHEST**3 - _NEAREST**3) / 3.0
    tangents = _border_tangents(camera)
    if tangents is None:
        # A fisheye sees half of the space before and beside it.
        count = min(int(rng.poisson(density * 2.0 * np.pi * cubes)), _MOST)
        along = rng.random(count)
        turn, away = rng.uniform(0.0, 2.0 * np.pi, count), _distances(count, rng)
        aside = np.sqrt(1.0 - along**2)
        ways = np.stack([aside * np.cos(turn), aside * np.sin(turn), along], axis=1)
        spread: FloatArray = away[:, None] * ways
        return spread
    low, high = tangents
    size = np.array((1.2, 1.4)) * (high - low)
    count = min(int(rng.poisson(density * size.prod() * cubes)), _MOST)
    depth = _distances(count, rng)
    plane = (rng.random((2, count)).T - 0.5) * size + (low + high) / 2.0
    drops: FloatArray = depth[:, None] * np.column_stack([plane, np.ones(count)])
    return drops


def _distances(count: int, rng: np.random.Generator) -> FloatArray:
    return np.cbrt(rng.uniform(_NEAREST**3, _FARTHEST**3, count))


def _border_tangents(camera: Camera) -> tuple[FloatArray, FloatArray] | None:
    """Least and largest x / z and y / z at the image's border; `None` for a fisheye."""
    if camera.lens.has_ranges:
        return None
    x, y = np.linspace(0, camera.width - 1, 33), np.linspace(0, camera.height - 1, 33)
    across = [(u, v) for u in x for v in y[[0, -1]]]
    border = np.array(across + [(u, v) for u in x[[0, -1]] for v in y])
    places = (border - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    ways = camera.lens.directions(places)
    ways = ways[np.isfinite(ways).all(axis=1)]
    tangents = ways[:, :2] / ways[:, 2:]
    if not len(tangents):
        return None
    return tangents.min(axis=0), tangents.max(axis=0)


def _pixels(camera: Camera, points: FloatArray) -> FloatArray:
    """Pixels (N x 2) of points in camera space; NaN outside of the lens."""
    return camera.lens.project(points) * (camera.fx, camera.fy) + (camera.cx, camera.cy)


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

"""Tileable random fields: spectral noise, cells, strokes.

Fields are S x S with row 0 at the lower edge; coordinates cover [0, 1) in both directions and wrap
around.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.models.array_types import FloatArray, IntArray

_KEPT = 4
"""Diagrams that a process keeps; each takes 42 MB at 1024 pixels."""


def grid(size: int) -> tuple[FloatArray, FloatArray]:
    """Pixel centres, u and v, each S x S, in [0, 1)."""
    axis = (np.arange(size) + 0.5) / size
    u, v = np.meshgrid(axis, axis)
    return u, v


def spectral(  # noqa: PLR0913, PLR0917 - what a spectrum consists of
    rng: np.random.Generator,
    size: int,
    low: float,
    high: float,
    slope: float = 1.0,
    stretch: tuple[float, float] = (1.0, 1.0),
) -> FloatArray:
    """Band-limited noise of zero mean and unit deviation (spectral synthesis).

    Args:
        rng: Source of the white noise.
        size: Side length, pixels.
        low: Lowest frequency, cycles per tile. Above about 3, repetition is inconspicuous.
        high: Highest frequency, cycles per tile.
        slope: Exponent of the amplitude's decay with frequency; a larger value gives smoother
            noise.
        stretch: Factors of feature length along u and v.
    """
    white = np.fft.rfft2(rng.standard_normal((size, size)))
    white *= _amplitude(size, low, high, slope, stretch)
    field = np.fft.irfft2(white, (size, size))
    field -= field.mean()
    return np.asarray(field / field.std())


@lru_cache(maxsize=16)
def _amplitude(
    size: int, low: float, high: float, slope: float, stretch: tuple[float, float]
) -> FloatArray:
    """Amplitude of each frequency: S x (S // 2 + 1), see `spectral`."""
    fv = np.fft.fftfreq(size, 1 / size)[:, None] * stretch[1]
    fu = np.fft.rfftfreq(size, 1 / size)[None, :] * stretch[0]
    frequency = np.hypot(fu, fv)
    band = 1 / (1 + (frequency / high) ** 8) / (1 + (low / np.maximum(frequency, 1e-9)) ** 8)
    amplitude: FloatArray = band * np.maximum(frequency, 1e-9) ** -slope
    return amplitude


@dataclass(frozen=True)
class Cells:
    """A tileable Voronoi diagram.

    Attributes:
        index: S x S, cell of each pixel.
        border: S x S, distance from the cell's border, as a share of the tile's side.
        centre: S x S, distance from the cell's seed, as a share of the tile's side.
    """

    index: IntArray
    border: FloatArray
    centre: FloatArray


def cells(
    seeds: FloatArray, size: int, aspect: float = 1.0, wobble: FloatArray | None = None
) -> Cells:
    """Divides a tile into the Voronoi cells of seeds.

    Args:
        seeds: N x 2, in [0, 1).
        size: Side length, pixels.
        aspect: Approximate ratio of cell lengths along u and v.
        wobble: S x S x 2, displacement of the pixels before they are assigned.
    """
    moves = b"" if wobble is None else wobble.astype(np.float64).tobytes()
    return _cells(seeds.astype(np.float64).tobytes(), size, aspect, moves)


@lru_cache(maxsize=_KEPT)
def _cells(seeds_given: bytes, size: int, aspect: float, wobble: bytes) -> Cells:
    """As `cells`, of the bytes of arrays; materials with one relief have the same cells."""
    seeds = np.frombuffer(seeds_given).reshape(-1, 2)
    scale = np.array([1.0 / aspect, 1.0])
    pixels = np.stack(grid(size), axis=-1).reshape(-1, 2)
    if wobble:
        pixels = pixels + np.frombuffer(wobble).reshape(-1, 2)
    tree = cKDTree((seeds % 1.0) * scale, boxsize=scale)
    neighbours = tree.query((pixels % 1.0) * scale, k=2)
    distance, nearest = np.asarray(neighbours[0]), np.asarray(neighbours[1])
    first, other = (seeds[nearest[:, k]] for k in (0, 1))
    apart = (other - first + 0.5) % 1.0 - 0.5
    gap = np.linalg.norm(apart * scale, axis=1)
    border = (distance[:, 1] ** 2 - distance[:, 0] ** 2) / (2 * np.maximum(gap, 1e-9))
    shape = (size, size)
    fields = (nearest[:, 0].reshape(shape), border.reshape(shape), distance[:, 0].reshape(shape))
    for field in fields:
        field.setflags(write=False)
    return Cells(*fields)


def even_seeds(rng: np.random.Generator, count: int, aspect: float = 1.0) -> FloatArray:
    """Nearly evenly spread points in [0, 1)²: N x 2 (three rounds of Lloyd's relaxation)."""
    seeds = rng.random((count, 2))
    pixels = np.stack(grid(192), axis=-1).reshape(-1, 2)
    for _ in range(3):
        index = cells(seeds, 192, aspect).index.reshape(-1)
        offset = (pixels - seeds[index] + 0.5) % 1.0 - 0.5
        weight = np.maximum(np.bincount(index, minlength=count), 1)
        mean = [np.bincount(index, offset[:, k], minlength=count) / weight for k in (0, 1)]
        seeds = (seeds + np.stack(mean, axis=1)) % 1.0
    return seeds


@dataclass(frozen=True)
class Strokes:
    """N overlapping bent strokes, e.g. blades of grass.

    Attributes:
        start: N x 2, in [0, 1).
        angle: N, radians at the start.
        bend: N, change of angle from start to end, radians.
        length: N, share of the tile's side.
        width: N, pixels.
    """

    start: FloatArray
    angle: FloatArray
    bend: FloatArray
    length: FloatArray
    width: FloatArray


def draw_strokes(strokes: Strokes, size: int, samples: int) -> tuple[IntArray, FloatArray]:
    """Draws strokes in their order; later strokes cover earlier strokes.

    Returns:
        Index of the visible stroke at each pixel (S x S, or -1), and the position along it (0 to
        1).
    """
    along = np.linspace(0.0, 1.0, samples)
    angle = strokes.angle[:, None] + strokes.bend[:, None] * along
    step = strokes.length[:, None] / samples
    x = strokes.start[:, :1] + np.cumsum(np.cos(angle) * step, axis=1)
    y = strokes.start[:, 1:] + np.cumsum(np.sin(angle) * step, axis=1)
    owner = np.full(size * size, -1, dtype=np.int64)
    place = np.zeros(size * size)
    half = strokes.width[:, None] * (1 - 0.75 * along) / 2 / size
    lanes = max(1, int(np.ceil(strokes.width.max())))
    for offset in np.linspace(-1.0, 1.0, lanes) if lanes > 1 else (0.0,):
        px = np.floor((x - np.sin(angle) * half * offset) * size).astype(np.int64) % size
        py = np.floor((y + np.cos(angle) * half * offset) * size).astype(np.int64) % size
        flat = (py * size + px).reshape(-1)
        ids = np.repeat(np.arange(len(x)), samples)
        keep = ids >= owner[flat]
        np.maximum.at(owner, flat, ids)
        won = keep & (owner[flat] == ids)
        place[flat[won]] = np.tile(along, len(x))[won]
    return owner.reshape(size, size), place.reshape(size, size)


def smoothstep(edge0: float, edge1: float, value: FloatArray) -> FloatArray:
    """0 below the first edge, 1 above the second, with a smooth transition."""
    t = np.clip((value - edge0) / (edge1 - edge0), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def tint(base: tuple[float, float, float], factor: FloatArray) -> FloatArray:
    """A colour times a field: S x S x 3."""
    return np.asarray(base) * factor[..., None]


def mix(a: FloatArray, b: FloatArray, weight: FloatArray) -> FloatArray:
    """`a` at weight 0 and `b` at weight 1; colours S x S x 3, weight S x S."""
    return a + (b - a) * weight[..., None]


def pick(
    rng: np.random.Generator, palette: Sequence[tuple[float, float, float]], count: int
) -> FloatArray:
    """Colours of a palette, each equally likely: N x 3; a longer palette draws no more figures."""
    chosen = (rng.random(count) * len(palette)).astype(np.int64)
    return np.asarray(palette)[chosen]


def weather(rng: np.random.Generator, size: int, strength: float) -> FloatArray:
    """Factors about 1 of dirt on a wall: blotches, and streaks that run down; S x S."""
    blotches = spectral(rng, size, 2, 24, 1.1)
    streaks = spectral(rng, size, 3, 90, 0.9, (0.2, 2.5))
    return np.asarray(np.exp(strength * (0.7 * blotches + 0.5 * streaks)))

"""Height of the ground as a function of the place alone, fitted once to the road."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.geometry.noise import smooth_noise
from envgen_usd.geometry.outline import Outline
from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.profile import TerrainRules
from envgen_usd.models.surface import RoadSurface
from envgen_usd.seeds import generator
from envgen_usd.terrain.membrane import fill_membrane
from envgen_usd.terrain.slopes import limit_slopes

Heights = Callable[[FloatArray], FloatArray]
"""Heights (N, metres) at places (N x 2)."""

STEPS = (1, 3, 5, 15, 51, 255)
"""Cells between the nodes of the lattice; each divides a chunk."""
MAX_NODES = 2_000_000
MARGIN = 40.0
"""Metres of lattice beyond the road; further out its border's correction holds."""
HILLS_MARGIN = 300.0
"""The same where there are hills, whose slopes are to be limited on all chunks beside the road."""
TREND_SPREAD = 25.0
"""Standard deviation in metres that the road must have along an axis to tell a slope along it:
the cross-fall of a single road says nothing about the land."""
EXACT = 1.5e-3
"""Metres; smaller differences come from the grid of coordinates."""
BANK_SHARE = 0.7
"""Share of the steepest slope that the lattice may use; the rest is for the correction that makes
the ground meet the road exactly."""
FADING = 15.0
"""Metres from the road beyond which a real terrain is left alone, more where banks need it."""
MISMATCH_REACH = 4.0
"""Steps of the lattice over which its mismatch at the road fades."""
RELIEF_PEAK = 1.25
"""Standard deviations of the noise that make three quarters of the relief's amplitude."""


@dataclass(frozen=True)
class Lattice:
    """Corrections on a regular lattice that is anchored at the road frame's origin.

    Attributes:
        first: (column, row) of the first node, in units of `spacing`.
        spacing: Metres.
        values: H x W, metres.
    """

    first: IntArray
    spacing: float
    values: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """Bilinear interpolation; beyond the lattice the value of its border."""
        last = np.array(self.values.shape)[::-1] - 1
        place = np.clip(points[:, :2] / self.spacing - self.first, 0.0, last)
        column, row = np.minimum(place.astype(np.int64), last - 1).T
        u, v = (place - np.stack([column, row], axis=1)).T
        south = self.values[row, column] * (1 - u) + self.values[row, column + 1] * u
        north = self.values[row + 1, column] * (1 - u) + self.values[row + 1, column + 1] * u
        result: FloatArray = south * (1 - v) + north * v
        return result


@dataclass(frozen=True)
class TerrainField:
    """Ground height everywhere.

    Attributes:
        outline: Where the ground meets the road.
        base: Heights without regard to the road: its trend with hills, or a real terrain.
        correction: What is added so that the ground comes up or down to the road; none where
            the base meets it already.
    """

    outline: Outline
    base: Heights
    correction: Lattice | None

    def __call__(self, points: FloatArray) -> FloatArray:
        """Heights at places (N x 2), metres."""
        heights = self.base(points)
        if self.correction is None:
            return heights
        corrected: FloatArray = heights + self.correction(points)
        corrected += self._mismatch(points, self.correction)
        return corrected

    def _mismatch(self, points: FloatArray, correction: Lattice) -> FloatArray:
        """What the lattice misses at the nearest place of the road, fading with distance."""
        reach = MISMATCH_REACH * correction.spacing
        distance, place = self.outline.nearest(points, reach)
        near = distance < reach
        foot, share = place[near], 1 - distance[near] / reach
        result = np.zeros(len(points))
        missing = foot[:, 2] - self.base(foot) - correction(foot)
        result[near] = missing * share * share * (3 - 2 * share)
        return result


def fit_terrain(
    surface: RoadSurface, rules: TerrainRules, seed: int, base: Heights | None = None
) -> TerrainField:
    """Fits the ground to the road's outline.

    1. The base is given (a real terrain), or it is the plane through the road, as far as the road
       spreads enough to tell one, with seeded hills.
    2. What the base misses at the outline is interpolated between roads by a membrane; so hills
       grow with the distance from the road.
    3. The sum rises nowhere faster than the bank slope.

    Args:
        surface: Road; only its outline counts.
        rules: Relief and slopes.
        seed: The user's seed.
        base: Heights to start from.
    """
    outline = Outline.of(surface)
    start = base or _hills(_trend(outline), rules, seed)
    margin = HILLS_MARGIN if rules.relief and base is None else MARGIN
    correction = _correction(outline, start, rules.bank_slope, margin, base is not None)
    return TerrainField(outline, start, correction)


def _trend(outline: Outline) -> Heights:
    """The plane through the outline, level along axes along which the road hardly spreads."""
    if not len(outline):
        return lambda points: np.zeros(len(points))
    points, _ = outline.samples(5.0)
    middle = points.mean(axis=0)
    offset = points - middle
    variance, axes = np.linalg.eigh(offset[:, :2].T @ offset[:, :2] / len(points))
    axes = axes[:, variance > TREND_SPREAD**2]
    slope = axes @ np.linalg.lstsq(offset[:, :2] @ axes, offset[:, 2], rcond=None)[0]
    return lambda points: middle[2] + (points[:, :2] - middle[:2]) @ slope


def _hills(ground: Heights, rules: TerrainRules, seed: int) -> Heights:
    if not rules.relief:
        return ground

    def heights(points: FloatArray) -> FloatArray:
        draw = generator(seed, "terrain", "relief")
        noise = smooth_noise(points, rules.relief_wavelength, draw)
        return ground(points) + rules.relief * np.tanh(noise / RELIEF_PEAK)

    return heights


def _correction(
    outline: Outline, base: Heights, bank_slope: float, margin: float, fading: bool
) -> Lattice | None:
    samples, _ = outline.samples(1.0)
    if not len(outline) or np.max(np.abs(samples[:, 2] - base(samples))) < EXACT:
        return None
    step, first, shape = _extent(samples, margin)
    spacing = step * CELL_SIZE
    node, missing = _known_nodes(outline, base, samples, spacing)
    column, row = (node - first).T
    known = np.full(shape, np.nan)
    known[row, column] = missing
    if fading:
        far = distance_transform_edt(np.isnan(known)) * spacing
        known[far > FADING + np.max(np.abs(missing)) / bank_slope] = 0.0
    values = fill_membrane(known)
    axes = [
        (start + np.arange(size)) * spacing for start, size in zip(first, shape[::-1], strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    ground = base(grid).reshape(shape)
    slope = max(BANK_SHARE * bank_slope, _steepness(samples))
    banked = limit_slopes(ground + values, ~np.isnan(known), spacing, slope)
    return Lattice(first, spacing, banked - ground)


def _steepness(samples: FloatArray) -> float:
    """Slope that the road itself hardly ever exceeds, metres a metre."""
    step = np.diff(samples, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    along = (length > 0.3) & (length <= 1.0)
    return float(np.quantile(np.abs(step[along, 2]) / length[along], 0.99)) if along.any() else 0.0


def _extent(samples: FloatArray, margin: float) -> tuple[int, IntArray, tuple[int, int]]:
    """The finest lattice that is not too large: step in cells, first node, rows and columns."""
    low, high = samples[:, :2].min(axis=0) - margin, samples[:, :2].max(axis=0) + margin
    for step in STEPS:
        first = np.floor(low / (step * CELL_SIZE)).astype(np.int64)
        columns, rows = np.ceil(high / (step * CELL_SIZE)).astype(np.int64) - first + 1
        if columns * rows <= MAX_NODES:
            break
    return step, first, (int(rows), int(columns))


def _known_nodes(
    outline: Outline, base: Heights, samples: FloatArray, spacing: float
) -> tuple[IntArray, FloatArray]:
    """Nodes beside the outline, K x 2 (column, row), and what the base misses there, K."""
    around = np.stack(np.meshgrid([-1, 0, 1, 2], [-1, 0, 1, 2]), axis=-1).reshape(-1, 1, 2)
    cells = np.unique(np.floor(samples[:, :2] / spacing).astype(np.int64), axis=0)
    nodes = np.unique((cells + around).reshape(-1, 2), axis=0)
    distance, place = outline.nearest(nodes * spacing, spacing)
    close = distance <= 0.75 * spacing
    return nodes[close], place[close, 2] - base(nodes[close] * spacing)

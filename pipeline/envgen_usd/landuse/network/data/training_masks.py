"""Training masks: the known cells of a landuse map."""

import numpy as np
from PIL import Image, ImageDraw

from envgen_usd.landuse.network.data.cell_order import dispersed_order
from envgen_usd.models.array_types import BoolArray

SPARSEST, DENSEST = 1 / 4096, 1 / 16
"""Range of the share of scattered known cells, drawn log-uniformly: 64 to 4 cells apart."""


def draw_mask(size: int, rng: np.random.Generator, scattered: float) -> BoolArray:
    """Draws the mask of known cells, size x size; the road is added later.

    The hole is the whole map, all except fixed neighbours, one half, or boxes and strokes. With a
    probability of `scattered`, single known cells are scattered over it, as between the passes of
    sampling.
    """
    kind = rng.choice(4, p=(0.55, 0.2, 0.1, 0.15))
    known = (_nothing, _neighbours, _half, _brushed)[kind](size, rng)
    if rng.uniform() < scattered:
        share = np.exp(rng.uniform(np.log(SPARSEST), np.log(DENSEST)))
        known |= dispersed_order((size, size), rng) < share
    return known


def _nothing(size: int, rng: np.random.Generator) -> BoolArray:  # noqa: ARG001 - one signature
    return np.zeros((size, size), dtype=np.bool_)


def _neighbours(size: int, rng: np.random.Generator) -> BoolArray:
    """Strips of known cells along some of the four edges."""
    known = np.zeros((size, size), dtype=np.bool_)
    width = int(rng.integers(size // 16, size // 5))
    for turn in np.flatnonzero(rng.random(4) < 0.5):
        np.rot90(known, int(turn))[:width] = True
    return known


def _half(size: int, rng: np.random.Generator) -> BoolArray:
    known = np.zeros((size, size), dtype=np.bool_)
    np.rot90(known, int(rng.integers(4)))[: int(rng.uniform(0.3, 0.7) * size)] = True
    return known


def _brushed(size: int, rng: np.random.Generator) -> BoolArray:
    """A hole of boxes and free-form strokes (parameters of Li et al. 2022, scaled)."""
    image = Image.new("1", (size, size), 1)
    draw = ImageDraw.Draw(image)
    for limit, most in ((size // 2, 4), (size, 2)):
        for _ in range(rng.integers(most)):
            low, sides = rng.integers(0, size, 2), rng.integers(size // 8, limit, 2)
            draw.rectangle((*low.tolist(), *(low + sides).tolist()), fill=0)
    for _ in range(rng.integers(1, 8)):
        steps = rng.normal(0.0, size / 8, (rng.integers(4, 18), 2))
        points = rng.uniform(0, size, 2) + np.cumsum(steps, axis=0)
        width = int(rng.integers(size // 20, size // 5))
        draw.line([tuple(point) for point in points.tolist()], fill=0, width=width, joint="curve")
    return np.array(image, dtype=np.bool_)

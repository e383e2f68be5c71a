"""Places in a chunk as whole numbers, so that equal places are found without tolerance."""

import numpy as np

from envgen_usd.chunks import GRID, Chunk
from envgen_usd.models.arrays import FloatArray, IntArray

_STEPS = round(1 / GRID)
_BASE = 1 << 20


def codes_of(chunk: Chunk, places: FloatArray) -> IntArray:
    """One number for each place (... x 2, metres, road frame) on a chunk or its border."""
    steps = np.round((places - np.array(chunk.origin)) * _STEPS).astype(np.int64)
    codes: IntArray = steps[..., 0] * _BASE + steps[..., 1]
    return codes


def places_of(chunk: Chunk, codes: IntArray) -> FloatArray:
    """The places (... x 2) of numbers; equal to what `chunks.snap` gives for them."""
    origin = np.round(np.array(chunk.origin) * _STEPS)
    steps = np.stack([codes // _BASE, codes % _BASE], axis=-1)
    places: FloatArray = (steps + origin) / _STEPS
    return places

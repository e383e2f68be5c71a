"""Codes points of a chunk as integers, so that positions compare exactly."""

import numpy as np

from envgen_usd.chunks import GRID, Chunk
from envgen_usd.models.array_types import FloatArray, IntArray

_STEPS = round(1 / GRID)
_BASE = 1 << 20
"""Factor of the x steps in a code; larger than the number of y steps along a chunk."""


def codes_of(chunk: Chunk, places: FloatArray) -> IntArray:
    """Returns the code of each point (... x 2, metres, road frame) on a chunk or its border."""
    steps = np.round((places - np.array(chunk.origin)) * _STEPS).astype(np.int64)
    codes: IntArray = steps[..., 0] * _BASE + steps[..., 1]
    return codes


def places_of(chunk: Chunk, codes: IntArray) -> FloatArray:
    """Returns the points (... x 2, metres, road frame) of codes; equal to their `chunks.snap`."""
    origin = np.round(np.array(chunk.origin) * _STEPS)
    steps = np.stack([codes // _BASE, codes % _BASE], axis=-1)
    places: FloatArray = (steps + origin) / _STEPS
    return places

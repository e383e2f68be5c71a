"""Authors attributes with time samples."""

from collections.abc import Sequence

import numpy as np
from pxr import Sdf

from envgen_usd.assets.prim_authoring import set_attribute
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

EXACT_PLACE = 0.0001
"""Metres that a place may miss between its samples; a larger value needs fewer samples."""
EXACT_TURN = 0.001
"""Degrees that a turn may miss between its samples; 0.1 mm at a distance of 6 m."""


def set_times(layer: Sdf.Layer, rate: float, first: int, last: int) -> None:
    """Authors the time codes of a layer: frames a second, first and last frame."""
    layer.timeCodesPerSecond = rate
    layer.framesPerSecond = rate
    layer.startTimeCode = float(first)
    layer.endTimeCode = float(last)


def needed_rows(values: FloatArray, frames: IntArray, tolerance: float) -> BoolArray:
    """Rows (N) from which linear interpolation gives all others.

    The algorithm of Douglas and Peucker (1973) along time: the row of the largest error divides
    each stretch, until no error is larger than the tolerance. Rows beside a gap are kept.

    Args:
        values: N x K.
        frames: N, ascending.
        tolerance: Largest error of a value.
    """
    kept = np.ones(len(values), dtype=bool)
    kept[1:-1] = (np.diff(frames)[1:] > 1) | (np.diff(frames)[:-1] > 1)
    rows = np.arange(len(values))
    while not kept.all():
        knots = np.flatnonzero(kept)
        drawn = [np.interp(frames, frames[knots], column[knots]) for column in values.T]
        errors = np.abs(np.stack(drawn, axis=1) - values).max(axis=1)
        if errors.max() <= tolerance:
            break
        stretch = np.searchsorted(knots[1:-1], rows, side="right")
        worst = np.maximum.reduceat(errors, knots[:-1])
        kept[(errors == worst[stretch]) & (errors > tolerance)] = True
    return kept


def add_samples(
    prim: Sdf.PrimSpec,
    name: str,
    type_name: Sdf.ValueTypeName,
    frames: Sequence[float],
    values: Sequence[object],
) -> None:
    """Adds an attribute with time samples; its default is the first, for readers without time."""
    attribute = set_attribute(prim, name, type_name, values[0])
    if len(values) > 1:
        for frame, value in zip(frames, values, strict=True):
            prim.layer.SetTimeSample(attribute.path, frame, value)


def frame_codes(frames: IntArray) -> list[float]:
    """Time codes of frames."""
    return [float(frame) for frame in frames.tolist()]

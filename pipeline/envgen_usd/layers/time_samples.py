"""Authors attributes with time samples."""

from collections.abc import Sequence

import numpy as np
from pxr import Sdf

from envgen_usd.assets.prim_authoring import set_attribute
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray


def set_times(layer: Sdf.Layer, rate: float, first: int, last: int) -> None:
    """Authors the time codes of a layer: frames a second, first and last frame."""
    layer.timeCodesPerSecond = rate
    layer.framesPerSecond = rate
    layer.startTimeCode = float(first)
    layer.endTimeCode = float(last)


def changes(values: FloatArray, frames: IntArray) -> BoolArray:
    """Rows (N) that linear interpolation of the others would not give: those beside a change."""
    if len(values) < 3:
        return np.ones(len(values), dtype=bool)
    same = (np.abs(np.diff(values, axis=0)) < 1e-6).all(axis=1) & (np.diff(frames) == 1)
    kept = np.ones(len(values), dtype=bool)
    kept[1:-1] = ~(same[:-1] & same[1:])
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

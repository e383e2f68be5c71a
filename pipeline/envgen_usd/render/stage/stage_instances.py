"""Reads point instancers."""

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.stage.typed_values import BadValueError, whole_numbers

MOST_INSTANCES = 1_000_000
"""Instances of a point instancer that are drawn; a larger value needs more memory."""


@dataclass(frozen=True)
class InstanceArrays:
    """Instances of a point instancer that can be drawn.

    Attributes:
        prototypes: Number of the prototype of each, N.
        matrices: Places of the prototypes in the instancer's space, N x 4 x 4, for columns.
        fault: What keeps instances from being drawn; empty if nothing does.
        faulty: The attribute that it is about; `None` for the instancer.
    """

    prototypes: IntArray
    matrices: FloatArray
    fault: str = ""
    faulty: Usd.Attribute | None = None


_NONE = np.empty(0, np.int64), np.empty((0, 4, 4))


def read_instances(instancer: UsdGeom.PointInstancer, time: Usd.TimeCode) -> InstanceArrays:
    """Reads the places of instances; hidden ones and those that are not finite are left out."""
    indices = instancer.GetProtoIndicesAttr()
    try:
        numbers = whole_numbers(indices, time)
    except BadValueError as error:
        return InstanceArrays(*_NONE, str(error), indices)
    if len(numbers) > MOST_INSTANCES:
        text = f"{len(numbers):,} instances are more than the {MOST_INSTANCES:,} that are drawn"
        return InstanceArrays(*_NONE, text, indices)
    raw = instancer.ComputeInstanceTransformsAtTime(
        time, time, UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
    )
    matrices = np.array(raw, np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)
    if len(matrices) != len(numbers):
        return InstanceArrays(*_NONE, "arrays differ in length")
    mask = instancer.ComputeMaskAtTime(time)
    finite = np.isfinite(matrices).all(axis=(1, 2))
    drawn = finite & (np.array(mask, bool) if mask else True)
    found = numbers[drawn], matrices[drawn]
    if finite.all():
        return InstanceArrays(*found)
    text = f"{np.count_nonzero(~finite)} of {len(matrices)} instances are not finite"
    return InstanceArrays(*found, text, instancer.GetPositionsAttr())

"""From z up to glTF's y up: points, directions, and poses as translation, rotation and scale."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from envgen_usd.models.array_types import BoolArray, FloatArray

TURN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""East stays x, up becomes y, and south becomes z (glTF 2.0, 3.4)."""
_SHEAR = 1e-4
"""Cosine between the axes of a pose up to which it counts as free of shear."""


@dataclass(frozen=True)
class Poses:
    """Poses as glTF's nodes have them: scaled, then rotated, then moved.

    Attributes:
        translations: N x 3, metres.
        rotations: N x 4, unit quaternions (x, y, z, w).
        scales: N x 3; the first is negative for a mirrored pose.
        are_exact: N, False for poses with shear, which these three cannot express.
    """

    translations: FloatArray
    rotations: FloatArray
    scales: FloatArray
    are_exact: BoolArray


def turned(vectors: NDArray[Any]) -> FloatArray:
    """Points or directions (N x 3) with y up."""
    return np.stack((vectors[:, 0], vectors[:, 2], -vectors[:, 1]), axis=1)


def boxes_at(bounds: FloatArray, matrices: FloatArray) -> FloatArray:
    """Bounding boxes (N x 2 x 3, y up) of a box (2 x 3, y up) at places (N x 4 x 4, z up)."""
    linear = TURN @ matrices[:, :3, :3] @ TURN.T
    middle = linear @ bounds.mean(axis=0) + turned(matrices[:, :3, 3])
    reach = np.abs(linear) @ (np.diff(bounds, axis=0)[0] / 2.0)
    return np.stack((middle - reach, middle + reach), axis=1)


def poses_of(matrices: FloatArray) -> Poses:
    """Poses with y up of matrices (N x 4 x 4, z up, for column vectors)."""
    linear = TURN @ matrices[:, :3, :3] @ TURN.T
    scales = np.linalg.norm(linear, axis=1)
    flat = (scales <= 1e-12).any(axis=1)
    axes = linear / np.maximum(scales, 1e-12)[:, None, :]
    mirrored = np.linalg.det(axes) < 0.0
    axes[mirrored, :, 0] *= -1.0
    scales[mirrored, 0] *= -1.0
    cosines = np.einsum("nij,nik->njk", axes, axes) - np.eye(3)
    are_exact = (np.abs(cosines).max(axis=(1, 2), initial=0.0) <= _SHEAR) & ~flat
    axes[~are_exact] = np.eye(3)
    rotations = Rotation.from_matrix(axes).as_quat() if len(axes) else np.empty((0, 4))
    return Poses(turned(matrices[:, :3, 3]), rotations, scales, are_exact)

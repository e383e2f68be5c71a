"""Converts NumPy arrays to USD value types and back."""

import numpy as np
from pxr import Gf, Vt

from envgen_usd.models.array_types import FloatArray, IntArray


def to_points(values: FloatArray) -> Vt.Vec3fArray:
    """N x 3 numbers as an array of float vectors."""
    rows = np.ascontiguousarray(values, dtype=np.float32).reshape(-1, 3)
    return Vt.Vec3fArray.FromNumpy(rows)  # type: ignore[no-any-return, no-untyped-call]


def to_double3s(values: FloatArray) -> Vt.Vec3dArray:
    """N x 3 numbers as an array of double vectors."""
    rows = np.ascontiguousarray(values, dtype=np.float64).reshape(-1, 3)
    return Vt.Vec3dArray.FromNumpy(rows)  # type: ignore[no-any-return, no-untyped-call]


def to_uv(values: FloatArray) -> Vt.Vec2fArray:
    """N x 2 numbers as an array of float pairs."""
    rows = np.ascontiguousarray(values, dtype=np.float32).reshape(-1, 2)
    return Vt.Vec2fArray.FromNumpy(rows)  # type: ignore[no-any-return, no-untyped-call]


def to_ints(values: IntArray) -> Vt.IntArray:
    """N whole numbers as an array of 32-bit integers."""
    row = np.ascontiguousarray(values, dtype=np.int32).reshape(-1)
    return Vt.IntArray.FromNumpy(row)  # type: ignore[no-any-return, no-untyped-call]


def to_double3(values: FloatArray) -> Gf.Vec3d:
    """3 numbers as a double vector."""
    return Gf.Vec3d(*(float(value) for value in values))


def to_float3(values: FloatArray) -> Gf.Vec3f:
    """3 numbers as a float vector."""
    return Gf.Vec3f(*(float(value) for value in values))


def from_vectors(values: object) -> FloatArray:
    """An array of USD vectors, or a single vector, as float64 numbers."""
    return np.asarray(values, dtype=np.float64)

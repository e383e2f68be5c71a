"""Piecewise cubic polynomials along a line."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.frozen_model import Model


@dataclass(frozen=True, repr=False, eq=False)
class Cubics(Model):
    """Piecewise cubic ``a + b ds + c ds² + d ds³``; ``ds = s - start`` of the last piece.

    Attributes:
        start: N, ascending.
        coefficients: N x 4, (a, b, c, d).
    """

    start: FloatArray
    coefficients: FloatArray

    def __call__(self, s: FloatArray) -> FloatArray:
        """Evaluates the polynomial at each s (any shape); 0 without any piece.

        Before the first piece, the first piece continues.
        """
        if not len(self.start):
            return np.zeros_like(s)
        piece = np.maximum(np.searchsorted(self.start, s, side="right") - 1, 0)
        ds = s - self.start[piece]
        a, b, c, d = np.moveaxis(self.coefficients[piece], -1, 0)
        value: FloatArray = a + ds * (b + ds * (c + ds * d))
        return value

    def derivative(self, s: FloatArray) -> FloatArray:
        """Evaluates the first derivative at each s (any shape)."""
        if not len(self.start):
            return np.zeros_like(s)
        piece = np.maximum(np.searchsorted(self.start, s, side="right") - 1, 0)
        ds = s - self.start[piece]
        _, b, c, d = np.moveaxis(self.coefficients[piece], -1, 0)
        slope: FloatArray = b + ds * (2 * c + 3 * ds * d)
        return slope


NO_CUBICS = Cubics(np.empty(0), np.empty((0, 4)))

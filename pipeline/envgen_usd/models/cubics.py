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
        ds, (a, b, c, d) = self._at(s)
        value: FloatArray = a + ds * (b + ds * (c + ds * d))
        return value

    def derivative(self, s: FloatArray) -> FloatArray:
        """Evaluates the first derivative at each s (any shape)."""
        if not len(self.start):
            return np.zeros_like(s)
        ds, (_, b, c, d) = self._at(s)
        slope: FloatArray = b + ds * (2 * c + 3 * ds * d)
        return slope

    def _at(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns ``ds`` at each s, and the coefficients there: 4 x s, or 4 of a single piece."""
        if len(self.start) == 1:
            return s - self.start[0], self.coefficients[0]
        piece = np.maximum(np.searchsorted(self.start, s, side="right") - 1, 0)
        return s - self.start[piece], self.coefficients.T[:, piece]


NO_CUBICS = Cubics(np.empty(0), np.empty((0, 4)))

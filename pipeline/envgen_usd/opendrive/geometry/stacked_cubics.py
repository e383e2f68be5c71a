"""Piecewise functions of several owners, evaluated at once."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.cubics import Cubics

_ZERO = Cubics(np.zeros(1), np.zeros((1, 4)))


class StackedStarts:
    """Starts of the pieces of N owners, searched at once."""

    def __init__(self, starts: Sequence[FloatArray]) -> None:
        """Stacks the ascending starts of each owner; an owner may have none."""
        counts = np.array([len(each) for each in starts])
        self._first: IntArray = np.cumsum(counts) - counts
        self.start: FloatArray = np.concatenate(starts)
        self._single = bool((counts == 1).all())
        self._keys = _keys(np.repeat(np.arange(len(starts)), counts), self.start)

    def last_before(self, owner: IntArray, s: FloatArray) -> tuple[IntArray, IntArray]:
        """Returns the last piece of its owner at or before each s, and the owner's first piece.

        The last piece is less than the first one where no piece starts at or before s.
        """
        first = self._first[owner]
        if self._single:
            return first - (s < self.start[first]), first
        return np.searchsorted(self._keys, _keys(owner, s), side="right") - 1, first


def _keys(owner: IntArray, s: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """Returns keys that sort by owner, then by s: complex numbers compare by their real part."""
    keys = np.empty(len(s), dtype=np.complex128)
    keys.real, keys.imag = owner, s
    return keys


class StackedCubics:
    """Cubics of N owners, evaluated at once as `Cubics` are; 0 for an owner without any piece."""

    def __init__(self, parts: Sequence[Cubics]) -> None:
        """Stacks the cubics of each owner."""
        parts = [part if len(part.start) else _ZERO for part in parts]
        self._starts = StackedStarts([part.start for part in parts])
        self._coefficients = np.concatenate([part.coefficients for part in parts]).T
        self._zero = not self._coefficients.any()

    def __call__(self, owner: IntArray, s: FloatArray) -> FloatArray:
        """Evaluates the cubic of each owner (M) at each s (M)."""
        if self._zero:
            return np.zeros_like(s)
        piece = np.maximum(*self._starts.last_before(owner, s))
        ds = s - self._starts.start[piece]
        a, b, c, d = self._coefficients[:, piece]
        value: FloatArray = a + ds * (b + ds * (c + ds * d))
        return value

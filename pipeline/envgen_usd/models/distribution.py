"""Distributions of figures: a range, or quantiles with the number of their samples.

Both are drawn by inverse transform: the quantile at a share in [0, 1) (Devroye 1986, "Non-Uniform
Random Variate Generation", II.2). Figures that depend on one another share a Gaussian copula: their
shares are Φ of correlated normal numbers (Nelsen 2006, "An Introduction to Copulas", 2.3).
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from statistics import NormalDist
from typing import TypeAlias, TypeVar, overload

import numpy as np

from envgen_usd.models.array_types import FloatArray

_NORMAL = NormalDist()
_TAIL = 1e-3
"""Least distance of a share from 0 and 1 as a normal number; a larger value shortens tails."""


@dataclass(frozen=True)
class Quantiles:
    """A distribution by its quantiles, linear between them.

    Where a range is expected, the smallest and the largest value stand for it.

    Attributes:
        quantiles: Q values, ascending: at the shares 0, 1 / (Q - 1), ..., 1.
        samples: Number of the samples that they were estimated from.
    """

    quantiles: tuple[float, ...]
    samples: int = 0

    def __post_init__(self) -> None:
        """Refuses fewer than two quantiles, and values that do not ascend."""
        values = self.quantiles
        if len(values) < 2 or not all(math.isfinite(value) for value in values):
            raise ValueError("quantiles: expected at least two finite numbers")
        if any(after < before for before, after in pairwise(values)):
            raise ValueError("quantiles: expected ascending numbers")
        if self.samples < 0:
            raise ValueError(f"samples: expected a number of at least 0, not {self.samples}")

    def __getitem__(self, end: int) -> float:
        """The smallest value (0) or the largest (1)."""
        return (self.quantiles[0], self.quantiles[-1])[end]

    def __iter__(self) -> Iterator[float]:
        """The smallest and the largest value."""
        return iter((self.quantiles[0], self.quantiles[-1]))

    def __len__(self) -> int:
        """Number of ends."""
        return 2


F = TypeVar("F", bound=float)
RangeOf: TypeAlias = tuple[F, F] | Quantiles
Range: TypeAlias = tuple[float, float] | Quantiles


@overload
def value_at(figure: Range, share: float) -> float: ...
@overload
def value_at(figure: Range, share: FloatArray) -> FloatArray: ...
def value_at(figure: Range, share: float | FloatArray) -> float | FloatArray:
    """The value below which a share (0 to 1) of a distribution lies."""
    if not isinstance(figure, Quantiles):
        return figure[0] + (figure[1] - figure[0]) * share
    places = np.linspace(0.0, 1.0, len(figure.quantiles))
    values = np.interp(share, places, figure.quantiles)
    return float(values) if isinstance(share, float) else values


def share_below(figure: Range, value: float) -> float:
    """The share (0 to 1) of a distribution below a value; the middle of equal quantiles."""
    values = np.array(figure.quantiles if isinstance(figure, Quantiles) else figure)
    places = np.linspace(0.0, 1.0, len(values))
    first, last = (np.searchsorted(values, value, side) for side in ("left", "right"))
    if first < last:
        return float(places[first] + places[last - 1]) / 2.0
    return float(np.interp(value, values, places))


def mean_of(figure: Range) -> float:
    """Mean of a distribution."""
    values = np.array(figure.quantiles if isinstance(figure, Quantiles) else figure)
    return float(np.mean((values[:-1] + values[1:]) / 2.0))


@overload
def drawn(draws: np.random.Generator, figure: Range) -> float: ...
@overload
def drawn(draws: np.random.Generator, figure: Range, size: int | tuple[int, ...]) -> FloatArray: ...
def drawn(
    draws: np.random.Generator, figure: Range, size: int | tuple[int, ...] | None = None
) -> float | FloatArray:
    """Draws from a distribution; each value takes a single random number."""
    if isinstance(figure, Quantiles):
        return value_at(figure, draws.random(size))
    return draws.uniform(*figure, size)


def drawn_count(draws: np.random.Generator, figure: Range) -> int:
    """Draws a whole number; of a range, both ends included."""
    if isinstance(figure, Quantiles):
        return round(value_at(figure, draws.random()))
    return int(draws.integers(round(figure[0]), round(figure[1]) + 1))


@dataclass(frozen=True)
class Correlation:
    """Gaussian copula of several figures.

    Attributes:
        figures: Names; those in `known` first.
        matrix: Rows of the lower triangle of the correlations between the normal scores, the
            diagonal's ones included.
        known: Distributions of the figures that are known when the others are drawn.
        samples: Number of the samples that the correlations were estimated from.
    """

    figures: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]
    known: Mapping[str, Quantiles]
    samples: int = 0

    def __post_init__(self) -> None:
        """Refuses what is no correlation matrix of the figures."""
        count = len(self.figures)
        if len(set(self.figures)) < count or not count:
            raise ValueError("figures: expected different names")
        if self.figures[: len(self.known)] != tuple(self.known):
            raise ValueError(f"figures: expected {', '.join(self.known)} first, as in known")
        if [len(row) for row in self.matrix] != list(range(1, count + 1)):
            raise ValueError(f"matrix: expected {count} rows of 1 to {count} correlations")
        if any(row[-1] != 1.0 for row in self.matrix):
            raise ValueError("matrix: expected each row to end in 1.0")
        try:
            finite = bool(np.isfinite(self._root).all())
        except np.linalg.LinAlgError:
            finite = False
        if not finite:
            raise ValueError("matrix: expected positive definite correlations")

    @cached_property
    def _root(self) -> FloatArray:
        """Lower Cholesky factor of the correlations."""
        count = len(self.figures)
        full = np.zeros((count, count))
        for number, row in enumerate(self.matrix):
            full[number, : len(row)] = full[: len(row), number] = row
        root: FloatArray = np.linalg.cholesky(full).astype(np.float64)
        return root

    def tied(self, known: Mapping[str, float], free: Mapping[str, float]) -> dict[str, float]:
        """Shares of the other figures, correlated with one another and with the known figures.

        Args:
            known: Values of the figures in `known`.
            free: Independent shares of the others, 0 to 1; names without correlation are ignored.
        """
        count = len(self.known)
        scores = [normal_score(share_below(self.known[n], known[n])) for n in self.known]
        root = self._root
        bases = np.zeros(len(self.figures))
        bases[:count] = np.linalg.solve(root[:count, :count], scores)
        bases[count:] = [normal_score(free[name]) for name in self.figures[count:]]
        tied = (root @ bases)[count:]
        return {n: _NORMAL.cdf(z) for n, z in zip(self.figures[count:], tied, strict=True)}


def normal_score(share: float) -> float:
    """The normal number below which a share lies, within ±3.1."""
    return _NORMAL.inv_cdf(min(max(share, _TAIL), 1.0 - _TAIL))


def quantiles_of(values: Sequence[float] | FloatArray, count: int, trimmed: float) -> Quantiles:
    """Estimates quantiles of samples, to three decimals.

    Args:
        values: Samples, finite.
        count: Number of quantiles.
        trimmed: Share of the samples beyond the smallest and beyond the largest quantile.
    """
    shares = trimmed + (1.0 - 2.0 * trimmed) * np.linspace(0.0, 1.0, count)
    found = np.quantile(np.asarray(values, float), shares)
    return Quantiles(tuple(round(float(value), 3) for value in found), len(values))

"""Random generators and figures, all derived by name from a single seed."""

import hashlib
from collections.abc import Mapping
from copy import copy
from typing import TypeVar

import numpy as np

from envgen_usd.models.distribution import Quantiles, Range, value_at

_Key = TypeVar("_Key", bound=str)


def generator(seed: int, *names: str | int) -> np.random.Generator:
    """Returns the random generator of a seed and a path of names.

    The same arguments give the same stream on every machine and in every process. Other draws do
    not affect it, so chunks can be built in any order.

    Args:
        seed: The user's seed.
        names: The layer, the chunk, the object, ... e.g. ``("city", "1_-2", "plot_17")``.
    """
    digest = hashlib.sha256(_path(seed, *names)).digest()
    # An array of 32-bit words is taken as it is; a list of numbers is converted one by one.
    words = np.frombuffer(digest, dtype="<u4").astype(np.uint32)
    return np.random.default_rng(np.random.SeedSequence(words))


class Draws:
    """Single random figures by name, each independent of all others.

    A figure follows from the seed, the path and its name alone, not from earlier draws. So a new
    draw, or a draw that is left out, changes no other figure (Salmon et al. 2011, "Parallel random
    numbers: as easy as 1, 2, 3": a figure is a hash of its place). Each name counts once.
    """

    def __init__(self, seed: int, *names: str | int) -> None:
        """Args: the user's seed, and a path of names as for `generator`."""
        self._path = hashlib.sha256(_path(seed, *names, ""))
        self._drawn: set[str] = set()
        self._shares: Mapping[str, float] = {}

    def with_shares(self, shares: Mapping[str, float]) -> "Draws":
        """The same draws, but the named figures have given shares, e.g. correlated ones."""
        other = copy(self)
        other._drawn, other._shares = set(), shares
        return other

    def share(self, name: str) -> float:
        """A number in [0, 1), a multiple of 2⁻⁵³.

        Raises:
            ValueError: The name was drawn before; a second decision needs a name for itself.
        """
        if name in self._drawn:
            raise ValueError(f"'{name}' was drawn before")
        self._drawn.add(name)
        if name in self._shares:
            return self._shares[name]
        place = self._path.copy()
        place.update(name.encode())
        return (int.from_bytes(place.digest()[:8], "little") >> 11) * 2.0**-53

    def happens(self, name: str, probability: float) -> bool:
        """True with a probability."""
        return self.share(name) < probability

    def within(self, name: str, limits: Range) -> float:
        """A number of a range or of another distribution."""
        return value_at(limits, self.share(name))

    def whole(self, name: str, limits: Range) -> int:
        """A whole number of a range, both ends included, or of another distribution, rounded."""
        if isinstance(limits, Quantiles):
            return round(value_at(limits, self.share(name)))
        low, high = round(limits[0]), round(limits[1])
        return low + int(self.share(name) * (high - low + 1))

    def choice(self, name: str, weights: Mapping[_Key, float]) -> _Key:
        """A key, by weight."""
        mark = self.share(name) * sum(weights.values())
        for key, weight in weights.items():
            mark -= weight
            if mark < 0.0:
                return key
        return list(weights)[-1]


def _path(seed: int, *names: str | int) -> bytes:
    return "\x1f".join(str(part) for part in (seed, *names)).encode()

"""One seed, split by name: every random draw comes from a generator that is made here."""

import hashlib

import numpy as np


def generator(seed: int, *names: str | int) -> np.random.Generator:
    """Returns the generator that belongs to a seed and a path of names.

    The same arguments give the same stream on every machine and in every process, whatever was
    drawn elsewhere, so a chunk does not depend on the order in which chunks are built.

    Args:
        seed: The user's seed.
        names: The layer, the chunk, the object, ... e.g. ``("city", "1_-2", "plot_17")``.
    """
    text = "\x1f".join(str(part) for part in (seed, *names))
    words = np.frombuffer(hashlib.sha256(text.encode()).digest(), dtype="<u4")
    return np.random.default_rng(np.random.SeedSequence(words.tolist()))

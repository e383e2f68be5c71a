"""Pause of Python's collector of reference cycles."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def paused_collection() -> Iterator[None]:
    """Pauses the collector of reference cycles; use it as a decorator or in ``with``.

    The collector visits all objects again and again while their number grows. Steps that build
    large models without cycles pause it; counting references still frees what they drop. What a
    step leaves counts as long-lived, as if the collector had visited it.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            _age()
            gc.enable()


def _age() -> None:
    """Moves all objects to the oldest generation, unless the caller keeps objects from it."""
    if not gc.get_freeze_count():
        gc.freeze()
        gc.unfreeze()

"""Pause of Python's collector of reference cycles."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def paused_collection() -> Iterator[None]:
    """Pauses the collector of reference cycles; use it as a decorator or in ``with``.

    The collector visits all objects again and again while their number grows. Steps that build
    large models without cycles pause it; counting references still frees what they drop.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()

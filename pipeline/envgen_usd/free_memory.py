"""Hands free memory back to the system."""

import ctypes
from functools import cache


def trim_memory() -> None:
    """Returns what the allocator keeps for later to the system; does nothing without glibc.

    A step that needs many arrays leaves gaps in the heap. Without this, the next step's arrays
    come on top of them.
    """
    trim = _malloc_trim()
    if trim is not None:
        trim(0)


@cache
def _malloc_trim() -> "ctypes._NamedFuncPointer | None":
    """``malloc_trim`` of glibc, which other C libraries do not have."""
    try:
        return ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return None

"""Free memory goes back to the system."""

import ctypes
import sys
from pathlib import Path

import pytest

from envgen_usd import free_memory
from envgen_usd.free_memory import trim_memory


def resident() -> int:
    """Bytes of this process in memory."""
    return int(Path("/proc/self/statm").read_text("ascii").split()[1]) * 4096


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_gaps_in_the_heap_are_handed_back():
    libc = ctypes.CDLL(None)
    libc.malloc.restype, libc.free.argtypes = ctypes.c_void_p, [ctypes.c_void_p]
    blocks = [libc.malloc(20_000) for _ in range(5_000)]
    for block in blocks:
        ctypes.memset(block, 1, 20_000)
    for block in blocks[:-1]:
        libc.free(block)  # the last one keeps the heap from shrinking by itself
    before = resident()
    trim_memory()
    assert resident() < before - 50_000_000
    libc.free(blocks[-1])


def test_without_glibc_nothing_happens(monkeypatch):
    free_memory._malloc_trim.cache_clear()
    monkeypatch.setattr(ctypes, "CDLL", lambda _: object())
    trim_memory()
    free_memory._malloc_trim.cache_clear()

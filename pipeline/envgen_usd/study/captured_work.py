"""Work that a GPU repeats as one CUDA graph, so that it does not wait for Python."""

import threading
from collections.abc import Callable

import torch

_WARM_UP = 3
"""Calls before the capture, in which libraries choose their ways and caches are filled."""
_FULL = 0.6
"""Share of the memory above which that of finished graphs is given back."""
_CAPTURING = threading.Lock()
"""CUDA captures in one thread at a time."""


class CapturedWork:
    """Work without input and output but tensors that stay where they are.

    On a GPU it must not run in the default stream. On the CPU each call does the work.
    """

    def __init__(
        self, work: Callable[[], None], begin: Callable[[], None], draws: torch.Generator
    ) -> None:
        """Takes the work.

        Args:
            work: Asks nothing back from the device, and draws from `draws` alone.
            begin: Drops what the call before left; not called between calls of the graph, which
                write to the same places.
            draws: Random numbers, which go on from call to call.
        """
        self._work, self._begin, self._draws = work, begin, draws
        self._graph: torch.cuda.CUDAGraph | None = None
        self._calls = 0

    def __call__(self) -> None:
        """Does the work once."""
        self._calls += 1
        if self._draws.device.type != "cuda" or self._calls <= _WARM_UP:
            self._begin()
            self._work()
            return
        if self._graph is None:
            self._graph = self._captured()
        self._graph.replay()

    def _captured(self) -> torch.cuda.CUDAGraph:
        graph = torch.cuda.CUDAGraph()
        graph.register_generator_state(self._draws)
        with _CAPTURING:
            self._begin()
            torch.cuda.current_stream().synchronize()
            free, whole = torch.cuda.mem_get_info()
            if free < (1.0 - _FULL) * whole:
                torch.cuda.empty_cache()
            # Other threads go on with work of their own meanwhile.
            graph.capture_begin(capture_error_mode="thread_local")
            try:
                self._work()
            finally:
                graph.capture_end()
        return graph

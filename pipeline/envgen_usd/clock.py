"""Wall time by step, told to whoever watches."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[str, int, int], None]
"""Called with the step's name, what is done of it, and how much there is."""


class Clock:
    """Wall time by step."""

    def __init__(self, progress: Progress) -> None:
        """Starts with no step."""
        self.seconds: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def step(self, name: str, total: int = 1) -> Iterator[None]:
        """Times what is done inside, which has a number of parts."""
        self._progress(name, 0, max(total, 1))
        start = time.perf_counter()
        yield
        self.seconds[name] = round(time.perf_counter() - start, 3)
        self._progress(name, max(total, 1), max(total, 1))

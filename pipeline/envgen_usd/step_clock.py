"""Wall time of each step, with progress callbacks."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[str, int, int], None]
"""Called with the step's name, the number of parts done, and the total."""


class Clock:
    """Measures the wall time of each step."""

    def __init__(self, progress: Progress) -> None:
        """Starts without a step."""
        self.seconds: dict[str, float] = {}
        self.progress = progress

    @contextmanager
    def step(self, name: str, total: int = 1) -> Iterator[None]:
        """Times the block as a step with a number of parts."""
        self.progress(name, 0, max(total, 1))
        start = time.perf_counter()
        yield
        self.seconds[name] = round(time.perf_counter() - start, 3)
        self.progress(name, max(total, 1), max(total, 1))

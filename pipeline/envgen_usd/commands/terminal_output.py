"""Prints issues and progress to the terminal."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rich.progress
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from envgen_usd.errors import Issue
from envgen_usd.step_clock import Progress

console = Console(stderr=True)
LINE_INTERVAL = 10.0
"""Time between two lines of a command, seconds; a larger value makes logs shorter."""


def print_issues(issues: tuple[Issue, ...]) -> None:
    """Prints the number of issues of each kind, with an example."""
    if not issues:
        return
    kinds: dict[str, list[Issue]] = {}
    for issue in issues:
        kinds.setdefault(issue.kind, []).append(issue)
    table = Table(
        "issue",
        "times",
        "example",
        title="Warnings: the input was used after these repairs and decisions",
    )
    for kind, occurrences in sorted(kinds.items()):
        # As text: the brackets of a place are no markup.
        example = Text(f"{occurrences[0].where}: {occurrences[0].message}")
        table.add_row(kind, str(len(occurrences)), example)
    console.print(table)


@contextmanager
def shown_progress() -> Iterator[Progress]:
    """Shows the progress of long steps: bars on a terminal, else lines."""
    if not console.is_terminal:
        yield ProgressLines()
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with rich.progress.Progress(*columns, TimeElapsedColumn(), console=console) as display:
        yield ProgressBars(display)


class ProgressBars:
    """A bar for each step."""

    def __init__(self, display: rich.progress.Progress) -> None:
        """Takes the display that draws the bars."""
        self._display = display
        self._tasks: dict[str, rich.progress.TaskID] = {}

    def __call__(self, step: str, done: int, total: int) -> None:
        """Updates the bar of a step."""
        if step not in self._tasks:
            self._tasks[step] = self._display.add_task(step, total=total)
        self._display.update(self._tasks[step], completed=done, total=total)


class ProgressLines:
    """Prints a line at the end of a step, and at most every `LINE_INTERVAL` seconds before."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Takes the clock, in seconds."""
        self._clock = clock
        self._begun: dict[str, float] = {}
        self._ended: set[str] = set()
        self._said = clock()

    def __call__(self, step: str, done: int, total: int) -> None:
        """Prints the progress of a step, its rate, and the remaining time."""
        now = self._clock()
        begun = self._begun.setdefault(step, now)
        ends = done >= total and step not in self._ended
        if not ends and (now - self._said < LINE_INTERVAL or step in self._ended):
            return
        self._said, spent = now, now - begun
        text = f"{step}: {done}/{total}"
        if ends:
            self._ended.add(step)
            text += f" in {_duration(spent)}"
        elif done and spent > 0:
            text += (
                f", {done / spent:.3g} a second, {_duration((total - done) * spent / done)} left"
            )
        console.print(text, highlight=False, markup=False, soft_wrap=True)


def _duration(seconds: float) -> str:
    """E.g. ``1.5 s``, ``12 min 5 s`` or ``2 h 3 min``."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"

"""Prints issues and progress to the terminal."""

import shlex
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import rich.progress
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column, Table
from rich.text import Text

from envgen_usd.errors import Issue
from envgen_usd.step_clock import Progress

console = Console(stderr=True)
LINE_INTERVAL = 10.0
"""Time between two lines of a command, seconds; a larger value makes logs shorter."""


def shell_command(*words: object) -> str:
    """A command of this program as a user can paste it: paths with spaces are quoted."""
    return shlex.join(["envgen-usd", *map(str, words)])


def print_issues(issues: tuple[Issue, ...]) -> None:
    """Prints the number of issues of each kind, with an example and what was done about it."""
    if not issues:
        return
    kinds: dict[str, list[Issue]] = {}
    for issue in issues:
        kinds.setdefault(issue.kind, []).append(issue)
    table = Table(
        Column("issue", no_wrap=True),
        "times",
        Column("example", overflow="fold"),
        Column("done", overflow="fold"),
        title="Warnings: the input was used after these repairs and decisions",
    )
    for kind, occurrences in sorted(kinds.items()):
        # As text: the brackets of a place are no markup.
        first = occurrences[0]
        example = Text(f"{first.where}: {first.message}")
        table.add_row(kind, str(len(occurrences)), example, Text(first.action))
    console.print(table)


def print_findings(issues: Iterable[Issue]) -> None:
    """Prints a line for each issue, with its remedy."""
    for issue in issues:
        remedy = f"; {issue.action}" if issue.action else ""
        print(f"{issue.severity}: {issue.where}: {issue.message}{remedy}", file=sys.stderr)


@contextmanager
def shown_progress() -> Iterator[Progress]:
    """Shows the progress of long steps: bars on a terminal, else lines."""
    if not console.is_terminal:
        with ProgressLines().repeated() as lines:
            yield lines
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    times = (TimeElapsedColumn(), RateColumn(), TimeRemainingColumn())
    with rich.progress.Progress(*columns, *times, console=console) as display:
        yield ProgressBars(display)


class RateColumn(ProgressColumn):
    """Parts a second since the begin of the step; empty for steps of a single part."""

    def render(self, task: Task) -> Text:
        """Rate of a task."""
        spent = task.finished_time if task.finished else task.elapsed
        if not (task.completed and spent and (task.total or 0) > 1):
            return Text("")
        return Text(f"{task.completed / spent:.3g} a second, left:")


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


@dataclass
class _Step:
    """A step of a command.

    Attributes:
        begun: When it began, seconds of the clock.
        done: Parts that are done.
        total: Number of parts.
        is_said: True if its end was printed.
    """

    begun: float
    done: int = 0
    total: int = 1
    is_said: bool = False


class ProgressLines:
    """Prints a line at the end of a step, and every `LINE_INTERVAL` seconds before."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Takes the clock, in seconds."""
        self._clock = clock
        self._steps: dict[str, _Step] = {}
        self._said = clock()
        self._lock = threading.Lock()

    def __call__(self, step: str, done: int, total: int) -> None:
        """Notes the progress of a step, and prints it if it ended or if a line is due."""
        with self._lock:
            state = self._steps.setdefault(step, _Step(self._clock()))
            state.done, state.total = done, total
            if done >= total and not state.is_said:
                state.is_said = True
                self._say(f"{step}: {done}/{total} in {_duration(self._clock() - state.begun)}")
        self.remind()

    def remind(self) -> None:
        """Prints the running steps with rate and remaining time, if a line is due."""
        with self._lock:
            now = self._clock()
            last = self._said
            for name, state in self._steps.items():
                if not state.is_said and now - max(last, state.begun) >= LINE_INTERVAL:
                    self._say(f"{name}: {state.done}/{state.total}, {_outlook(state, now)}")

    @contextmanager
    def repeated(self) -> Iterator["ProgressLines"]:
        """Prints lines also while a step reports nothing."""
        ended = threading.Event()

        def remind() -> None:
            while not ended.wait(LINE_INTERVAL / 10.0):
                self.remind()

        reminder = threading.Thread(target=remind, daemon=True)
        reminder.start()
        try:
            yield self
        finally:
            ended.set()
            reminder.join()

    def _say(self, text: str) -> None:
        self._said = self._clock()
        console.print(text, highlight=False, markup=False, soft_wrap=True)


def _outlook(state: _Step, now: float) -> str:
    """Rate and remaining time of a step, or the time since its begin."""
    spent = now - state.begun
    if not state.done or spent <= 0.0:
        return f"for {_duration(spent)}"
    left = (state.total - state.done) * spent / state.done
    return f"{state.done / spent:.3g} a second, {_duration(left)} left"


def _duration(seconds: float) -> str:
    """E.g. ``1.5 s``, ``12 min 5 s`` or ``2 h 3 min``."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"

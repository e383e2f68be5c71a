"""What commands print of issues and of progress."""

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from envgen_usd.errors import Issue

console = Console(stderr=True)


def print_issues(issues: tuple[Issue, ...]) -> None:
    """Prints how often each kind of issue occurred, with one example."""
    if not issues:
        return
    kinds: dict[str, list[Issue]] = {}
    for issue in issues:
        kinds.setdefault(issue.kind, []).append(issue)
    table = Table("issue", "times", "example", title="Odd in the input, and used all the same")
    for kind, found in sorted(kinds.items()):
        table.add_row(kind, str(len(found)), f"{found[0].where}: {found[0].message}")
    console.print(table)


def progress_bars() -> Progress:
    """A display for `Bars`."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    return Progress(*columns, TimeElapsedColumn(), console=console, transient=False)


class Bars:
    """One bar for each step; called with its name, what is done of it, and how much there is."""

    def __init__(self, progress: Progress) -> None:
        """Args: the display."""
        self._progress = progress
        self._tasks: dict[str, int] = {}

    def __call__(self, step: str, done: int, total: int) -> None:
        """Shows how far a step is."""
        if step not in self._tasks:
            self._tasks[step] = int(self._progress.add_task(step, total=total))
        task = next(t for t in self._progress.tasks if t.id == self._tasks[step])
        self._progress.update(task.id, completed=done, total=total)

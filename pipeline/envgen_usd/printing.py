"""What commands print of issues."""

from rich.console import Console
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

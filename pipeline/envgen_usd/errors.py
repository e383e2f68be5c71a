"""`EnvgenError` stops the work; an `Issue` is reported, and the work continues."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum

BAD_INPUT = 2
"""Exit code for unusable input, and for files that cannot be read or written."""
INTERRUPTED = 130
"""Exit code after an interrupt; by shell convention 128 plus the number of SIGINT."""


class EnvgenError(Exception):
    """An unusable input or environment.

    The message is a single line for the user: the fault, its place and the remedy.
    """


def error_text(error: Exception) -> str:
    """Text of another library's error; bytes that are no UTF-8 are replaced.

    OpenUSD decodes its message when it is asked for, and a message may quote bytes of a damaged
    file.
    """
    try:
        return str(error)
    except UnicodeDecodeError as undecoded:
        return undecoded.object.decode("utf-8", "replace")


def one_line(error: Exception) -> str:
    """Text of another library's error without line breaks; its kind where it has no text."""
    return " ".join(error_text(error).split()) or type(error).__name__


@contextmanager
def noted(faults: list[str]) -> Iterator[None]:
    """Collects the lines of an error, so that a check continues with the next item."""
    try:
        yield
    except EnvgenError as error:
        faults += str(error).split("\n")


class Severity(StrEnum):
    """Effect of an issue on the result."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True)
class Issue:
    """A warning: usable but faulty input, or a decision beyond the input.

    Attributes:
        kind: Stable name, in dotted lower case, e.g. ``plan_view.gap``.
        severity: Effect on the result.
        where: Path of the element, e.g. ``road[id=7]/planView/geometry[3]``.
        message: The finding, with its numbers.
        action: The repair or decision; empty for a mere note.
        line: Line number in the file, or 0 without a line.
    """

    kind: str
    severity: Severity
    where: str
    message: str
    action: str = ""
    line: int = 0


def refuse_issues(issues: Sequence[Issue]) -> None:
    """Turns issues into an error, for runs that accept none.

    Raises:
        EnvgenError: There are issues; the message has a line for each kind, with its first place.
    """
    if not issues:
        return
    kinds = Counter(issue.kind for issue in issues)
    first = {issue.kind: issue for issue in reversed(issues)}
    lines = [f"{len(issues)} issues, and --strict accepts none"]
    lines += [
        f"{kind}, {times} times: {first[kind].where}: {first[kind].message}"
        for kind, times in sorted(kinds.items())
    ]
    raise EnvgenError("; ".join(lines))

"""`EnvgenError` stops the work; an `Issue` is reported and the work goes on."""

from dataclasses import dataclass
from enum import StrEnum


class EnvgenError(Exception):
    """Input or environment that cannot be used.

    The message is one line for the user: what is wrong, where, and what to do about it.
    """


class Severity(StrEnum):
    """How much an issue matters to the result."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True)
class Issue:
    """Something odd but usable in an input.

    Attributes:
        kind: Stable name of the finding, in dotted lower case, e.g. ``plan_view.gap``.
        severity: How much it matters.
        where: Path of the element, e.g. ``road[id=7]/planView/geometry[3]``.
        message: What was found, with the figures.
        action: What was done about it; empty where it was only noted.
        line: Line number in the file, or 0 where there is none.
    """

    kind: str
    severity: Severity
    where: str
    message: str
    action: str = ""
    line: int = 0

"""Findings of a file (warnings, errors, repairs), collected as `Issue` records on reading."""

from collections import Counter
from typing import Any, TypeAlias

from lxml import etree

from envgen_usd.errors import Issue, Severity

Element: TypeAlias = etree._Element
MOST_PER_KIND = 1000
"""Largest number of issues of a kind; further issues are only counted, which bounds the report."""


class Unusable(Exception):  # noqa: N818 - not an error of the program: the element is left out
    """An element that its road needs for its position, but that has no usable value.

    Attributes:
        element: The faulty element.
        kind: Kind of the issue, e.g. ``number.not_finite``.
        message: Fault of the element.
    """

    def __init__(self, element: Element, kind: str, message: str) -> None:
        """Stores the element and its fault."""
        super().__init__(message)
        self.element = element
        self.kind = kind
        self.message = message


class Hostile(Exception):  # noqa: N818 - turned into an EnvgenError where the file is known
    """An element that would exhaust memory or time, by intent or by mistake.

    Attributes:
        element: The hostile element.
        message: Extent of what the element requests.
    """

    def __init__(self, element: Element, message: str) -> None:
        """Stores the element and its fault."""
        super().__init__(message)
        self.element = element
        self.message = message


class Findings:
    """Collects the issues of a file."""

    def __init__(self) -> None:
        """Starts without issues."""
        self._issues: list[Issue] = []
        self._count: Counter[tuple[str, bool]] = Counter()

    @property
    def issues(self) -> tuple[Issue, ...]:
        """Returns all issues, plus a count for each kind above `MOST_PER_KIND`."""
        return (*self._issues, *self._rest())

    def noted(
        self, kind: str, element: Element, message: str, severity: Severity = Severity.WARNING
    ) -> None:
        """Records a fault that stays in the tree."""
        self._add(kind, element, message, "", severity)

    def repaired(
        self,
        kind: str,
        element: Element,
        message: str,
        action: str,
        severity: Severity = Severity.WARNING,
    ) -> None:
        """Records a fault and its repair; call it before the change of the tree."""
        self._add(kind, element, message, action, severity)

    def _add(
        self, kind: str, element: Element, message: str, action: str, severity: Severity
    ) -> None:
        key = kind, bool(action)
        self._count[key] += 1
        if self._count[key] <= MOST_PER_KIND:
            where, line = path_of(element), line_of(element)
            self._issues.append(Issue(kind, severity, where, message, action, line))

    def _rest(self) -> list[Issue]:
        return [
            Issue(
                kind,
                Severity.WARNING,
                "OpenDRIVE",
                f"{count - MOST_PER_KIND} more of this kind",
                "repaired like the others" if repaired else "",
            )
            for (kind, repaired), count in self._count.items()
            if count > MOST_PER_KIND
        ]


def remove(element: Element) -> None:
    """Removes an element from its tree; the text after the element stays."""
    parent = element.getparent()
    if parent is None:
        return
    before = element.getprevious()
    if element.tail and element.tail.strip():
        if before is None:
            parent.text = (parent.text or "") + element.tail
        else:
            before.tail = (before.tail or "") + element.tail
    parent.remove(element)


def line_of(element: Element) -> int:
    """Returns the line of an element in its file; 0 without a line."""
    line: Any = element.sourceline
    number: int = line or 0
    return number


def path_of(element: Element) -> str:
    """Returns the path of an element below the root, e.g. ``road[id=7]/planView/geometry[3]``.

    An id distinguishes an element from its siblings; without an id, its position counted from 1.
    """
    steps = [_step(element)]
    for above in element.iterancestors():
        steps.append(_step(above))
    return "/".join(reversed(steps[:-1])) or steps[0]


def _step(element: Element) -> str:
    tag = str(element.tag)
    name = element.get("id")
    if name is not None:
        return f"{tag}[id={name}]"
    before = sum(1 for _ in element.itersiblings(tag, preceding=True))
    alone = before == 0 and next(element.itersiblings(tag), None) is None
    return tag if alone else f"{tag}[{before + 1}]"

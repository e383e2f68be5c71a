"""What is odd in a file: collected while it is read, as `Issue` records."""

from collections import Counter
from typing import TypeAlias, cast

from lxml import etree

from envgen_usd.errors import Issue, Severity

Element: TypeAlias = etree._Element
MOST_PER_KIND = 1000
"""Issues of one kind that are kept; the rest are only counted, so that no file floods a report."""


class Unusable(Exception):  # noqa: N818 - not an error of the program: the element is left out
    """An element without which its road cannot be placed.

    Attributes:
        element: The element.
        kind: Kind of the issue, e.g. ``number.not_finite``.
        message: What is wrong with it.
    """

    def __init__(self, element: Element, kind: str, message: str) -> None:
        """Keeps what was wrong and where."""
        super().__init__(message)
        self.element = element
        self.kind = kind
        self.message = message


class Hostile(Exception):  # noqa: N818 - turned into an EnvgenError where the file is known
    """An element that is meant to exhaust the machine, or might as well be.

    Attributes:
        element: The element.
        message: What it would make.
    """

    def __init__(self, element: Element, message: str) -> None:
        """Keeps what was wrong and where."""
        super().__init__(message)
        self.element = element
        self.message = message


class Findings:
    """Collects issues of one file."""

    def __init__(self) -> None:
        """Starts without issues."""
        self._issues: list[Issue] = []
        self._count: Counter[tuple[str, bool]] = Counter()

    @property
    def issues(self) -> tuple[Issue, ...]:
        """All issues so far, and one more for each kind of which there were too many."""
        return (*self._issues, *self._rest())

    def noted(
        self, kind: str, element: Element, message: str, severity: Severity = Severity.WARNING
    ) -> None:
        """Records what is odd and stays as it is."""
        self._add(kind, element, message, "", severity)

    def mended(
        self,
        kind: str,
        element: Element,
        message: str,
        action: str,
        severity: Severity = Severity.WARNING,
    ) -> None:
        """Records what is odd and was mended in the tree; call it before the tree is changed."""
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
                "mended like the others" if mended else "",
            )
            for (kind, mended), count in self._count.items()
            if count > MOST_PER_KIND
        ]


def remove(element: Element) -> None:
    """Takes an element out of its tree, the text after it stays."""
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
    """Line of an element in its file, 0 where it has none."""
    return cast("int | None", element.sourceline) or 0


def path_of(element: Element) -> str:
    """Path of an element below the root, e.g. ``road[id=7]/planView/geometry[3]``.

    An element is told from its siblings by its id or, counted from 1, by its place among them.
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

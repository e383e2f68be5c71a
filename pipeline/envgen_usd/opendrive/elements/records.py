"""Elements that are kept as they are."""

from collections.abc import Collection

from envgen_usd.models.records import Record
from envgen_usd.opendrive.findings import Element, line_of


def record(element: Element) -> Record:
    """An element with everything below it."""
    return Record(
        str(element.tag),
        {str(name): str(value) for name, value in element.items()},
        tuple(record(child) for child in element.iterchildren("*")),
        (element.text or "").strip(),
        line_of(element),
    )


def others(element: Element, known: Collection[str]) -> tuple[Record, ...]:
    """The element's children whose tags are not known."""
    return tuple(record(child) for child in element.iterchildren("*") if child.tag not in known)


def leftovers(element: Element, known: Collection[str]) -> tuple[Record, ...]:
    """The element's attributes that are not known, as one record; nothing if there are none."""
    rest = {str(name): str(value) for name, value in element.items() if name not in known}
    return (Record(str(element.tag), rest, line=line_of(element)),) if rest else ()

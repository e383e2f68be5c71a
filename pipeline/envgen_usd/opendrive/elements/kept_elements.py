"""Converts elements without a specific model to records."""

from collections.abc import Collection

from envgen_usd.models.kept_records import Record
from envgen_usd.opendrive.document.findings import Element, line_of


def record(element: Element) -> Record:
    """Converts an element and its descendants to a record."""
    return Record(
        str(element.tag),
        dict(element.items()),  # type: ignore[arg-type]  # names and values are text
        tuple([record(child) for child in element.iterchildren("*")]) if len(element) else (),
        (element.text or "").strip(),
        line_of(element),
    )


def others(element: Element, known: Collection[str]) -> tuple[Record, ...]:
    """Returns the children with unknown tags as records."""
    return tuple(record(child) for child in element.iterchildren("*") if child.tag not in known)


def leftovers(element: Element, known: Collection[str]) -> tuple[Record, ...]:
    """Returns the unknown attributes as a record; empty without unknown attributes."""
    rest = {str(name): str(value) for name, value in element.items() if name not in known}
    return (Record(str(element.tag), rest, line=line_of(element)),) if rest else ()

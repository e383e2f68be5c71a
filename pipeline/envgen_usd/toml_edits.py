"""Changes values in the text of a TOML file; comments, order and the other values stay."""

import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, TypeAlias

import msgspec

from envgen_usd.errors import EnvgenError

Value: TypeAlias = float | Sequence[float] | Mapping[str, float]
NOTE = "# learned"
"""Begin of the comments that an edit writes, and that a later edit replaces."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_DIGITS = 4


@dataclass(frozen=True)
class Edit:
    """A new value of a TOML file.

    Attributes:
        table: Name of the table, e.g. ``props.bin``.
        key: Key in the table, with dots, e.g. ``variants.colour``.
        value: A number, numbers, or numbers by name.
        note: Comment after the value; empty keeps that of the file.
    """

    table: str
    key: str
    value: Value
    note: str = ""

    def line(self) -> str:
        """The edit as a line of TOML, without its comment."""
        return f"{self.key} = {_text(self.value)}"


def edited(text: str, edits: Sequence[Edit], where: str) -> str:
    """Returns the text of a TOML file with new values.

    A value is replaced in its line, or added below its table, or a table is added at the end. The
    result is read again: nothing else may have changed.

    Args:
        text: Content of the file.
        edits: New values.
        where: Name of the file, for errors.

    Raises:
        EnvgenError: The file writes a value in another way than as a line ``key = value`` below
            ``[table]``; the message gives the line.
    """
    for edit in edits:
        expected = _with_value(_parsed(text, where), edit)
        text = _replaced(text, edit)
        try:
            done = _parsed(text, where) == expected
        except EnvgenError:
            done = False
        if not done:
            raise EnvgenError(
                f"{where}: cannot change {edit.table}.{edit.key}; write it by hand below "
                f"[{edit.table}]: {edit.line()}"
            )
    return text


def _parsed(text: str, where: str) -> dict[str, Any]:
    try:
        data: dict[str, Any] = msgspec.toml.decode(text)
    except msgspec.DecodeError as error:
        raise EnvgenError(f"{where}: cannot be read as TOML: {error}") from error
    return data


def _with_value(data: dict[str, Any], edit: Edit) -> dict[str, Any]:
    """The content of the file with the new value."""
    result = deepcopy(data)
    inner = result
    *tables, last = [*edit.table.split("."), *edit.key.split(".")]
    for name in tables:
        inner = inner.setdefault(name, {})
    inner[last] = msgspec.toml.decode(f"value = {_text(edit.value)}")["value"]
    return result


def _replaced(text: str, edit: Edit) -> str:
    lines = text.splitlines()
    header = re.compile(rf"\s*\[\s*{_spaced(edit.table)}\s*\]\s*(#.*)?")
    starts = [number for number, line in enumerate(lines) if header.fullmatch(line)]
    if not starts:
        new = ["", f"[{edit.table}]", _with_note(edit, "")]
        return "\n".join([*lines, *new, ""])
    first = starts[0] + 1
    ends = (n for n in range(first, len(lines)) if lines[n].lstrip().startswith("["))
    end = next(ends, len(lines))
    value = re.compile(rf"\s*{_spaced(edit.key)}\s*=[^#]*(#.*)?")
    for number in range(first, end):
        found = value.fullmatch(lines[number])
        if found:
            lines[number] = _with_note(edit, found[1] or "")
            return "\n".join([*lines, ""])
    last = max((n for n in range(first, end) if lines[n].strip()), default=first - 1)
    lines.insert(last + 1, _with_note(edit, ""))
    return "\n".join([*lines, ""])


def _with_note(edit: Edit, comment: str) -> str:
    """The line of an edit; a comment of the file stays, unless an edit wrote it."""
    note = f"{NOTE} {edit.note}" if edit.note else ""
    kept = "" if comment.startswith(NOTE) else comment
    return "  ".join(part for part in (edit.line(), kept or note) if part)


def _spaced(name: str) -> str:
    """A pattern for a dotted key."""
    return r"\s*\.\s*".join(re.escape(part) for part in name.split("."))


def _text(value: Value) -> str:
    if isinstance(value, Mapping):
        pairs = ", ".join(f"{_key(name)} = {_text(item)}" for name, item in value.items())
        return f"{{ {pairs} }}"
    if isinstance(value, Sequence):
        return f"[{', '.join(map(_text, value))}]"
    return str(round(float(value), _DIGITS))


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else f'"{name}"'

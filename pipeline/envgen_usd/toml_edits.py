"""Changes values in the text of a TOML file; comments, order and the other values stay."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import AbstractTable, InlineTable, Item

from envgen_usd.errors import EnvgenError

Value: TypeAlias = float | str | Sequence["Value"] | Mapping[str, "Value"]
NOTE, OTHER_NOTE = "# learned", "# not learned"
"""Begins of the comments that an edit writes, and that a later edit replaces."""
_DIGITS = 4


@dataclass(frozen=True)
class Edit:
    """A new value of a TOML file.

    Attributes:
        table: Name of the table, e.g. ``props.bin``.
        key: Key in the table, with dots, e.g. ``variants.colour``.
        value: A number or text, several of them, or several by name.
        note: Where the value was learned, e.g. ``from town.osm``; empty keeps the file's comment.
        is_learned: False for a value that follows from others; then `note` says why it holds.
    """

    table: str
    key: str
    value: Value
    note: str = ""
    is_learned: bool = True

    def line(self) -> str:
        """The edit as a line of TOML, without its comment."""
        return f"{self.key} = {_item(self.value).as_string()}"

    def comment(self) -> str:
        """The comment of its line in a file."""
        return f"{NOTE} {self.note}" if self.is_learned else f"{OTHER_NOTE}: {self.note}"


def edited(text: str, edits: Sequence[Edit], where: str) -> str:
    """Returns the text of a TOML file with new values.

    Args:
        text: Content of the file.
        edits: New values; missing tables are added.
        where: Name of the file, for errors.

    Raises:
        EnvgenError: The text is not TOML, or has a value in the place of a table.
    """
    try:
        document = tomlkit.parse(text)
    except TOMLKitError as error:
        raise EnvgenError(f"{where}: cannot be read as TOML: {error}") from error
    for edit in edits:
        try:
            _apply(document, edit)
        except (TOMLKitError, AttributeError, TypeError) as error:
            raise EnvgenError(
                f"{where}: cannot change {edit.table}.{edit.key}; write it by hand below "
                f"[{edit.table}]: {edit.line()}"
            ) from error
    return tomlkit.dumps(document)


def _apply(document: tomlkit.TOMLDocument, edit: Edit) -> None:
    """Replaces a value, or adds it below its table."""
    table: Any = document
    names = edit.table.split(".")
    for number, name in enumerate(names):
        if name not in table:
            table.append(name, tomlkit.table(is_super_table=number < len(names) - 1))
        table = table[name]
    *outer, last = edit.key.split(".")
    inner = table
    for name in outer:
        inner = inner.get(name, {})
    before = inner.get(last)
    item = _item(edit.value)
    if isinstance(before, AbstractTable) and not isinstance(before, InlineTable):
        raise TypeError(f"{edit.key} is a table")
    if isinstance(before, Item):
        item.trivia.comment_ws, item.trivia.comment = (
            before.trivia.comment_ws,
            before.trivia.comment,
        )
    if edit.note and not _is_foreign(item.trivia.comment):
        item.trivia.comment_ws, item.trivia.comment = "  ", edit.comment()
    if before is None:
        table.append(tomlkit.key([*outer, last]), item)
    else:
        inner[last] = item


def _is_foreign(comment: str) -> bool:
    """True for a comment that no edit wrote."""
    return bool(comment) and not comment.startswith((NOTE, OTHER_NOTE))


def _item(value: Value) -> Item:
    """A value as a person would write it."""
    if isinstance(value, str):
        return tomlkit.item(value)
    if isinstance(value, Mapping):
        shares = ((tomlkit.key(name).as_string(), share) for name, share in value.items())
        pairs = ", ".join(f"{name} = {_item(share).as_string()}" for name, share in shares)
        return tomlkit.value(f"{{ {pairs} }}")
    if isinstance(value, Sequence):
        return tomlkit.value(f"[{', '.join(_item(part).as_string() for part in value)}]")
    if isinstance(value, int):
        return tomlkit.item(value)
    return tomlkit.item(round(float(value), _DIGITS))

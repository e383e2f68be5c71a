"""Reads TOML files into dataclasses; errors name the mismatch and its place."""

import dataclasses
import math
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from datetime import date, time
from enum import IntEnum
from functools import cache, partial
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import inspect

from envgen_usd.errors import EnvgenError, one_line
from envgen_usd.models.distribution import Quantiles

T = TypeVar("T")


def read_toml(path: Path | Traversable, kind: type[T], **given: object) -> T:
    """Reads a TOML file into a dataclass.

    Field types are numbers, strings, booleans, `Literal`, tuples, mappings, dataclasses, and
    enumerations; files name enumeration members in lower case. A union of dataclasses is told
    apart by their first field, a `Literal`. A field that may be `None` can be left out.

    `Annotated` with `msgspec.Meta` gives bounds of a number and the least length of a mapping.
    Numbers must be finite. A pair of numbers is a range [low, high]. A table of weights has at
    least a single weight above 0.

    Args:
        path: TOML file.
        kind: Dataclass of the file's root.
        given: Fields of the root that the file does not hold.

    Raises:
        EnvgenError: The file cannot be read, or does not match. The message names file, table, key,
            and the expected and the actual value.
    """
    try:
        data = msgspec.toml.decode(path.read_bytes())
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, msgspec.DecodeError) as error:
        raise EnvgenError(f"{path}: cannot be read as TOML: {one_line(error)}") from error
    return typing.cast("T", _table(kind, data, str(path), given))


def is_there(path: Path | Traversable) -> bool:
    """True for a file; a name that no file system takes is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def typed_table(table: object, kind: type[T], where: str) -> T:
    """Converts a table of a file into a dataclass, as `read_toml` does.

    Args:
        table: Content of the file, or a part of it.
        kind: Dataclass of the table.
        where: Name of the file or of the part, for errors.

    Raises:
        EnvgenError: The table does not match.
    """
    return typing.cast("T", _table(kind, table, where))


def _table(
    kind: type, value: object, where: str, given: Mapping[str, object] | None = None
) -> object:
    """Converts a table to a dataclass."""
    given = given or {}
    if not isinstance(value, dict):
        raise _misfit(where, "a table", value)
    fields = {f.name: f for f in dataclasses.fields(kind) if f.name not in given}
    missing = [name for name, f in fields.items() if name not in value and not _has_default(f)]
    unknown = [name for name in value if name not in fields]
    faults = [f"missing {', '.join(missing)}"] if missing else []
    faults += [f"unknown {', '.join(unknown)}; known: {', '.join(fields)}"] if unknown else []
    if faults:
        raise EnvgenError(f"{where}: {'; '.join(faults)}")
    hints = _hints(kind)
    fields_read = {
        name: _converter(hints[name])(item, f"{where}: {name}") for name, item in value.items()
    }
    try:
        return kind(**fields_read, **given)
    except ValueError as error:
        raise EnvgenError(f"{where}: {error}") from error


@cache
def _hints(kind: type) -> dict[str, Any]:
    """Types of a dataclass's fields, with their bounds."""
    return typing.get_type_hints(kind, include_extras=True)


@cache
def _least_length(kind: Any) -> int | None:  # noqa: ANN401 - any annotation
    """The least number of entries of a mapping, if it has one."""
    least: int | None = getattr(inspect.type_info(kind), "min_length", None)
    return least


def _has_default(field: "dataclasses.Field[Any]") -> bool:
    missing = dataclasses.MISSING
    return field.default is not missing or field.default_factory is not missing


@cache
def _converter(kind: Any) -> Callable[[object, str], object]:  # noqa: ANN401 - any annotation
    """What converts a value of a place (its name, for errors) to the annotated type."""
    bare = typing.get_args(kind)[0] if typing.get_origin(kind) is Annotated else kind
    origin = typing.get_origin(bare)
    parts: tuple[Any, ...] = typing.get_args(bare)
    if origin in {types.UnionType, typing.Union}:
        return partial(_union, parts)
    if dataclasses.is_dataclass(bare) and isinstance(bare, type):
        return partial(_table, bare)
    if origin is Mapping:
        return partial(_mapping, kind, bare)
    if origin is tuple and dataclasses.is_dataclass(parts[0]):
        return partial(_tables, typing.cast("type", parts[0]))
    if isinstance(bare, type) and issubclass(bare, IntEnum):
        return partial(_member, bare)
    is_list = origin is tuple and parts[-1] is Ellipsis
    return partial(_list, kind, parts[0]) if is_list else partial(_leaf, kind)


def _member(kind: type[IntEnum], value: object, where: str) -> IntEnum:
    """Converts the name of a member, in lower case."""
    members = {member.name.lower(): member for member in kind}
    if not isinstance(value, str) or value not in members:
        raise _misfit(where, f"one of {', '.join(members)}", value)
    return members[value]


def _union(kinds: Sequence[Any], value: object, where: str) -> object:
    """Converts a distribution, a value that may be `None`, or one of several dataclasses."""
    if Quantiles in kinds:
        return _distribution(kinds[0], value, where)
    known = [kind for kind in kinds if kind is not types.NoneType]
    return _converter(known[0])(value, where) if len(known) == 1 else _variant(known, value, where)


def _distribution(pair: Any, value: object, where: str) -> object:  # noqa: ANN401
    """Converts a range, or a table of quantiles within the bounds of the range."""
    if not isinstance(value, dict):
        return _leaf(pair, value, where)
    table = typing.cast("Quantiles", _table(Quantiles, value, where))
    number = typing.get_args(pair)[0]
    for quantile in table.quantiles:
        _leaf(number, quantile, f"{where}: quantiles")
    return table


def _tables(kind: type, value: object, where: str) -> tuple[object, ...]:
    """Converts an array of tables, or a single table."""
    if isinstance(value, dict):
        return (_table(kind, value, where),)
    rows = value if isinstance(value, list) else [value]
    return tuple(_table(kind, row, f"{where}[{n}]") for n, row in enumerate(rows))


def _variant(kinds: Sequence[type], value: object, where: str) -> object:
    """Converts a table to the dataclass whose first field allows the table's value."""
    tag = dataclasses.fields(kinds[0])[0].name
    known = {name: kind for kind in kinds for name in typing.get_args(_hints(kind)[tag])}
    if not isinstance(value, dict):
        raise _misfit(where, "a table", value)
    if tag not in value:
        raise EnvgenError(f"{where}: missing {tag}; known: {', '.join(known)}")
    if not isinstance(value[tag], str) or value[tag] not in known:
        raise _misfit(f"{where}: {tag}", f"one of {', '.join(known)}", value[tag])
    return _table(known[value[tag]], value, where)


def _mapping(kind: Any, bare: Any, value: object, where: str) -> Mapping[object, object]:  # noqa: ANN401
    if not isinstance(value, dict):
        raise _misfit(where, "a table", value)
    keys, items = typing.get_args(bare)
    mapping, convert = {}, _converter(items)
    for name, item in value.items():
        try:
            key = msgspec.convert(name, keys, strict=False)
        except msgspec.ValidationError:
            known = _expected(keys).removeprefix("one of ")
            raise EnvgenError(f"{where}: unknown {name}; known: {known}") from None
        mapping[key] = convert(item, f"{where}.{name}")
    least = _least_length(kind)
    if least is not None and (len(mapping) < least or not any(mapping.values())):
        raise EnvgenError(f"{where}: expected at least {least} with a weight above 0")
    return mapping


def _list(kind: Any, item: Any, value: object, where: str) -> object:  # noqa: ANN401
    """Converts a list of any length; an error names the item."""
    if not isinstance(value, list):
        raise _misfit(where, _expected(kind), value)
    for number, each in enumerate(value):
        _leaf(item, each, f"{where}[{number}]")
    return _leaf(kind, value, where)


def _leaf(kind: Any, value: object, where: str) -> object:  # noqa: ANN401 - any annotation
    """Converts a number, a string, or a tuple of them."""
    try:
        converted = msgspec.convert(value, kind)
    except msgspec.ValidationError:
        raise _misfit(where, _expected(kind), value) from None
    figures = converted if isinstance(converted, tuple) else (converted,)
    if not all(math.isfinite(figure) for figure in figures if isinstance(figure, float)):
        raise _misfit(where, _expected(kind), value)
    numbers = [figure for figure in figures if not isinstance(figure, str)]
    is_range = isinstance(converted, tuple) and len(numbers) == 2 and not _is_list(kind)
    if is_range and numbers[0] > numbers[1]:
        raise _misfit(where, _expected(kind), value)
    return converted


@cache
def _is_list(kind: Any) -> bool:  # noqa: ANN401 - any annotation
    """True for tuples of any length, e.g. ``tuple[int, ...]``."""
    return isinstance(inspect.type_info(kind), inspect.VarTupleType)


def _misfit(where: str, expected: str, value: object) -> EnvgenError:
    return EnvgenError(f"{where}: expected {expected}, not {_shown(value)}")


def _shown(value: object) -> str:
    """A value as a file has it; a table without its content."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, date | time):
        return value.isoformat()
    return "a table" if isinstance(value, dict) else repr(value)


def _expected(kind: Any) -> str:  # noqa: ANN401 - any annotation
    return _described(inspect.type_info(kind))


def _described(info: inspect.Type) -> str:
    """Description of a type's valid values for the user."""
    match info:
        case inspect.FloatType() | inspect.IntType():
            whole = "whole " if isinstance(info, inspect.IntType) else ""
            return f"a {whole}number{_bounds(info)}"
        case inspect.LiteralType():
            return f"one of {', '.join(map(str, info.values))}"
        case inspect.TupleType():
            return _described_tuple(info.item_types)
        case inspect.VarTupleType():
            most = "" if info.max_length is None else f", at most {info.max_length}"
            return f"a list of {_several(_described(info.item_type))}{most}"
        case inspect.BoolType():
            return "true or false"
    return "a text" if isinstance(info, inspect.StrType) else str(info)


def _several(described: str) -> str:
    """Plural of a description, e.g. of `a whole number from 1 to 5` or `a text`."""
    if not described.startswith("a "):
        return f"items, each {described}"
    bare = described.removeprefix("a ")
    return bare.replace("number", "numbers", 1).replace("text", "texts", 1)


def _described_tuple(items: Sequence[inspect.Type]) -> str:
    several = _several(_described(items[0]))
    return f"a range [low, high] of {several}" if len(items) == 2 else f"{len(items)} {several}"


def _bounds(info: inspect.FloatType | inspect.IntType) -> str:
    low, high = info.ge, info.le
    if low is not None and high is not None:
        return f" from {low:g} to {high:g}"
    return f" of at least {low:g}" if low is not None else ""

"""Base of all models with arrays: short `repr`, comparison by value, read-only arrays."""

from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from typing import Any, get_args, get_origin

import numpy as np

_LONGEST_TEXT = 40
"""Characters of a text in `repr`; longer texts end in an ellipsis."""
_MOST_ITEMS = 3
"""Items of a tuple or mapping in `repr`; of longer containers `repr` gives the number of items."""

_CONTAINERS = frozenset((np.ndarray, tuple, dict))
"""Types of fields that are arrays or may contain some."""
_NOTHING = ()
"""The empty tuple, of which Python has only one."""


class Model:
    """Base of dataclasses with fields that are arrays or contain arrays.

    Declare subclasses with ``@dataclass(frozen=True, repr=False, eq=False)``. Their arrays are
    read-only views; the creator of an array can still write to it.
    """

    def __post_init__(self) -> None:
        """Makes the arrays read-only, also those in tuples and mappings."""
        for name in _holders(type(self)):  # type: ignore[arg-type]  # a class has a hash, too
            value = getattr(self, name)
            if value is not _NOTHING and type(value) in _CONTAINERS:
                frozen = _frozen(value)
                if frozen is not value:
                    object.__setattr__(self, name, frozen)

    def __repr__(self) -> str:
        """Summarises the fields; an array by its type and shape."""
        shown = (f"{field.name}={_short(getattr(self, field.name))}" for field in fields(self))  # type: ignore[arg-type]
        return f"{type(self).__name__}({', '.join(shown)})"

    def __eq__(self, other: object) -> bool:
        """Compares the type and all fields; arrays by shape and values, NaN equal to NaN."""
        if type(other) is not type(self):
            return NotImplemented
        names = [field.name for field in fields(self)]  # type: ignore[arg-type]
        return self is other or all(_equal(getattr(self, n), getattr(other, n)) for n in names)

    def __hash__(self) -> int:
        """Hashes the type and those fields that are texts or numbers."""
        plain = (str, int, float, bool, type(None))
        return hash((type(self), *(v for v in vars(self).values() if isinstance(v, plain))))


@cache
def _holders(kind: type) -> tuple[str, ...]:
    """Returns the names of the fields that are arrays, or may contain some by their type."""
    return tuple(field.name for field in fields(kind) if _may_hold(field.type))


def _may_hold(annotation: Any) -> bool:  # noqa: ANN401 - types of any form
    """Returns whether a value of a type may be or contain an array."""
    if get_origin(annotation) is np.ndarray or annotation in _CONTAINERS:
        return True
    if isinstance(annotation, type) and get_origin(annotation) is None:
        return annotation in (object, Any) or issubclass(annotation, tuple | Mapping)
    inner = get_args(annotation)
    return annotation is not ... and (not inner or any(map(_may_hold, inner)))


def _frozen(value: Any) -> Any:  # noqa: ANN401 - fields of any type
    """Returns the value itself, or an equal value with read-only arrays."""
    if isinstance(value, np.ndarray):
        if not value.flags.writeable:
            return value
        view = value.view()
        view.flags.writeable = False
        return view
    if isinstance(value, tuple) and value and isinstance(value[0], np.ndarray):
        return tuple(_frozen(item) for item in value)
    if isinstance(value, dict) and value:
        items = {key: _frozen(item) for key, item in value.items()}
        return items if any(items[key] is not value[key] for key in items) else value
    return value


def _short(value: Any) -> str:  # noqa: ANN401 - fields of any type
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{list(value.shape)}"
    if isinstance(value, str) and len(value) > _LONGEST_TEXT:
        return repr(value[:_LONGEST_TEXT] + "...")
    if isinstance(value, Model):
        return f"<{type(value).__name__}>"
    if isinstance(value, tuple | list | Mapping):
        kinds = sorted({type(item).__name__ for item in value})
        plain = not isinstance(value, Mapping) and not {"ndarray"} & set(kinds)
        if len(value) <= _MOST_ITEMS and plain:
            inner = ", ".join(_short(item) for item in value)
            return f"({inner})" if isinstance(value, tuple) else f"[{inner}]"
        return f"<{len(value)} {'/'.join(kinds)}>"
    text = repr(value)
    return text if len(text) <= 2 * _LONGEST_TEXT else f"<{type(value).__name__}>"


def _equal(first: Any, second: Any) -> bool:  # noqa: ANN401 - fields of any type
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        return _equal_arrays(np.asarray(first), np.asarray(second))
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        same_keys = first.keys() == second.keys()
        return same_keys and all(_equal(first[key], second[key]) for key in first)
    if isinstance(first, tuple | list) and isinstance(second, tuple | list):
        return len(first) == len(second) and all(map(_equal, first, second))
    return bool(first == second)


def _equal_arrays(first: np.ndarray[Any, Any], second: np.ndarray[Any, Any]) -> bool:
    inexact = all(np.issubdtype(array.dtype, np.inexact) for array in (first, second))
    return np.array_equal(first, second, equal_nan=inexact)

"""Values of attributes: a stage may give an attribute any type, also one that USD does not know."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from envgen_usd.models.array_types import FloatArray, IntArray


class BadValueError(ValueError):
    """An attribute has no value, or one that cannot be used."""


def number(attribute: Usd.Attribute, time: Usd.TimeCode) -> float:
    """The number that an attribute holds at a time.

    Raises:
        BadValueError: It is no finite number.
    """
    return float(numbers(attribute, time, 1)[0])


def numbers(attribute: Usd.Attribute, time: Usd.TimeCode, count: int) -> FloatArray:
    """The `count` numbers that an attribute holds at a time.

    Raises:
        BadValueError: They are not that many, or not finite.
    """
    found = _finite(attribute.Get(time), count)
    if found is None:
        wanted = "a finite number" if count == 1 else f"{count} finite numbers"
        raise BadValueError(f"{attribute.GetName()} is not {wanted}")
    return found


def rows(attribute: Usd.Attribute, time: Usd.TimeCode, width: int) -> FloatArray:
    """The array that an attribute holds at a time, as N x `width`; without rows if it has none.

    Raises:
        BadValueError: Its elements are not `width` numbers each.
    """
    found = _numeric(attribute.Get(time), np.float64)
    if found is None or (found.size and found.shape[-1] != width):
        raise BadValueError(f"{attribute.GetName()} has values of another type")
    return found.reshape(-1, width)


def whole_numbers(attribute: Usd.Attribute, time: Usd.TimeCode) -> IntArray:
    """The whole numbers that an attribute holds at a time: N, none without a value.

    Raises:
        BadValueError: Its elements are no numbers.
    """
    found = _numeric(attribute.Get(time), np.int64)
    if found is None:
        raise BadValueError(f"{attribute.GetName()} has values of another type")
    return found.reshape(-1)


def like(value: Any, default: Any) -> Any:  # noqa: ANN401 - as many types as inputs have
    """A value as what its default is: a number, a tuple of numbers, a text or a truth.

    Args:
        value: What an attribute holds; `None` without a value.
        default: A value of the right type; `None` for any.

    Raises:
        BadValueError: The value is not of that type, or not finite.
    """
    if value is None:
        return default
    if default is None:
        return value
    if isinstance(default, bool | str):
        if isinstance(value, type(default)):
            return value
        raise BadValueError("is not a text" if isinstance(default, str) else "is not true or false")
    count = len(default) if isinstance(default, tuple) else 1
    found = _finite(value, count)
    if found is None:
        raise BadValueError("is not a finite number" if count == 1 else f"is not {count} numbers")
    return tuple(found.tolist()) if isinstance(default, tuple) else float(found[0])


def _finite(value: Any, count: int) -> FloatArray | None:  # noqa: ANN401
    """The value as finite numbers; `None` if it is none."""
    found = None if value is None else _numeric(value, np.float64)
    if found is None or found.size != count or not np.isfinite(found).all():
        return None
    return found.reshape(-1)


def _numeric(value: Any, kind: Any) -> NDArray[Any] | None:  # noqa: ANN401
    """The value as an array of this type, empty without one; `None` if it holds no numbers."""
    if isinstance(value, str):
        return None
    try:
        return np.array(() if value is None else value, kind)
    except (TypeError, ValueError, OverflowError):
        return None

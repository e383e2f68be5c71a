"""Values of attributes: those of JSON, and those that CityGML adds."""

from collections.abc import Mapping
from typing import TypeAlias


class Date(str):
    """A calendar date, ``YYYY-MM-DD``, with an optional time zone as in ``xs:date``."""

    __slots__ = ()


class Uri(str):
    """A resource identifier, as in ``xs:anyURI``."""

    __slots__ = ()


class Code(str):
    """A code of a code list.

    Attributes:
        space: URI of the code list; empty if unknown.
    """

    space: str

    def __new__(cls, value: str, space: str = "") -> "Code":
        """Creates the code of a list."""
        code = super().__new__(cls, value)
        code.space = space
        return code

    def __getnewargs__(self) -> tuple[str, str]:  # type: ignore[override]
        """Arguments with which a copy is created."""
        return str(self), self.space

    def __repr__(self) -> str:
        """Returns the code and its list."""
        return f"Code({str(self)!r}, {self.space!r})"


class Measure(float):
    """A number with a unit.

    Attributes:
        unit: Symbol or URI of the unit, e.g. ``m``.
    """

    unit: str

    def __new__(cls, value: float, unit: str = "") -> "Measure":
        """Creates the number of a unit."""
        measure = super().__new__(cls, value)
        measure.unit = unit
        return measure

    def __getnewargs__(self) -> tuple[float, str]:  # type: ignore[override]
        """Arguments with which a copy is created."""
        return float(self), self.unit

    def __repr__(self) -> str:
        """Returns the number and its unit."""
        return f"Measure({float(self)!r}, {self.unit!r})"


Attribute: TypeAlias = (
    "str | bool | int | float | tuple[Attribute, ...] | Mapping[str, Attribute] | None"
)
"""A value: `Date`, `Uri` and `Code` are texts, `Measure` is a number.

A tuple is a list; a mapping is a set of attributes; `None` is a known attribute without value.
"""


def as_number(value: Attribute, instead: float = 0.0) -> float:
    """Returns an attribute as a number; other values give the substitute."""
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            return instead
    return float(value) if isinstance(value, int | float) else instead

"""Attributes of CityJSON: any JSON value, with measures and codes as objects of two members.

Texts that are dates or URIs are typed as such, because CityGML distinguishes them.
"""

import datetime
import math
import re
from collections.abc import Mapping
from typing import Any

from envgen_usd.models.attribute_values import Attribute, Code, Date, Measure, Uri

_DATE = re.compile(r"\d{4}-\d\d-\d\d")
_URI = re.compile(r"[a-zA-Z][a-zA-Z0-9+.-]*://[\w.~:/?#@!$&'()*+,;=%-]+", re.ASCII)
# A symbol of a unit, as in gml:UomIdentifier.
_UNIT = re.compile(r"[^: \n\r\t]+")


def read_attributes(values: Mapping[str, Any]) -> dict[str, Attribute]:
    """Returns the attributes of a JSON object by name."""
    return {name: _read(value) for name, value in values.items()}


def _read(value: Any) -> Attribute:  # noqa: ANN401 - any JSON value
    if isinstance(value, list):
        return tuple(map(_read, value))
    if isinstance(value, dict):
        return _read_object(value)
    if isinstance(value, str):
        return _read_text(value)
    return value if isinstance(value, int | float) else None


def _read_object(value: dict[str, Any]) -> Attribute:
    number, unit = value.get("value"), value.get("uom")
    is_number = isinstance(number, int | float) and not isinstance(number, bool)
    is_unit = isinstance(unit, str) and _UNIT.fullmatch(unit) is not None
    if len(value) == 2 and is_number and is_unit:
        return Measure(float(value["value"]), value["uom"])
    if value.keys() == {"value", "codeSpace"} and all(isinstance(v, str) for v in value.values()):
        return Code(value["value"], value["codeSpace"])
    return read_attributes(value)


def _read_text(text: str) -> str:
    if _URI.fullmatch(text):
        return Uri(text)
    try:
        is_date = _DATE.fullmatch(text) and datetime.date.fromisoformat(text)
    except ValueError:
        return text
    return Date(text) if is_date else text


def attributes_json(attributes: Mapping[str, Attribute]) -> dict[str, Any]:
    """Returns attributes as a JSON object; JSON lacks non-finite numbers, which are left out."""
    return {
        name: _json(value)
        for name, value in attributes.items()
        if not isinstance(value, float) or math.isfinite(value)
    }


def _json(value: Attribute) -> Any:  # noqa: ANN401 - any JSON value
    if isinstance(value, Measure):
        return {"value": float(value), "uom": value.unit}
    if isinstance(value, Code) and value.space:
        return {"value": str(value), "codeSpace": value.space}
    if isinstance(value, tuple):
        return [_json(item) for item in value]
    if isinstance(value, Mapping):
        return attributes_json(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value

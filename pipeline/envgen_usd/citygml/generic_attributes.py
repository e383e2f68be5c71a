"""Generic attributes of CityGML, written in 3.0 and 2.0, and read.

CityGML has neither booleans nor nulls, and no lists of lists. They are codes of JSON in 3.0, and
JSON text in 2.0. A list of several values is a repeated attribute.
"""

import datetime
import json
import math
import re
from collections import defaultdict
from collections.abc import Callable, Mapping
from xml.sax.saxutils import escape, quoteattr

from lxml import etree

from envgen_usd.models.attribute_values import Attribute, Code, Date, Measure, Uri
from envgen_usd.xml_events import local_name

_JSON = "https://www.iana.org/assignments/media-types/application/json"
# Types xs:date and gml:UomIdentifier.
_DATE = re.compile(r"(\d{4}-\d\d-\d\d)(Z|[+-](0\d|1[0-3]):[0-5]\d|[+-]14:00)?")
_UNIT = re.compile(r"[^: \n\r\t]+|([a-zA-Z][\w\-+.]*:|\.\.?/|#)\S*")
_NOT_IN_XML = {code: "\ufffd" for code in range(32) if chr(code) not in "\t\n\r"}


def xml_text(value: str) -> str:
    """Returns text as content of an element; characters that XML lacks become U+FFFD."""
    # XML parsers turn a carriage return into a line feed.
    return escape(value.translate(_NOT_IN_XML), {"\r": "&#13;"})


def double_text(value: float) -> str:
    """Returns a number as ``xs:double``, without loss."""
    if math.isfinite(value):
        return repr(float(value))
    return "NaN" if math.isnan(value) else ("INF" if value > 0 else "-INF")


def generic_text(name: str, value: Attribute, *, old: bool = False) -> str:
    """Returns an attribute as elements of a feature.

    Args:
        name: Name of the attribute.
        value: Any value.
        old: True for CityGML 2.0, false for 3.0.
    """
    texts = _elements(name, value, old)
    return "".join(texts if old else (f"<genericAttribute>{t}</genericAttribute>" for t in texts))


def _elements(name: str, value: Attribute, old: bool) -> list[str]:
    if isinstance(value, Mapping) and value:
        parts = [part for key, item in value.items() for part in _elements(key, item, old)]
        return [_set(name, parts, old)]
    if isinstance(value, tuple) and len(value) > 1 and not _has_list(value):
        return [part for item in value for part in _elements(name, item, old)]
    return [_element(name, value, old)]


def _has_list(values: tuple[Attribute, ...]) -> bool:
    return any(isinstance(value, tuple) for value in values)


def _element(name: str, value: Attribute, old: bool) -> str:
    kind, text, label = _typed(value)
    if old:
        # 2.0 has no attribute for codes.
        tag = "stringAttribute" if kind == "Code" else f"{kind.lower()}Attribute"
        unit = label if kind == "Measure" else ""
        title = f" name={quoteattr(name.translate(_NOT_IN_XML))}"
        return f"<gen:{tag}{title}><gen:value{unit}>{text}</gen:value></gen:{tag}>"
    tag = f"gen:{kind}Attribute"
    return (
        f"<{tag}><gen:name>{xml_text(name)}</gen:name><gen:value{label}>{text}</gen:value></{tag}>"
    )


def _typed(value: Attribute) -> tuple[str, str, str]:
    """Type of a single value, its text, and the attributes of its element."""
    if isinstance(value, Code):
        space = f" codeSpace={quoteattr(value.space)}" if value.space else ""
        return "Code", xml_text(value), space
    if isinstance(value, str):
        dated = isinstance(value, Date) and is_date(value)
        kind = "Date" if dated else "Uri" if isinstance(value, Uri) else "String"
        return kind, xml_text(value), ""
    if isinstance(value, float):
        measured = isinstance(value, Measure) and is_unit(value.unit)
        unit = f" uom={quoteattr(value.unit)}" if isinstance(value, Measure) and measured else ""
        return "Measure" if measured else "Double", double_text(value), unit
    if isinstance(value, int) and not isinstance(value, bool):
        return "Int", str(value), ""
    return "Code", xml_text(json.dumps(value)), f' codeSpace="{_JSON}"'


def _set(name: str, parts: list[str], old: bool) -> str:
    if old:
        title = quoteattr(name.translate(_NOT_IN_XML))
        return f"<gen:genericAttributeSet name={title}>{''.join(parts)}</gen:genericAttributeSet>"
    members = "".join(f"<gen:genericAttribute>{part}</gen:genericAttribute>" for part in parts)
    return (
        f"<gen:GenericAttributeSet><gen:name>{xml_text(name)}</gen:name>{members}"
        "</gen:GenericAttributeSet>"
    )


def is_date(text: str) -> bool:
    """True for ``YYYY-MM-DD`` of a day that exists, with or without a time zone."""
    match = _DATE.fullmatch(text)
    try:
        return match is not None and bool(datetime.date.fromisoformat(match[1]))
    except ValueError:
        return False


def is_unit(text: str) -> bool:
    """True for a symbol or URI of a unit, as in ``gml:UomIdentifier``."""
    return _UNIT.fullmatch(text) is not None


def read_generics(owner: etree._Element, faults: list[str]) -> dict[str, Attribute]:
    """Returns the generic attributes of a feature in the form of CityGML 3.0, by name.

    A value that is not of the type of its element stays a text.

    Args:
        owner: Feature, surface or ``GenericAttributeSet``.
        faults: Collects what is wrong with such values.
    """
    values: dict[str, list[Attribute]] = defaultdict(list)
    for holder in owner.iterchildren("{*}genericAttribute"):
        for element in holder.iterchildren(etree.Element):
            name = element.findtext("{*}name")
            if name is not None:
                values[name] += _read(element, faults)
    return {
        name: tuple(each) if len(each) > 1 else each[0] for name, each in values.items() if each
    }


def _read(element: etree._Element, faults: list[str]) -> list[Attribute]:
    kind = local_name(element).removesuffix("Attribute")
    if kind == "GenericAttributeSet":
        return [read_generics(element, faults)]
    value = element.find("{*}value")
    if value is None:
        return []
    text = value.text or ""
    try:
        return [_READERS.get(kind, _read_text)(text, value)]
    except ValueError:
        faults.append(f"'{text}' is no value of a {local_name(element)}")
        return [text]


def _read_text(text: str, _: etree._Element) -> Attribute:
    return text


def _read_code(text: str, element: etree._Element) -> Attribute:
    space = element.get("codeSpace", "")
    return _of_json(json.loads(text)) if space == _JSON else Code(text, space)


def _of_json(value: object) -> Attribute:
    if isinstance(value, list):
        return tuple(map(_of_json, value))
    if isinstance(value, dict):
        return {str(key): _of_json(item) for key, item in value.items()}
    return value if isinstance(value, str | int | float) else None


_READERS: dict[str, Callable[[str, etree._Element], Attribute]] = {
    "Int": lambda text, _: int(text),
    "Double": lambda text, _: float(text),
    "Measure": lambda text, element: Measure(float(text), element.get("uom", "")),
    "Date": lambda text, _: Date(text.strip()),
    "Uri": lambda text, _: Uri(text.strip()),
    "Code": _read_code,
}

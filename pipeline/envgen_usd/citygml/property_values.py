"""Values of the specific properties of CityGML classes, as text and read."""

from typing import TypeGuard

from lxml import etree

from envgen_usd.citygml.feature_properties import ENUMERATIONS, Attr, Type
from envgen_usd.citygml.generic_attributes import double_text, is_date, is_unit, xml_text
from envgen_usd.models.attribute_values import Attribute, Date, Measure, as_number

_SEVERAL = frozenset({"function", "usage"})
_METRES = frozenset({"m", "#m", "urn:ogc:def:uom:UCUM::m", "urn:adv:uom:m"})


def property_texts(attr: Attr, value: Attribute) -> tuple[str, ...]:
    """Returns the text of each element of a property; none if the value does not suit its type.

    Writers turn a value that does not suit into a generic attribute.
    """
    if attr.type is Type.CODE:
        return _codes(value, attr.name in _SEVERAL)
    if attr.type is Type.LENGTHS:
        return _lengths(value)
    if isinstance(value, bool):
        return (str(value).lower(),) if attr.type is Type.BOOLEAN else ()
    if isinstance(value, str):
        return (value,) if _is_of(attr, value) else ()
    if attr.type is Type.INT:
        return (str(value),) if isinstance(value, int) and value >= 0 else ()
    is_length = attr.type in (Type.LENGTH, Type.HEIGHT) and isinstance(value, int | float)
    return (double_text(as_number(value)),) if is_length else ()


def _is_of(attr: Attr, text: str) -> bool:
    if attr.type is Type.ENUMERATION:
        return text in ENUMERATIONS[attr.name]
    return attr.type is Type.DATE and is_date(text)


def _codes(value: Attribute, several: bool) -> tuple[str, ...]:
    if isinstance(value, str):
        return tuple(map(xml_text, value.split(";") if several else [value]))
    if isinstance(value, tuple) and several:
        return tuple(xml_text(str(each)) for each in value if isinstance(each, str))
    return (str(value),) if isinstance(value, int) and not isinstance(value, bool) else ()


def _lengths(value: Attribute) -> tuple[str, ...]:
    if not isinstance(value, tuple) or not value:
        return ()
    texts = [double_text(float(each)) for each in value if _is_number(each)]
    return (" ".join(texts),) if len(texts) == len(value) and _is_of_a_unit(value) else ()


def _is_number(value: Attribute) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_of_a_unit(values: tuple[Attribute, ...]) -> bool:
    return len({unit_of(value) for value in values}) == 1


def unit_of(value: Attribute) -> str:
    """Returns the unit of lengths, metres unless the value names another."""
    if isinstance(value, tuple) and value:
        return unit_of(value[0])
    return value.unit if isinstance(value, Measure) and is_unit(value.unit) else "m"


def read_property(
    element: etree._Element, attr: Attr, attributes: dict[str, Attribute], faults: list[str]
) -> None:
    """Adds a property to attributes; a value that is not of its type stays a text.

    Args:
        element: The property.
        attr: Its name and type.
        attributes: Attributes read so far.
        faults: Collects what is wrong with such values.
    """
    holder = element.find(".//{*}value") if attr.type is Type.HEIGHT else element
    if holder is None:
        return
    text = holder.text or ""
    try:
        value = _value(text, holder, attr.type)
    except ValueError:
        faults.append(f"'{text}' is no value of {attr.name}")
        value = text
    if attr.name in attributes and attr.type is Type.CODE:
        value = f"{attributes[attr.name]};{text}"
    attributes[attr.name] = value


def _value(text: str, element: etree._Element, kind: Type) -> Attribute:
    if kind is Type.BOOLEAN:
        return _BOOLEANS.get(text.strip(), text)
    if kind is Type.DATE:
        return Date(text.strip())
    if kind is Type.INT:
        return int(text)
    if kind in (Type.LENGTH, Type.HEIGHT):
        return _length(text, element)
    if kind is Type.LENGTHS:
        return tuple(_length(part, element) for part in text.split())
    return text


def _length(text: str, element: etree._Element) -> float:
    unit = element.get("uom", "m")
    return float(text) if unit in _METRES else Measure(float(text), unit)


_BOOLEANS = {"true": True, "1": True, "false": False, "0": False}

"""Reads objects, object references, tunnels and bridges of a road (chapter 13)."""

from envgen_usd.errors import Severity
from envgen_usd.models.road_objects import RoadObject
from envgen_usd.opendrive.document.findings import Element, Findings, line_of
from envgen_usd.opendrive.document.number_attributes import number, size
from envgen_usd.opendrive.elements.kept_elements import leftovers, others
from envgen_usd.opendrive.elements.outline_element import read_outlines
from envgen_usd.opendrive.elements.repeat_element import read_repeats

OBJECT_TAGS = ("object", "objectReference", "tunnel", "bridge")
"""Tags of elements that describe an object of a road."""
_KNOWN = frozenset({"repeat", "outline"})
_POSE = ("s", "t", "zOffset", "hdg", "pitch", "roll")
_SIZE = ("length", "width", "height", "radius")
_ATTRIBUTES = frozenset({"id", "type", "subtype", "name", "orientation", *_POSE, *_SIZE})
_REFERENCE = "objectReference"


def read_objects(road: Element, findings: Findings) -> tuple[RoadObject, ...]:
    """Reads all objects of a road, in the file's order."""
    objects = []
    for group in road.iterchildren("objects"):
        objects += [
            _object(element, findings) for element in list(group.iterchildren(*OBJECT_TAGS))
        ]
    return tuple(objects)


def _object(element: Element, findings: Findings) -> RoadObject:
    get = element.get
    if get("zOffset") is None and get("zoffset") is not None:
        text = "zoffset is used for zOffset"
        findings.repaired("attribute.renamed", element, text, "renamed", Severity.INFO)
        element.set("zOffset", str(element.attrib.pop("zoffset")))
    tag = str(element.tag)
    s, t, z_offset, heading, pitch, roll = (number(element, name, findings) for name in _POSE)
    length, width, height, radius = (size(element, name, findings) for name in _SIZE)
    structure = tag in {"tunnel", "bridge"}
    return RoadObject(
        get("id", ""),
        tag if structure else get("type", "none"),
        get("type", "") if structure else get("subtype", ""),
        get("name", ""),
        s,
        t,
        z_offset,
        heading,
        pitch,
        roll,
        get("orientation", "none"),
        length,
        width,
        height,
        radius,
        read_outlines(element, findings),
        read_repeats(element, findings),
        (*leftovers(element, _ATTRIBUTES), *others(element, _KNOWN)),
        line_of(element),
        get("id", "") if tag == _REFERENCE else "",
    )

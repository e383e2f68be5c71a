"""Objects, object references, tunnels and bridges of a road (chapter 13)."""

from envgen_usd.errors import Severity
from envgen_usd.models.road_objects import RoadObject
from envgen_usd.opendrive.elements.numbers import number
from envgen_usd.opendrive.elements.outlines import read_outlines
from envgen_usd.opendrive.elements.records import leftovers, others
from envgen_usd.opendrive.elements.repeats import read_repeats
from envgen_usd.opendrive.findings import Element, Findings, line_of

OBJECT_TAGS = ("object", "objectReference", "tunnel", "bridge")
"""Elements that are objects of a road."""
_KNOWN = frozenset({"repeat", "outline"})
_POSE = ("s", "t", "zOffset", "hdg", "pitch", "roll")
_SIZE = ("length", "width", "height", "radius")
_ATTRIBUTES = frozenset({"id", "type", "subtype", "name", "orientation", *_POSE, *_SIZE})
_REFERENCE = "objectReference"


def read_objects(road: Element, findings: Findings) -> tuple[RoadObject, ...]:
    """All objects of a road, in the file's order."""
    found = []
    for group in road.iterchildren("objects"):
        found += [_object(element, findings) for element in list(group.iterchildren(*OBJECT_TAGS))]
    return tuple(found)


def _object(element: Element, findings: Findings) -> RoadObject:
    get = element.get
    if get("zOffset") is None and get("zoffset") is not None:
        text = "zoffset stands for zOffset"
        findings.mended("attribute.renamed", element, text, "renamed", Severity.INFO)
        element.set("zOffset", str(element.attrib.pop("zoffset")))
    tag = str(element.tag)
    s, t, z_offset, heading, pitch, roll = (number(element, name, findings) for name in _POSE)
    length, width, height, radius = (_size(element, name, findings) for name in _SIZE)
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


def _size(element: Element, name: str, findings: Findings) -> float:
    size = number(element, name, findings)
    if size < 0:
        findings.mended("object.negative_size", element, f"{name}={size:g}", "taken as not given")
        del element.attrib[name]
    return max(size, 0.0)

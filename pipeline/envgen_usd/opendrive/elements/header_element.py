"""Reads the header (8.5)."""

from dataclasses import dataclass

from envgen_usd.errors import Severity
from envgen_usd.opendrive.document.findings import Element, Findings
from envgen_usd.opendrive.document.number_attributes import number


@dataclass(frozen=True)
class Header:
    """Content of the header.

    Attributes:
        revision: Declared revision, e.g. ``1.4``; empty without a declaration.
        geo_reference: PROJ string or WKT; empty without a geoReference.
        offset: x, y, z in metres and heading in radians.
    """

    revision: str = ""
    geo_reference: str = ""
    offset: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


def read_header(root: Element, findings: Findings) -> Header:
    """Reads the header; a file without a header gets default values."""
    header = root.find("header")
    if header is None:
        text = "the header is missing"
        findings.repaired("header.missing", root, text, "added an empty header", Severity.INFO)
        root.insert(0, root.makeelement("header", {"revMajor": "1", "revMinor": "4"}))
        return Header()
    major, minor = header.get("revMajor", ""), header.get("revMinor", "")
    if not (major.isdigit() and minor.isdigit()):
        text = f"revision {major or '?'}.{minor or '?'}"
        findings.noted("header.revision", header, text, Severity.INFO)
    return Header(
        f"{major}.{minor}" if major or minor else "",
        _geo_reference(header),
        _offset(header, findings),
    )


def _geo_reference(header: Element) -> str:
    element = header.find("geoReference")
    return "" if element is None else "".join(str(text) for text in element.itertext()).strip()


def _offset(header: Element, findings: Findings) -> tuple[float, float, float, float]:
    element = header.find("offset")
    if element is None:
        return 0.0, 0.0, 0.0, 0.0
    x, y, z, heading = (number(element, name, findings) for name in ("x", "y", "z", "hdg"))
    return x, y, z, heading

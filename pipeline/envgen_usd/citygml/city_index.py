"""An index of many CityGML files: a city model with references to the features of the chunks."""

import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from lxml import etree

from envgen_usd.citygml.feature_properties import NAMESPACES
from envgen_usd.citygml.gml_geometry_read import local_name
from envgen_usd.citygml.xml_stream import other_file, stream_members
from envgen_usd.whole_files import whole_file

_GML_ID = f"{{{NAMESPACES['gml']}}}id"
_TITLE = f"{{{NAMESPACES['xlink']}}}title"
_HREF = f"{{{NAMESPACES['xlink']}}}href"
_HEADER = ("metaDataProperty", "Envelope")


@dataclass
class _Header:
    """Header data of the files.

    Attributes:
        metadata: By title, from the first file.
        srs_name: srsName of the envelopes.
        corners: Corners of the envelopes.
    """

    metadata: dict[str, str] = field(default_factory=dict)
    srs_name: str = ""
    corners: list[list[float]] = field(default_factory=list)


def write_index(files: Sequence[Path], path: Path) -> None:
    """Writes a CityGML 3.0 file that refers to the top-level features of other files.

    Each feature becomes a ``cityObjectMember`` with a relative xlink, so that the folder can be
    moved. Files are streamed, so memory does not grow with their number. `read_city` follows the
    index.

    Args:
        files: CityGML 3.0 files of a map, in the order of the index.
        path: Index to write; it is written whole or not at all.

    Raises:
        EnvgenError: A file cannot be read or is not XML, or the index cannot be written.
    """
    header = _Header()
    with (
        whole_file(path) as part,
        part.open("w", encoding="utf-8") as index,
        tempfile.TemporaryFile("w+", encoding="utf-8", dir=part.parent) as body,
    ):
        for file in files:
            place = Path(os.path.relpath(file, path.parent)).as_posix()
            for gml_id in _top_level_ids(file, header):
                href = quoteattr(f"{place}#{gml_id}")
                body.write(f"<cityObjectMember xlink:href={href}/>\n")
        index.write(_header_text(header))
        body.seek(0)
        index.writelines(body)
        index.write("</CityModel>\n")


def member_files(path: Path) -> tuple[Path, ...]:
    """Other files with members of a city model, each listed once.

    Raises:
        EnvgenError: The file cannot be read or is not XML, or names a file outside of its folder.
    """
    names = dict[str, None]()
    for member in stream_members(path):
        names[member.get(_HREF, "").partition("#")[0]] = None
    files = (other_file(path, name) for name in names if name and "://" not in name)
    return tuple(file for file in files if file.is_file())


def _top_level_ids(file: Path, header: _Header) -> Iterator[str]:
    for element in stream_members(file, *_HEADER):
        if local_name(element) in _HEADER:
            _note(element, header)
        elif local_name(element) == "cityObjectMember":
            yield from (child.get(_GML_ID, "") for child in element)


def _note(element: etree._Element, header: _Header) -> None:
    if local_name(element) == "metaDataProperty":
        text = "".join(map(str, element.itertext()))
        header.metadata.setdefault(element.get(_TITLE, ""), text)
    else:
        header.srs_name = header.srs_name or element.get("srsName", "")
        header.corners += [[float(n) for n in (corner.text or "").split()] for corner in element]


def _header_text(header: _Header) -> str:
    uris = " ".join(
        f'xmlns{f":{prefix}" if prefix != "core" else ""}="{NAMESPACES[prefix]}"'
        for prefix in ("core", "gml", "xlink")
    )
    metadata = "".join(
        f"<gml:metaDataProperty xlink:title={quoteattr(title)}><gml:GenericMetaData>{escape(text)}"
        "</gml:GenericMetaData></gml:metaDataProperty>\n"
        for title, text in header.metadata.items()
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<CityModel {uris}>\n{metadata}{_bounds(header)}'
    )


def _bounds(header: _Header) -> str:
    if not header.corners:
        return ""
    corners = np.array(header.corners)
    srs = f" srsName={quoteattr(header.srs_name)}" if header.srs_name else ""
    low, high = (
        " ".join(f"{value:.3f}" for value in corner)
        for corner in (corners.min(axis=0), corners.max(axis=0))
    )
    return (
        f'<gml:boundedBy><gml:Envelope{srs} srsDimension="3"><gml:lowerCorner>{low}'
        f"</gml:lowerCorner><gml:upperCorner>{high}</gml:upperCorner></gml:Envelope>"
        "</gml:boundedBy>\n"
    )

"""An index of many CityGML files: a city model with references to the features of the chunks."""

import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from envgen_usd.citygml.feature_properties import NAMESPACES
from envgen_usd.citygml.xml_stream import other_file, stream_members
from envgen_usd.whole_files import whole_file
from envgen_usd.xml_events import local_name

_GML_ID = f"{{{NAMESPACES['gml']}}}id"
_TITLE = f"{{{NAMESPACES['xlink']}}}title"
_HREF = f"{{{NAMESPACES['xlink']}}}href"
_IN_QUOTES = {'"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
_HEADER = ("metaDataProperty", "Envelope")


@dataclass(frozen=True)
class IndexEntry:
    """What an index says of a file.

    Attributes:
        metadata: By title.
        srs_name: srsName of the envelopes.
        corners: Corners of the envelopes.
        ids: gml:ids of the top-level features, in the order of the file.
    """

    metadata: Mapping[str, str]
    srs_name: str
    corners: Sequence[Sequence[float]]
    ids: Sequence[str]


def read_entry(path: Path, known: Sequence[str] | None = None) -> IndexEntry:
    """Reads what an index says of a CityGML 3.0 file; the file is streamed.

    Args:
        path: The file.
        known: gml:ids of its top-level features, where the caller has them: then only what stands
            before the first feature is read.

    Raises:
        EnvgenError: The file cannot be read or is not XML.
    """
    metadata: dict[str, str] = {}
    names: list[str] = []
    corners: list[list[float]] = []
    ids: list[str] = []
    for element in stream_members(path, *_HEADER):
        name = local_name(element)
        if name == "metaDataProperty":
            text = "".join(map(str, element.itertext()))
            metadata.setdefault(element.get(_TITLE, ""), text)
        elif name == "Envelope":
            names.append(element.get("srsName", ""))
            corners += [[float(n) for n in (corner.text or "").split()] for corner in element]
        elif name == "cityObjectMember" and known is not None:
            break
        elif name == "cityObjectMember":
            ids += [child.get(_GML_ID, "") for child in element]
    found = ids if known is None else list(known)
    return IndexEntry(metadata, next(filter(None, names), ""), corners, found)


def write_index(
    files: Sequence[Path], path: Path, read: Callable[[Path], IndexEntry] = read_entry
) -> None:
    """Writes a CityGML 3.0 file that refers to the top-level features of other files.

    Each feature becomes a ``cityObjectMember`` with a relative xlink, so that the folder can be
    moved. Files are read one by one, so memory does not grow with their number. `read_city` follows
    the index.

    Args:
        files: CityGML 3.0 files of a map, in the order of the index.
        path: Index to write; it is written whole or not at all.
        read: Tells what the index says of a file.

    Raises:
        EnvgenError: A file cannot be read or is not XML, or the index cannot be written.
    """
    metadata: dict[str, str] = {}
    srs_name = ""
    corners: list[Sequence[float]] = []
    with (
        whole_file(path) as part,
        part.open("w", encoding="utf-8") as index,
        tempfile.TemporaryFile("w+", encoding="utf-8", dir=part.parent) as body,
    ):
        for file in files:
            entry = read(file)
            for title, text in entry.metadata.items():
                metadata.setdefault(title, text)
            srs_name = srs_name or entry.srs_name
            corners += entry.corners
            body.write(_members(Path(os.path.relpath(file, path.parent)).as_posix(), entry.ids))
        index.write(_header_text(metadata, srs_name, corners))
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


def _members(place: str, ids: Sequence[str]) -> str:
    """References to the features of a file."""
    hrefs = "\0".join(f"{place}#{gml_id}" for gml_id in ids)
    # All at once, since a town has a thousand in each chunk; XML has no zero byte.
    escaped = escape(hrefs, _IN_QUOTES).split("\0") if ids else []
    return "".join(f'<cityObjectMember xlink:href="{href}"/>\n' for href in escaped)


def _header_text(
    metadata: Mapping[str, str], srs_name: str, corners: Sequence[Sequence[float]]
) -> str:
    uris = " ".join(
        f'xmlns{f":{prefix}" if prefix != "core" else ""}="{NAMESPACES[prefix]}"'
        for prefix in ("core", "gml", "xlink")
    )
    properties = "".join(
        f"<gml:metaDataProperty xlink:title={quoteattr(title)}><gml:GenericMetaData>{escape(text)}"
        "</gml:GenericMetaData></gml:metaDataProperty>\n"
        for title, text in metadata.items()
    )
    envelope = _envelope(srs_name, corners) if corners else ""
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<CityModel {uris}>\n{properties}{envelope}'


def _envelope(srs_name: str, corners: Sequence[Sequence[float]]) -> str:
    places = np.array(corners)
    bounds = places.min(axis=0), places.max(axis=0)
    srs = f" srsName={quoteattr(srs_name)}" if srs_name else ""
    low, high = (" ".join(f"{value:.3f}" for value in corner) for corner in bounds)
    return (
        f'<gml:boundedBy><gml:Envelope{srs} srsDimension="3"><gml:lowerCorner>{low}'
        f"</gml:lowerCorner><gml:upperCorner>{high}</gml:upperCorner></gml:Envelope>"
        "</gml:boundedBy>\n"
    )

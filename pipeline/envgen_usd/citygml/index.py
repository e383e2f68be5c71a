"""An index of many CityGML files: a city model whose members lie in the files of the chunks."""

import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from lxml import etree

from envgen_usd.citygml.geometry_read import local_name
from envgen_usd.citygml.schema import NAMESPACES
from envgen_usd.errors import EnvgenError

_GML_ID = f"{{{NAMESPACES['gml']}}}id"
_TITLE = f"{{{NAMESPACES['xlink']}}}title"
_HEADER = ("metaDataProperty", "Envelope")


@dataclass
class _Header:
    """What files say of themselves.

    Attributes:
        metadata: By title; that of the first file.
        srs_name: Of the envelopes.
        corners: Of the envelopes.
    """

    metadata: dict[str, str] = field(default_factory=dict)
    srs_name: str = ""
    corners: list[list[float]] = field(default_factory=list)


def write_index(files: Sequence[Path], path: Path) -> None:
    """Writes a CityGML 3.0 file that refers to the top-level features of other files.

    Features stay where they are; each is a ``cityObjectMember`` with an xlink relative to the
    index, so that the folder can be moved as a whole. The files are read one after the other and
    never held in memory. `read_city` follows the index.

    Args:
        files: CityGML 3.0 files of one map, in the order in which they are to be listed.
        path: Index to write; it appears only when it is complete.

    Raises:
        EnvgenError: A file cannot be read, or is no XML.
    """
    header = _Header()
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with (
            os.fdopen(handle, "w", encoding="utf-8") as index,
            tempfile.TemporaryFile("w+") as body,
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
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _top_level_ids(file: Path, header: _Header) -> Iterator[str]:
    try:
        with file.open("rb") as stream:
            events = etree.iterparse(
                stream,
                events=("end",),
                tag=tuple(f"{{*}}{name}" for name in ("cityObjectMember", *_HEADER)),
                resolve_entities=False,
                no_network=True,
            )
            for _, element in events:
                parent = element.getparent()
                if local_name(element) in _HEADER:
                    _note(element, header)
                elif parent is not None and local_name(parent) == "CityModel":
                    yield from (child.get(_GML_ID, "") for child in element)
                    element.clear()
    except OSError as error:
        raise EnvgenError(f"{file}: cannot be read: {error.strerror or error}") from error
    except etree.XMLSyntaxError as error:
        raise EnvgenError(f"{file}: is not well-formed XML: {error}") from error


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

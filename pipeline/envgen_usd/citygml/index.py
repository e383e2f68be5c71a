"""An index of many CityGML files: a city model whose members lie in the files of the chunks."""

import os
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

from lxml import etree

from envgen_usd.citygml.geometry_read import local_name
from envgen_usd.citygml.schema import NAMESPACES
from envgen_usd.errors import EnvgenError

_GML_ID = f"{{{NAMESPACES['gml']}}}id"


def write_index(files: Sequence[Path], path: Path) -> None:
    """Writes a CityGML 3.0 file that refers to the top-level features of other files.

    Features stay where they are; each is a ``cityObjectMember`` with an xlink relative to the
    index, so that the folder can be moved as a whole. The files are read one after the other and
    never held in memory.

    Args:
        files: CityGML 3.0 files, in the order in which they are to be listed.
        path: Index to write; it appears only when it is complete.

    Raises:
        EnvgenError: A file cannot be read, or is no XML.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as index:
            uris = f'xmlns="{NAMESPACES["core"]}" xmlns:xlink="{NAMESPACES["xlink"]}"'
            index.write(f'<?xml version="1.0" encoding="UTF-8"?>\n<CityModel {uris}>\n')
            for file in files:
                place = Path(os.path.relpath(file, path.parent)).as_posix()
                for gml_id in _top_level_ids(file):
                    href = quoteattr(f"{place}#{gml_id}")
                    index.write(f"<cityObjectMember xlink:href={href}/>\n")
            index.write("</CityModel>\n")
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _top_level_ids(file: Path) -> Iterator[str]:
    try:
        with file.open("rb") as stream:
            events = etree.iterparse(
                stream,
                events=("end",),
                tag="{*}cityObjectMember",
                resolve_entities=False,
                no_network=True,
            )
            for _, member in events:
                parent = member.getparent()
                if parent is not None and local_name(parent) == "CityModel":
                    yield from (child.get(_GML_ID, "") for child in member)
                    member.clear()
    except OSError as error:
        raise EnvgenError(f"{file}: cannot be read: {error.strerror or error}") from error
    except etree.XMLSyntaxError as error:
        raise EnvgenError(f"{file}: is not well-formed XML: {error}") from error

"""Reads a city from CityGML."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from lxml import etree

from envgen_usd.citygml.feature_read import FeatureReader
from envgen_usd.citygml.foreign import read_foreign
from envgen_usd.citygml.geometry_read import GeometryReader, local_name
from envgen_usd.errors import EnvgenError
from envgen_usd.models.city import City, CityObject

_HREF = "{http://www.w3.org/1999/xlink}href"
_TITLE = "{http://www.w3.org/1999/xlink}title"


def read_city(path: Path, crs: str = "", offset: tuple[float, float, float] | None = None) -> City:
    """Reads a CityGML file: our own, or 1.0, 2.0 or 3.0 of another program.

    Members that lie in other files, as those of `write_index` do, are read from there.

    Args:
        path: The file.
        crs: CRS that another program's file is wanted in, see `read_foreign`; our own keep theirs.
        offset: Offset that another program's file is wanted with.

    Raises:
        EnvgenError: The file is missing, is no XML, or is no CityGML.
    """
    header: dict[str, str] = {}
    try:
        if not _is_our_own(path):
            return read_foreign(path, crs, offset)
        objects = tuple(_features(path, header))
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error.strerror or error}") from error
    except etree.XMLSyntaxError as error:
        raise EnvgenError(f"{path}: is not well-formed XML: {error}") from error
    except ValueError as error:
        raise EnvgenError(f"{path}: does not follow CityGML: {error}") from error
    return City(objects, header.get("crs", ""), _offset(header))


def _is_our_own(path: Path) -> bool:
    """Whether a file has the offset in its header that only our writer puts there."""
    tags = ("{*}metaDataProperty", "{*}cityObjectMember", "{*}featureMember")
    with path.open("rb") as file:
        events = etree.iterparse(file, events=("start",), tag=tags, no_network=True)
        for _, element in events:
            if local_name(element) != "metaDataProperty":
                return False
            if element.get(_TITLE) == "offset":
                return True
    return False


def _features(path: Path, header: dict[str, str], *, follow: bool = True) -> Iterator[CityObject]:
    with path.open("rb") as file:
        events = etree.iterparse(
            file,
            events=("start", "end"),
            tag=("{*}CityModel", "{*}metaDataProperty", "{*}Envelope", "{*}cityObjectMember"),
            remove_comments=True,
            remove_pis=True,
            resolve_entities=False,
            no_network=True,
        )
        reader: FeatureReader | None = None
        elsewhere: dict[str, None] = {}
        depth = 0
        for event, element in events:
            name = local_name(element)
            depth += 1 if event == "start" else -1
            if event == "start" and depth == 1 and name != "CityModel":
                raise EnvgenError(f"{path}: is no CityGML: its root is not CityModel")
            if event == "start" or depth != 1:
                continue
            if name == "metaDataProperty":
                header[element.get(_TITLE, "")] = "".join(element.itertext())
            elif name == "cityObjectMember":
                reader = reader or FeatureReader(GeometryReader(np.round(_offset(header), 3)))
                yield from (reader.feature(child) for child in element)
                if file_name := element.get(_HREF, "").partition("#")[0]:
                    elsewhere[file_name] = None
                _forget(element)
        if events.root is None or local_name(events.root) != "CityModel":
            raise EnvgenError(f"{path}: is no CityGML: its root is not CityModel")
    for other in elsewhere if follow else ():
        yield from map(_in_one_city, _features(path.parent / other, {}, follow=False))


def _in_one_city(feature: CityObject) -> CityObject:
    """A feature whose references to other files are references to what was read along with it."""
    relations = {
        role: tuple(target.rpartition("#")[2] for target in targets)
        for role, targets in feature.relations.items()
    }
    return replace(
        feature, relations=relations, children=tuple(map(_in_one_city, feature.children))
    )


def _offset(header: dict[str, str]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in header.get("offset", "0 0 0").split())
    return x, y, z


def _forget(element: etree._Element) -> None:
    """Frees what was read, so that memory does not grow with the file."""
    element.clear()
    parent = element.getparent()
    while parent is not None and element.getprevious() is not None:
        del parent[0]

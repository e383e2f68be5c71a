"""Reads a city from CityGML."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from envgen_usd.citygml.feature_read import FeatureReader
from envgen_usd.citygml.foreign_city import read_foreign
from envgen_usd.citygml.gml_geometry_read import GeometryReader
from envgen_usd.citygml.xml_stream import MEMBERS, forget, other_file, stream_elements
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.xml_events import local_name

_HREF = "{http://www.w3.org/1999/xlink}href"
_TITLE = "{http://www.w3.org/1999/xlink}title"


def read_city(
    path: Path | str,
    crs: str = "",
    offset: tuple[float, float, float] | None = None,
    road: FloatArray | None = None,
) -> City:
    """Reads a CityGML file of this package, or CityGML 1.0, 2.0 or 3.0 of another program.

    Members in other files, as in an index of `write_index`, are read too.

    Args:
        path: The file.
        crs: Target CRS for files of other programs, see `read_foreign`; our files keep theirs.
        offset: Target offset for files of other programs.
        road: 2 x 3, lowest and highest corner of the road in the target CRS; tells the axis order.

    Raises:
        EnvgenError: The file is missing or is not CityGML.
    """
    path, header = Path(path), dict[str, str]()
    try:
        if not _is_our_own(path):
            return read_foreign(path, crs, offset, road)
        objects = tuple(_features(path, header))
    except ValueError as error:
        raise EnvgenError(f"{path}: does not follow CityGML: {error}") from error
    return City(objects, header.get("crs", ""), _offset(header))


def _is_our_own(path: Path) -> bool:
    """True if the header holds the offset that only our writer adds."""
    names = ("metaDataProperty", *MEMBERS)
    for _, element in stream_elements(path, *names, events=("start",)):
        if local_name(element) != "metaDataProperty":
            return False
        if element.get(_TITLE) == "offset":
            return True
    return False


def _features(path: Path, header: dict[str, str], *, follow: bool = True) -> Iterator[CityObject]:
    names = ("CityModel", "metaDataProperty", "Envelope", "cityObjectMember")
    reader: FeatureReader | None = None
    elsewhere: dict[str, None] = {}
    depth = 0
    for event, element in stream_elements(path, *names, events=("start", "end")):
        name = local_name(element)
        depth += 1 if event == "start" else -1
        if event == "start" and depth == 1 and name != "CityModel":
            raise EnvgenError(f"{path}: not CityGML: its root element is not CityModel")
        if event == "start" or depth != 1:
            continue
        if name == "metaDataProperty":
            header[element.get(_TITLE, "")] = "".join(map(str, element.itertext()))
        elif name == "cityObjectMember":
            reader = reader or FeatureReader(GeometryReader(np.round(_offset(header), 3)))
            yield from (reader.feature(child) for child in element)
            if file_name := element.get(_HREF, "").partition("#")[0]:
                elsewhere[file_name] = None
            forget(element)
    for other in elsewhere if follow else ():
        yield from map(_in_one_city, _features(other_file(path, other), {}, follow=False))


def _in_one_city(feature: CityObject) -> CityObject:
    """A feature whose references to other files become references within the city."""
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

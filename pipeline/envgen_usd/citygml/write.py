"""Writes a city as CityGML 3.0 or 2.0."""

import os
import re
import tempfile
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO
from xml.sax.saxutils import escape

import pyproj
from pyproj.exceptions import CRSError

from envgen_usd.citygml.feature_text import feature_text
from envgen_usd.citygml.feature_text_2 import feature_text_2
from envgen_usd.citygml.geometry_text import GeometryText
from envgen_usd.citygml.schema import NAMESPACES
from envgen_usd.citygml.schema_2 import NAMESPACES_2
from envgen_usd.errors import EnvgenError
from envgen_usd.models.city import City, CityObject

_ENVELOPE_BYTES = 512
_BUFFER_BYTES = 1 << 20


@dataclass(frozen=True)
class _Place:
    """Where a city lies, as in `City`."""

    crs: str
    offset: tuple[float, float, float]


@dataclass(frozen=True)
class _Dialect:
    """A version of CityGML."""

    namespaces: Mapping[str, str]
    feature_text: Callable[[CityObject, GeometryText], str]
    old: bool


_DIALECTS = {
    "3.0": _Dialect(NAMESPACES, feature_text, False),
    "2.0": _Dialect(NAMESPACES_2, feature_text_2, True),
}


def write_city(city: City, path: Path, version: str = "3.0") -> None:
    """Writes a city as CityGML; the file appears only when it is complete.

    Coordinates are those of `City.crs`: the city's offset, rounded to 1 mm, is added to them.

    Args:
        city: Points on `chunks.GRID`; others are rounded to it.
        path: File to write.
        version: ``3.0``, which holds all of the model, or ``2.0``.

    Raises:
        EnvgenError: CityGML has no class of an object's kind, an id is not an NCName, or the
            version is unknown.
    """
    write_features(city.objects, path, city.crs, city.offset, version)


def write_features(
    features: Iterable[CityObject],
    path: Path,
    crs: str = "",
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
    version: str = "3.0",
) -> None:
    """Writes features one after the other, so that memory does not grow with their number.

    Args:
        features: Top-level features, in the road frame.
        path: File to write.
        crs: As in `City`.
        offset: As in `City`.
        version: As for `write_city`.

    Raises:
        EnvgenError: As for `write_city`.
    """
    if version not in _DIALECTS:
        raise EnvgenError(f"CityGML {version} is not written; known: {', '.join(_DIALECTS)}")
    dialect = _DIALECTS[version]
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb", buffering=_BUFFER_BYTES) as file:
            _write(features, file, _Place(crs, offset), dialect)
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _write(
    features: Iterable[CityObject], file: BinaryIO, place: _Place, dialect: _Dialect
) -> None:
    geometry = GeometryText(place.offset, old=dialect.old)
    file.write(_header(place, dialect).encode())
    start = file.tell()
    # The envelope is known only at the end; blanks keep its place.
    file.write(b" " * _ENVELOPE_BYTES + b"\n")
    for feature in features:
        text = dialect.feature_text(feature, geometry)
        file.write(f"<cityObjectMember>{text}</cityObjectMember>\n".encode())
    file.write(b"</CityModel>\n")
    file.seek(start)
    file.write(_envelope(geometry, place.crs).encode()[:_ENVELOPE_BYTES])


def _header(place: _Place, dialect: _Dialect) -> str:
    prefixes = "".join(
        f' xmlns:{prefix}="{uri}"' for prefix, uri in dialect.namespaces.items() if prefix != "core"
    )
    offset = " ".join(repr(float(value)) for value in place.offset)
    # GML has no property for a CRS that no registry knows, nor for a local frame's offset. The
    # latter also tells a file that holds all of the model from those of other programs.
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<CityModel xmlns="{dialect.namespaces["core"]}"{prefixes}>\n'
        f"{_metadata('crs', place.crs)}{'' if dialect.old else _metadata('offset', offset)}"
    )


def _metadata(name: str, text: str) -> str:
    return (
        f'<gml:metaDataProperty xlink:title="{name}"><gml:GenericMetaData>{escape(text)}'
        "</gml:GenericMetaData></gml:metaDataProperty>\n"
    )


def _envelope(geometry: GeometryText, crs: str) -> str:
    bounds = geometry.bounds()
    if bounds is None:
        return ""
    name = _srs_name(crs)
    srs = f' srsName="{name}"' if name else ""
    lower, upper = (" ".join(f"{value:.3f}" for value in corner) for corner in bounds)
    return (
        f'<gml:boundedBy><gml:Envelope{srs} srsDimension="3"><gml:lowerCorner>{lower}'
        f"</gml:lowerCorner><gml:upperCorner>{upper}</gml:upperCorner></gml:Envelope>"
        "</gml:boundedBy>"
    )


@lru_cache(maxsize=16)
def _srs_name(crs: str) -> str:
    """URN of the EPSG code, empty where the CRS has none."""
    if found := re.fullmatch(
        r"(?:urn:ogc:def:crs:)?EPSG:(?:[^:]*:)?(\d+)", crs.strip(), re.IGNORECASE
    ):
        return f"urn:ogc:def:crs:EPSG::{found[1]}"
    try:
        # An old form of a PROJ string is none of the user's concern here.
        with warnings.catch_warnings(action="ignore"):
            known = pyproj.CRS.from_user_input(crs) if crs.strip() else None
            # Road files that name a geographic CRS mean a map around it, in metres.
            code = known.to_epsg() if known is not None and known.is_projected else None
    except CRSError:
        code = None
    return f"urn:ogc:def:crs:EPSG::{code}" if code else ""

"""Writes a city as CityGML 3.0 or 2.0."""

import re
import shutil
import tempfile
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from xml.sax.saxutils import escape

import pyproj
from pyproj.exceptions import CRSError

from envgen_usd.citygml.feature_properties import NAMESPACES
from envgen_usd.citygml.feature_properties_2 import NAMESPACES_2
from envgen_usd.citygml.feature_text import feature_text
from envgen_usd.citygml.feature_text_2 import feature_text_2
from envgen_usd.citygml.gml_geometry_text import GeometryText
from envgen_usd.errors import EnvgenError
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.whole_files import whole_file

_ENVELOPE_BYTES = 512
"""Place kept for the envelope; a longer one costs a second copy of the file's rest."""
_BUFFER_BYTES = 1 << 20


@dataclass(frozen=True)
class _Place:
    """CRS and offset of a city, as in `City`."""

    crs: str
    offset: tuple[float, float, float]


@dataclass(frozen=True)
class _Dialect:
    """Version-specific parts of CityGML."""

    namespaces: Mapping[str, str]
    feature_text: Callable[[CityObject, GeometryText], str]
    old: bool


_DIALECTS = {
    "3.0": _Dialect(NAMESPACES, feature_text, False),
    "2.0": _Dialect(NAMESPACES_2, feature_text_2, True),
}


def write_city(city: City, path: Path | str, version: str = "3.0") -> None:
    """Writes a city as CityGML; the file is written whole or not at all.

    Coordinates are in `City.crs`: the city's offset, rounded to 1 mm, is added.

    Args:
        city: Points on `chunks.GRID`; other points are rounded to it.
        path: File to write.
        version: ``3.0``, which keeps the whole model, or ``2.0``.

    Raises:
        EnvgenError: CityGML lacks the class of an object, an id is not an NCName, the version is
            unknown, or the file cannot be written.
    """
    write_features(city.objects, Path(path), city.crs, city.offset, version)


def write_features(
    features: Iterable[CityObject],
    path: Path,
    crs: str = "",
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
    version: str = "3.0",
) -> None:
    """Writes a stream of features, so that memory does not grow with their number.

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
        raise EnvgenError(
            f"CityGML {version} cannot be written; choose from {', '.join(_DIALECTS)}"
        )
    dialect = _DIALECTS[version]
    geometry = GeometryText(offset, old=dialect.old)
    with whole_file(path) as part:
        with part.open("wb", buffering=_BUFFER_BYTES) as file:
            file.write(_header(_Place(crs, offset), dialect).encode())
            start = file.tell()
            # The envelope is known only at the end; spaces reserve its place.
            file.write(b" " * _ENVELOPE_BYTES + b"\n")
            for feature in features:
                text = dialect.feature_text(feature, geometry)
                file.write(f"<cityObjectMember>{text}</cityObjectMember>\n".encode())
            file.write(b"</CityModel>\n")
        _put_envelope(part, start, _envelope(geometry, crs).encode())


def _put_envelope(path: Path, start: int, envelope: bytes) -> None:
    """Writes the envelope over its spaces; a longer envelope moves what follows."""
    with path.open("r+b") as file:
        if len(envelope) <= _ENVELOPE_BYTES:
            file.seek(start)
            file.write(envelope)
            return
        with tempfile.TemporaryFile(dir=path.parent) as rest:
            file.seek(start + _ENVELOPE_BYTES)
            shutil.copyfileobj(file, rest)
            file.seek(start)
            file.write(envelope)
            rest.seek(0)
            shutil.copyfileobj(rest, file)


def _header(place: _Place, dialect: _Dialect) -> str:
    prefixes = "".join(
        f' xmlns:{prefix}="{uri}"' for prefix, uri in dialect.namespaces.items() if prefix != "core"
    )
    offset = " ".join(repr(float(value)) for value in place.offset)
    # GML has no property for an unregistered CRS or for the offset of a local frame. The offset
    # also marks files that keep the whole model.
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
    """URN of the EPSG code; empty for a CRS without a code."""
    if match := re.fullmatch(
        r"(?:urn:ogc:def:crs:)?EPSG:(?:[^:]*:)?([0-9]+)", crs.strip(), re.IGNORECASE
    ):
        return f"urn:ogc:def:crs:EPSG::{match[1]}"
    try:
        # A warning about an old form of a PROJ string would not help the user.
        with warnings.catch_warnings(action="ignore"):
            known = pyproj.CRS.from_user_input(crs) if crs.strip() else None
            # Road files with a geographic CRS mean a local map in metres around it.
            code = known.to_epsg() if known is not None and known.is_projected else None
    except CRSError:
        code = None
    return f"urn:ogc:def:crs:EPSG::{code}" if code else ""

"""Writes a city as CityGML 3.0."""

import os
import re
import tempfile
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO
from xml.sax.saxutils import escape

from envgen_usd.citygml.feature_text import feature_text
from envgen_usd.citygml.geometry_text import GeometryText
from envgen_usd.citygml.schema import NAMESPACES
from envgen_usd.geometry.georeference import parse_crs
from envgen_usd.models.city import City, CityObject

_ENVELOPE_BYTES = 512
_BUFFER_BYTES = 1 << 20


def write_city(city: City, path: Path) -> None:
    """Writes a city as CityGML 3.0; the file appears only when it is complete.

    Coordinates are those of `City.crs`: the city's offset, rounded to 1 mm, is added to them.

    Args:
        city: Points on `chunks.GRID`; others are rounded to it.
        path: File to write.

    Raises:
        EnvgenError: CityGML has no class of an object's kind, or an id is not an NCName.
    """
    write_features(city.objects, path, city.crs, city.offset)


def write_features(
    features: Iterable[CityObject],
    path: Path,
    crs: str = "",
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Writes features one after the other, so that memory does not grow with their number.

    Args:
        features: Top-level features, in the road frame.
        path: File to write.
        crs: As in `City`.
        offset: As in `City`.

    Raises:
        EnvgenError: As for `write_city`.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb", buffering=_BUFFER_BYTES) as file:
            _write(features, file, crs, offset)
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _write(
    features: Iterable[CityObject],
    file: BinaryIO,
    crs: str,
    offset: tuple[float, float, float],
) -> None:
    geometry = GeometryText(offset)
    file.write(_header(crs, offset).encode())
    place = file.tell()
    # The envelope is known only at the end; blanks keep its place.
    file.write(b" " * _ENVELOPE_BYTES + b"\n")
    for feature in features:
        text = feature_text(feature, geometry)
        file.write(f"<cityObjectMember>{text}</cityObjectMember>\n".encode())
    file.write(b"</CityModel>\n")
    file.seek(place)
    file.write(_envelope(geometry, crs).encode()[:_ENVELOPE_BYTES])


def _header(crs: str, offset: tuple[float, float, float]) -> str:
    prefixes = "".join(
        f' xmlns:{prefix}="{uri}"' for prefix, uri in NAMESPACES.items() if prefix != "core"
    )
    place = " ".join(repr(float(value)) for value in offset)
    # GML has no property for a CRS that no registry knows, nor for a local frame's offset.
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<CityModel xmlns="{NAMESPACES["core"]}"{prefixes}>\n'
        f"{_metadata('crs', crs)}{_metadata('offset', place)}"
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
    known = parse_crs(crs)
    code = None if known is None else known.to_epsg()
    return f"urn:ogc:def:crs:EPSG::{code}" if code else ""

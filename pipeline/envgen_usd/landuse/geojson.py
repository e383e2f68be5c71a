"""Landuse as GeoJSON (RFC 7946)."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pyproj
import shapely

from envgen_usd.geometry.georeference import Offset, parse_crs
from envgen_usd.landuse.regions import Region
from envgen_usd.models.arrays import FloatArray

DEGREES = 9
"""Decimals of degrees: a tenth of a millimetre."""
METRES = 3
"""Decimals of metres."""

_Place = Callable[[FloatArray], FloatArray]


def write_regions(
    regions: Sequence[Region], path: Path, crs: str = "", offset: Offset = (0.0, 0.0, 0.0)
) -> None:
    """Writes landuse polygons; the file appears at once or not at all.

    Every feature has a ``landuse``. A plot's also has its ``plot`` (id), ``road``, ``frontage``
    (the street side, in the file's coordinates), ``orientation`` (where the street side faces,
    degrees clockwise from north), ``area`` (m²) and, where a paved way crosses the street side,
    ``access`` (a place).

    Args:
        regions: What to write.
        path: File to make.
        crs: The road's geoReference. Coordinates are degrees of WGS 84, as the standard wants;
            where it is missing or cannot be understood, they are metres of the road file.
        offset: The road's header offset, added to road-frame coordinates.
    """
    place, decimals = _placing(crs, np.array(offset[:2]))
    content = {
        "type": "FeatureCollection",
        "coordinates": "WGS 84, degrees" if decimals == DEGREES else "road file, metres",
        "features": [_feature(region, place, decimals) for region in regions],
    }
    part = path.with_name(f".{path.name}.part")
    part.write_text(json.dumps(content, separators=(",", ":")), encoding="utf-8")
    part.replace(path)


def _placing(crs: str, offset: FloatArray) -> tuple[_Place, int]:
    """From the road frame (N x 2) to the file's coordinates, and their decimals."""
    known = parse_crs(crs)
    if known is None:
        return lambda points: points + offset, METRES
    horizontal = pyproj.CRS.from_wkt(known.to_wkt())
    if horizontal.is_compound:
        horizontal = horizontal.sub_crs_list[0]
    transformer = pyproj.Transformer.from_crs(horizontal, "EPSG:4326", always_xy=True)
    return lambda points: np.stack(transformer.transform(*(points + offset).T), axis=1), DEGREES


def _feature(region: Region, place: _Place, decimals: int) -> dict[str, object]:
    rings = [region.shape.exterior, *region.shape.interiors]
    coordinates = [
        np.round(place(shapely.get_coordinates(ring)), decimals).tolist() for ring in rings
    ]
    properties: dict[str, object] = {"landuse": region.landuse.name.lower()}
    if region.plot is not None:
        plot = region.plot
        east, north = plot.frontage[1] - plot.frontage[0]
        properties |= {
            "plot": plot.id,
            "road": plot.road,
            "frontage": np.round(place(plot.frontage), decimals).tolist(),
            "orientation": round(float(np.degrees(np.arctan2(north, -east))) % 360, 2),
            "area": round(region.shape.area, 2),
        }
        if plot.access is not None:
            (access,) = np.round(place(plot.access[None]), decimals).tolist()
            properties["access"] = access
    geometry = {"type": "Polygon", "coordinates": coordinates}
    return {"type": "Feature", "geometry": geometry, "properties": properties}

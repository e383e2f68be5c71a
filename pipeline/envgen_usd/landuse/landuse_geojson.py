"""Landuse as GeoJSON (RFC 7946)."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pyproj
import shapely

from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.georeference import WGS_84, Offset, parse_crs, transformation
from envgen_usd.landuse.landuse_regions import Region
from envgen_usd.models.array_types import FloatArray
from envgen_usd.whole_files import write_whole

DEGREES = 9
"""Decimals of degrees: 0.1 mm; a larger value writes finer coordinates."""
METRES = 3
"""Decimals of metres: 1 mm; a larger value writes finer coordinates."""

_Place = Callable[[FloatArray], FloatArray]


def write_regions(
    regions: Sequence[Region], path: Path, crs: str = "", offset: Offset = (0.0, 0.0, 0.0)
) -> None:
    """Writes landuse polygons; the file is written whole or not at all.

    Every feature has a ``landuse``. Plots also have ``plot`` (id), ``road``, ``frontage`` (street
    side, in the file's coordinates) and ``area`` (m²). Their ``orientation`` is the direction that
    the street side faces, degrees clockwise from north. If a paved way crosses the street side,
    ``access`` is the crossing point.

    Args:
        regions: Polygons to write.
        path: File to write.
        crs: The road's geoReference. Coordinates are WGS 84 degrees, as the standard requires;
            without a usable geoReference they are metres of the road file.
        offset: The road's header offset, added to road-frame coordinates.
    """
    place, decimals = _placing(crs, np.array(offset[:2]))
    content = {
        "type": "FeatureCollection",
        "coordinates": "WGS 84, degrees" if decimals == DEGREES else "road file, metres",
        "features": [_feature(region, place, decimals) for region in regions],
    }
    write_whole(path, json.dumps(content, separators=(",", ":")))


def _placing(crs: str, offset: FloatArray) -> tuple[_Place, int]:
    """Transformation from the road frame (N x 2) to the file's coordinates, and their decimals."""
    known = parse_crs(crs)
    try:
        to_degrees = transformation(pyproj.CRS(known.to_wkt()), WGS_84) if known else None
    except EnvgenError:
        # Systems of other planets have no degrees of WGS 84.
        to_degrees = None
    if to_degrees is None:
        return lambda points: points + offset, METRES
    return lambda points: np.stack(to_degrees.transform(*(points + offset).T), axis=1), DEGREES


def _feature(region: Region, place: _Place, decimals: int) -> dict[str, object]:
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
    geometry = _geometry(shapely.transform(region.shape, place), decimals)
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _geometry(shape: shapely.Polygon, decimals: int) -> dict[str, object]:
    """Geometry of a polygon with rounded coordinates, counter-clockwise.

    Rounding makes a border that is narrower than the last decimal cross itself. It is cut where
    it does; those places have three more decimals, since rounding them may cross it again.
    """
    rounded = shapely.transform(shape, lambda points: np.round(points, decimals))
    if not rounded.is_valid:
        rounded = shapely.make_valid(rounded, method="structure", keep_collapsed=False)
    parts = [
        [
            np.round(shapely.get_coordinates(ring), decimals + 3).tolist()
            for ring in (part.exterior, *part.interiors)
        ]
        for part in shapely.get_parts(shapely.orient_polygons(rounded))
    ]
    if len(parts) == 1:
        return {"type": "Polygon", "coordinates": parts[0]}
    return {"type": "MultiPolygon", "coordinates": parts}

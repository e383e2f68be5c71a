"""Landuse of a real place from an OpenStreetMap extract."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import osmium
import shapely
from osmium.osm import Area, Way
from pyproj import Transformer

from envgen_usd.chunks import chunks_of_points
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.raster import cells_of_shapes
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.landuse import LanduseClass, LanduseMap

ROADS: Mapping[str, float] = {
    "motorway": 11.0,
    "motorway_link": 6.0,
    "trunk": 10.0,
    "trunk_link": 6.0,
    "primary": 9.0,
    "primary_link": 6.0,
    "secondary": 8.0,
    "secondary_link": 6.0,
    "tertiary": 7.0,
    "tertiary_link": 6.0,
    "unclassified": 6.0,
    "residential": 6.0,
    "living_street": 5.0,
}
"""Values of the tag ``highway`` that are roads, with a width in metres where none is tagged."""
ACCESS_WIDTH = 3.5
"""Metres, of ``highway=service``."""
AREAS: Mapping[str, Mapping[str, LanduseClass]] = {
    "landuse": {
        "residential": LanduseClass.LAWN,
        "allotments": LanduseClass.LAWN,
        "industrial": LanduseClass.RUBBLE,
        "commercial": LanduseClass.RUBBLE,
        "retail": LanduseClass.RUBBLE,
        "railway": LanduseClass.RUBBLE,
        "construction": LanduseClass.RUBBLE,
        "forest": LanduseClass.WOOD,
        "grass": LanduseClass.GRASS,
        "meadow": LanduseClass.GRASS,
    },
    "natural": {"wood": LanduseClass.WOOD, "scrub": LanduseClass.WOOD},
    "leisure": {"park": LanduseClass.GRASS, "garden": LanduseClass.LAWN},
    "amenity": {"parking": LanduseClass.ACCESS},
}
"""Landuse classes of tagged areas; what no area covers is grass."""
LANE = 3.2
"""Metres, width of a lane of a road whose width is not tagged."""
VERGE = 1.5
"""Metres of verge beside a road."""


@dataclass(frozen=True)
class OsmMap:
    """What an extract says about landuse, in metres on a map of its own.

    Attributes:
        crs: Transverse Mercator about the middle of the extract, as a PROJ string.
        shapes: In the order in which they are drawn: areas, verges, paved ways, roads.
        classes: Class of each shape.
    """

    crs: str
    shapes: Sequence[shapely.Geometry]
    classes: Sequence[LanduseClass]


def read_osm(path: Path) -> OsmMap:
    """Reads an extract, ``.osm`` or ``.pbf``.

    Raises:
        EnvgenError: The file cannot be read, or holds no road.
    """
    if not path.is_file():
        raise EnvgenError(f"{path}: is no file")
    try:
        found = _Features(path)
    except (RuntimeError, OSError) as error:
        raise EnvgenError(f"{path}: cannot be read as an OpenStreetMap extract: {error}") from error
    if not found.roads:
        raise EnvgenError(f"{path}: holds no road (a way with highway={', '.join(ROADS)})")
    west, south, east, north = shapely.total_bounds([line for line, _ in found.roads])
    crs = f"+proj=tmerc +lat_0={(south + north) / 2:.6f} +lon_0={(west + east) / 2:.6f} +units=m"
    to_metres = Transformer.from_crs(4326, crs, always_xy=True).transform
    roads, ways = (
        [_widen(*line, to_metres) for line in kind] for kind in (found.roads, found.ways)
    )
    areas = [(_project(shape, to_metres), kind) for shape, kind in found.areas]
    areas.sort(key=lambda area: -area[0].area)
    layers = [
        *areas,
        *((shapely.buffer(road, VERGE), LanduseClass.VERGE) for road in roads),
        *((way, LanduseClass.ACCESS) for way in ways),
        *((road, LanduseClass.ROAD) for road in roads),
    ]
    return OsmMap(crs, [shape for shape, _ in layers], [kind for _, kind in layers])


def rasterise_osm(extract: OsmMap) -> Iterator[LanduseMap]:
    """Draws every 200 m chunk with a road, in the order of chunks; plots are not known."""
    roads = [s for s, k in zip(extract.shapes, extract.classes, strict=True) if k == _ROAD]
    tree = shapely.STRtree(extract.shapes)
    for chunk in sorted(chunks_of_points(shapely.get_coordinates(roads), 0.0)):
        near = np.sort(tree.query(shapely.box(*chunk.bounds)))
        cells = cells_of_shapes(chunk, ((extract.shapes[n], extract.classes[n]) for n in near))
        classes = np.where(cells == 0, LanduseClass.GRASS, cells).astype(np.uint8)
        yield LanduseMap(chunk, classes, np.zeros(classes.shape, dtype=np.int64))


_ROAD = LanduseClass.ROAD
_Transform = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


class _Features:
    """Roads and paved ways with their width, and areas with their class; degrees."""

    def __init__(self, path: Path) -> None:
        self.roads: list[tuple[shapely.Geometry, float]] = []
        self.ways: list[tuple[shapely.Geometry, float]] = []
        self.areas: list[tuple[shapely.Geometry, LanduseClass]] = []
        factory = osmium.geom.WKBFactory()
        for item in osmium.FileProcessor(str(path)).with_areas():
            tags = {tag.k: tag.v for tag in item.tags}
            if isinstance(item, Area) and (kind := _area_class(tags)) is not None:
                shape = shapely.from_wkb(factory.create_multipolygon(item))
                self.areas.append((shape, kind))
            elif isinstance(item, Way) and len(item.nodes) > 1:
                self._add_way(factory, item, tags)

    def _add_way(
        self, factory: "osmium.geom.WKBFactory", way: Way, tags: Mapping[str, str]
    ) -> None:
        kind = tags.get("highway", "")
        if kind in ROADS and tags.get("area") != "yes":
            line = shapely.from_wkb(factory.create_linestring(way))
            self.roads.append((line, _width(tags, ROADS[kind])))
        elif kind == "service":
            line = shapely.from_wkb(factory.create_linestring(way))
            self.ways.append((line, _width(tags, ACCESS_WIDTH)))


def _area_class(tags: Mapping[str, str]) -> LanduseClass | None:
    for key, values in AREAS.items():
        if tags.get(key) in values:
            return values[tags[key]]
    return None


def _width(tags: Mapping[str, str], otherwise: float) -> float:
    """Metres: the tagged width, else the number of lanes times 3.2 m, else a usual one."""
    try:
        return float(tags["width"].removesuffix("m"))
    except (KeyError, ValueError):
        lanes = tags.get("lanes", "")
        return LANE * int(lanes) if lanes.isdecimal() and int(lanes) else otherwise


def _widen(line: shapely.Geometry, width: float, to_metres: _Transform) -> shapely.Geometry:
    return shapely.buffer(_project(line, to_metres), width / 2)


def _project(shape: shapely.Geometry, to_metres: _Transform) -> shapely.Geometry:
    return shapely.transform(shape, lambda places: np.column_stack(to_metres(*places.T)))

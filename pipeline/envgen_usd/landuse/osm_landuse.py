"""Landuse of a real place from an OpenStreetMap extract."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import osmium
import shapely
from osmium.osm import Area, Relation, Way
from pyproj import Transformer

from envgen_usd.chunks import chunks_of_points
from envgen_usd.compressed_files import check_content
from envgen_usd.errors import EnvgenError, Issue, one_line
from envgen_usd.geometry.osm_extracts import incomplete_issues, known_lines
from envgen_usd.input_paths import check_input_file
from envgen_usd.landuse.osm_land_tags import (
    ACCESS_WIDTH,
    ROADS,
    UNPAVED,
    area_class,
    is_paved_path,
    line_class,
    path_width,
    width_of,
)
from envgen_usd.landuse.shape_cells import cells_of_shapes
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.landuse import LanduseClass, LanduseMap

DOCKS: Mapping[str, frozenset[str]] = {
    "waterway": frozenset({"dock"}),
    "water": frozenset({"dock", "harbour"}),
}
"""Tags of water that lies between quays."""
QUAY_WIDTH = 2.5
"""Width of the quay around a dock that the map has no land for, metres."""
VERGE = 1.5
"""Width of the verge beside a road, metres; a larger value widens verges."""


@dataclass(frozen=True)
class MapPath:
    """A path or a service way above ground.

    Attributes:
        line: Its middle, metres.
        width: Metres.
        is_paved: True for a paved path; ways are among the shapes of their map.
        is_through: True if it meets other ways at both ends; all others lead to a house or a place.
    """

    line: shapely.Geometry
    width: float
    is_paved: bool
    is_through: bool

    def ground(self, beside: float = 0.0) -> shapely.Geometry:
        """The ground that it covers, wider by a distance on either side, metres."""
        return shapely.buffer(self.line, self.width / 2.0 + beside, cap_style="flat")


@dataclass(frozen=True)
class OsmMap:
    """Landuse of an extract, in metres of a local projection.

    Attributes:
        crs: Transverse Mercator about the centre of the extract, as a PROJ string.
        shapes: In drawing order: areas, railways, water, piers, verges, paved ways, roads.
        classes: Class of each shape.
        issues: Incomplete objects, as in clipped extracts.
        paths: Paths and service ways.
    """

    crs: str
    shapes: Sequence[shapely.Geometry]
    classes: Sequence[LanduseClass]
    issues: tuple[Issue, ...] = ()
    paths: tuple[MapPath, ...] = ()


def read_osm(path: Path, crs: str = "") -> OsmMap:
    """Reads an extract, ``.osm`` or ``.pbf``.

    Areas with an incomplete border are left out, and missing nodes of ways are skipped; issues
    count both.

    Args:
        path: The extract.
        crs: Projection to metres, as a PROJ string; empty: about the centre of the roads.

    Raises:
        EnvgenError: The file cannot be read, or holds no road.
    """
    check_input_file(path, "name an OpenStreetMap extract")
    check_content(path)
    try:
        features = _Features(path)
    except (RuntimeError, OSError, ValueError, osmium.InvalidLocationError) as error:
        raise EnvgenError(
            f"{path}: cannot be read as an OpenStreetMap extract: {one_line(error)}"
        ) from error
    if not features.roads:
        raise EnvgenError(f"{path}: holds no road (a way with highway={', '.join(ROADS)})")
    crs = crs or _projection([line for line, _ in features.roads])
    to_metres = Transformer.from_crs(4326, crs, always_xy=True).transform
    roads, ways = (
        [_widen(*line, to_metres) for line in kind] for kind in (features.roads, features.ways)
    )
    areas = [(_project(shape, to_metres), kind) for shape, kind in features.areas]
    docks = [_project(shape, to_metres) for shape in features.docks]
    areas += _quays_around(docks, [shape for shape, kind in areas if kind == LanduseClass.WATER])
    areas.sort(key=lambda area: -area[0].area)
    lines = [
        # Piers end square in the water; other lines meet, and have no gap at a bend.
        (_widen(line, width, to_metres, "flat" if kind == LanduseClass.QUAY else "round"), kind)
        for line, width, kind in features.lines
    ]
    lines.sort(key=lambda line: _OVER.index(line[1]))
    layers = [
        *areas,
        *lines,
        *((shapely.buffer(road, VERGE), LanduseClass.VERGE) for road in roads),
        *((way, LanduseClass.ACCESS) for way in ways),
        *((road, LanduseClass.ROAD) for road in roads),
    ]
    shapes, kinds = [shape for shape, _ in layers], [kind for _, kind in layers]
    paths = tuple(
        MapPath(_project(line, to_metres), width, is_paved, features.is_through(ends))
        for line, width, is_paved, ends in features.paths
    )
    return OsmMap(crs, shapes, kinds, features.issues(path), paths)


def _quays_around(
    docks: Sequence[shapely.Geometry], water: Sequence[shapely.Geometry]
) -> list[tuple[shapely.Geometry, LanduseClass]]:
    """Quays around docks, but for where other water joins them."""
    if not docks:
        return []
    around = shapely.buffer(shapely.union_all(docks), QUAY_WIDTH, join_style="mitre")
    return [(shapely.difference(around, shapely.union_all(water)), LanduseClass.QUAY)]


def _projection(lines: Sequence[shapely.Geometry]) -> str:
    """Transverse Mercator about the centre of lines in degrees."""
    west, south, east, north = shapely.total_bounds(lines)
    return f"+proj=tmerc +lat_0={(south + north) / 2:.6f} +lon_0={(west + east) / 2:.6f} +units=m"


def rasterise_osm(extract: OsmMap) -> Iterator[LanduseMap]:
    """Rasterises every 200 m chunk with a road, in the order of chunks; plots are unknown."""
    roads = [s for s, k in zip(extract.shapes, extract.classes, strict=True) if k == _ROAD]
    tree = shapely.STRtree(extract.shapes)
    for chunk in sorted(chunks_of_points(shapely.get_coordinates(roads), 0.0)):
        near = np.sort(tree.query(shapely.box(*chunk.bounds)))
        cells = cells_of_shapes(chunk, ((extract.shapes[n], extract.classes[n]) for n in near))
        classes = np.where(cells == 0, LanduseClass.GRASS, cells).astype(np.uint8)
        yield LanduseMap(chunk, classes, np.zeros(classes.shape, dtype=np.int64))


_ROAD = LanduseClass.ROAD
_OVER = (LanduseClass.RAIL, LanduseClass.WATER, LanduseClass.QUAY)
"""Classes of lines; later ones lie on earlier ones."""
_Transform = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


class _Features:
    """Roads, paved ways and other lines with their width, and areas with their class; degrees."""

    def __init__(self, path: Path) -> None:
        self.roads: list[tuple[shapely.Geometry, float]] = []
        self.ways: list[tuple[shapely.Geometry, float]] = []
        self.lines: list[tuple[shapely.Geometry, float, LanduseClass]] = []
        self.areas: list[tuple[shapely.Geometry, LanduseClass]] = []
        self.docks: list[shapely.Geometry] = []
        self.paths: list[tuple[shapely.Geometry, float, bool, tuple[int, int]]] = []
        self._meetings: Counter[int] = Counter()
        self._partial: dict[str, list[int]] = {"area": [], "road": [], "way": []}
        relations: dict[int, None] = {}
        factory = osmium.geom.WKBFactory()
        for item in osmium.FileProcessor(str(path)).with_areas():
            tags = {tag.k: tag.v for tag in item.tags}
            if isinstance(item, Area):
                if not item.from_way():
                    relations.pop(item.orig_id(), None)
                self._add_area(factory, item, tags)
            elif isinstance(item, Relation):
                if tags.get("type") == "multipolygon" and area_class(tags) is not None:
                    relations[item.id] = None
            elif isinstance(item, Way):
                self._add_way(item, tags)
        # Relations without all their ways do not appear as areas.
        self._partial["area"] += relations

    def issues(self, path: Path) -> tuple[Issue, ...]:
        """An issue for each kind of incomplete object."""
        known = "existing nodes used"
        actions = {"area": "areas left out", "road": known, "way": known}
        return incomplete_issues(path, self._partial, actions)

    def _add_area(
        self, factory: "osmium.geom.WKBFactory", area: Area, tags: Mapping[str, str]
    ) -> None:
        kind = area_class(tags, is_way=area.from_way())
        if kind is None:
            return
        try:
            shape = shapely.from_wkb(factory.create_multipolygon(area))
        except (RuntimeError, osmium.InvalidLocationError):
            self._partial["area"].append(area.orig_id())
            return
        self.areas.append((shape, kind))
        if kind == LanduseClass.WATER and any(tags.get(key) in DOCKS[key] for key in DOCKS):
            self.docks.append(shape)

    def _add_way(self, way: Way, tags: Mapping[str, str]) -> None:
        kind = tags.get("highway", "")
        is_road = kind in ROADS and tags.get("area") != "yes"
        is_way = kind == "service" and tags.get("service") not in UNPAVED
        line = None if is_road or is_way else line_class(tags)
        width = path_width(tags)
        if is_road or width:
            self._meetings.update({node.ref for node in way.nodes})
        if not is_road and not is_way and not width and line is None:
            return
        lines, is_whole = known_lines(way)
        if not is_whole:
            self._partial["road" if is_road else "way"].append(way.id)
        if width and len(way.nodes):
            ends = way.nodes[0].ref, way.nodes[-1].ref
            self.paths += [(one, width, is_paved_path(tags), ends) for one in lines]
        if line is not None:
            self.lines += [(one, width_of(tags, line[1]), line[0]) for one in lines]
        elif is_road:
            self.roads += [(one, width_of(tags, ROADS[kind])) for one in lines]
        elif is_way:
            self.ways += [(one, width_of(tags, ACCESS_WIDTH)) for one in lines]

    def is_through(self, ends: tuple[int, int]) -> bool:
        """True if a path meets other ways at both ends, which are ids of nodes."""
        return all(self._meetings[end] > 1 for end in ends)


def _widen(
    line: shapely.Geometry, width: float, to_metres: _Transform, cap: str = "round"
) -> shapely.Geometry:
    return shapely.buffer(_project(line, to_metres), width / 2, cap_style=cap)


def _project(shape: shapely.Geometry, to_metres: _Transform) -> shapely.Geometry:
    return shapely.transform(shape, lambda places: np.column_stack(to_metres(*places.T)))

"""Buildings and streets of a real place from an OpenStreetMap extract.

libosmium reads the file: it refuses declared entities, fetches nothing, and assembles areas from
ways and multipolygon relations.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import osmium
import shapely
from osmium.osm import Area, Node, Relation, Way
from pyproj import Transformer

from envgen_usd.compressed_files import check_content
from envgen_usd.errors import EnvgenError, one_line
from envgen_usd.geometry.osm_extracts import incomplete_issues, known_lines
from envgen_usd.input_paths import check_input_file
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.place import BuildingParts, Houses, Place, Shapes, Streets
from envgen_usd.places.osm_tags import (
    BARRIERS,
    LANDUSE,
    LANE,
    MATERIALS,
    ROOFS,
    SIDEWALK,
    STREETS,
    has_shop_front,
    landuse_of_kind,
)

_FIRST_NUMBER = re.compile(r"\s*([0-9]+(?:[.,][0-9]+)?)\s*(m|)(?:$|[;\s])")
_GREATEST = {
    **dict.fromkeys(("height", "min_height"), 1000.0),
    **dict.fromkeys(("building:levels", "building:min_level"), 100.0),
    "roof:height": 100.0,
    "width": 60.0,
    "lanes": 12.0,
}
"""Largest plausible value of a tag; larger ones count as unknown."""
_STOREY = 3.0
"""Height of a storey where the map tells only their number, metres."""
_INHERITED = ("building", "building:material", "roof:material")
"""Tags of a building that hold for its parts."""
_SHARED = 0.5
"""Least share of a part within the building that it belongs to."""
_ACTIONS = {"building": "left out", "way": "existing nodes used"}
"""What is done about objects that lack nodes or ways."""


def read_osm_place(path: Path) -> Place:
    """Reads an extract: ``.osm``, ``.osm.gz``, ``.osm.bz2`` or ``.pbf``.

    Coordinates are metres of a transverse Mercator projection about the middle of the buildings.
    Buildings and streets with missing nodes are left out; an issue counts them.

    Raises:
        EnvgenError: The file cannot be read, or holds no building.
    """
    check_input_file(path, "name an OpenStreetMap extract")
    check_content(path)
    content = _Content()
    try:
        content.read(path)
    except (RuntimeError, OSError, ValueError, osmium.InvalidLocationError) as error:
        raise EnvgenError(
            f"{path}: cannot be read as an OpenStreetMap extract: {one_line(error)}"
        ) from error
    if not content.buildings:
        raise EnvgenError(
            f"{path}: holds no building (a closed way or a multipolygon with the tag building)"
        )
    return content.place(path)


class _Content:
    """What an extract holds, in degrees, with its tags."""

    def __init__(self) -> None:
        self.buildings: list[tuple[shapely.Geometry, Mapping[str, str]]] = []
        self.parts: list[tuple[shapely.Geometry, Mapping[str, str]]] = []
        self.land: list[tuple[shapely.Geometry, str]] = []
        self.streets: list[tuple[shapely.Geometry, Mapping[str, str]]] = []
        self.barriers: list[tuple[shapely.Geometry, str]] = []
        self.trees: list[tuple[float, float]] = []
        self.lamps: list[tuple[float, float]] = []
        self.shops: list[tuple[float, float]] = []
        self._incomplete: dict[str, list[int]] = {"building": [], "way": []}
        self._factory = osmium.geom.WKBFactory()

    def read(self, path: Path) -> None:
        """Takes what is wanted of a file."""
        relations: dict[int, None] = {}
        for item in osmium.FileProcessor(str(path)).with_areas():
            if not len(item.tags):
                continue
            tags = {tag.k: tag.v for tag in item.tags}
            if isinstance(item, Node):
                self._add_node(item, tags)
            elif isinstance(item, Area):
                if not item.from_way():
                    relations.pop(item.orig_id(), None)
                self._add_area(item, tags)
            elif isinstance(item, Relation):
                if tags.get("type") == "multipolygon" and has_body(tags):
                    relations[item.id] = None
            elif isinstance(item, Way):
                self._add_way(item, tags)
        # Relations without all of their ways do not come back as areas.
        self._incomplete["building"] += relations

    def _add_node(self, node: Node, tags: Mapping[str, str]) -> None:
        place = (node.location.lon, node.location.lat) if node.location.valid() else None
        if place and tags.get("natural") == "tree":
            self.trees.append(place)
        elif place and tags.get("highway") == "street_lamp":
            self.lamps.append(place)
        elif place and has_shop_front(tags):
            self.shops.append(place)

    def _add_area(self, area: Area, tags: Mapping[str, str]) -> None:
        use = LANDUSE.get(tags.get("landuse", ""))
        if use is None and not has_body(tags):
            return
        try:
            shape = shapely.from_wkb(self._factory.create_multipolygon(area))
        except (RuntimeError, osmium.InvalidLocationError):
            self._incomplete["building"].append(area.orig_id())
            return
        if _is_part(tags):
            self.parts += [(part, tags) for part in shapely.get_parts(shape)]
        if _is_building(tags):
            self.buildings += [(part, tags) for part in shapely.get_parts(shape)]
            if has_shop_front(tags):
                inside = shapely.get_coordinates(shapely.point_on_surface(shape))[0].tolist()
                self.shops.append((inside[0], inside[1]))
        elif use is not None and not _is_part(tags):
            self.land.append((shape, use))

    def _add_way(self, way: Way, tags: Mapping[str, str]) -> None:
        is_street = tags.get("highway") in STREETS and tags.get("area") != "yes"
        barrier = BARRIERS.get(tags.get("barrier", ""))
        if not is_street and barrier is None:
            return
        lines, is_whole = known_lines(way)
        if not is_whole:
            self._incomplete["way"].append(way.id)
        if is_street:
            self.streets += [(line, tags) for line in lines]
        elif barrier is not None:
            self.barriers += [(line, barrier) for line in lines]

    def place(self, path: Path) -> Place:
        """The place in metres."""
        outlines = np.array([shape for shape, _ in self.buildings], object)
        west, south, east, north = shapely.total_bounds(outlines)
        crs = (
            f"+proj=tmerc +lat_0={(south + north) / 2:.6f} +lon_0={(west + east) / 2:.6f} +units=m"
        )
        metric = _Metric(crs)
        land = metric.shapes([shape for shape, _ in self.land])
        tags = [tags for _, tags in self.buildings]
        footprints = metric.shapes(outlines)
        return Place(
            path.name,
            _houses(footprints, tags, _landuse(footprints, tags, land, [u for _, u in self.land])),
            _streets(metric.shapes([shape for shape, _ in self.streets]), self.streets),
            metric.points(self.trees),
            metric.points(self.lamps),
            metric.shapes([shape for shape, _ in self.barriers]),
            np.array([kind for _, kind in self.barriers], np.str_),
            crs,
            incomplete_issues(path, self._incomplete, _ACTIONS),
            metric.points(self.shops),
            self._parts(metric, footprints),
        )

    def _parts(self, metric: "_Metric", footprints: Shapes) -> BuildingParts | None:
        """Parts of the buildings, with the tags of theirs that hold for them, too."""
        if not self.parts:
            return None
        shapes = metric.shapes([shape for shape, _ in self.parts])
        outlines = _outlines_of(shapes, footprints)
        tags = []
        for (_, own), outline in zip(self.parts, outlines.tolist(), strict=True):
            of = self.buildings[outline][1] if outline >= 0 else {}
            keys = [*_INHERITED]
            if not {"height", "building:levels"} & {*own}:
                keys += ["height", "building:levels"]
            given = {key: of[key] for key in keys if key in of}
            if own["building:part"] != "yes" or "building" not in given:
                given["building"] = own["building:part"]
            # A part without a roof has a level one: the page of the scheme draws it so.
            tags.append({"roof:shape": "flat", **given, **own})
        return BuildingParts(_houses(shapes, tags, [""] * len(tags)), outlines)


class _Metric:
    """Projection from degrees to metres."""

    def __init__(self, crs: str) -> None:
        self._transform = Transformer.from_crs(4326, crs, always_xy=True).transform

    def shapes(self, shapes: Sequence[shapely.Geometry] | Shapes) -> Shapes:
        """Projects geometries."""
        projected: Shapes = shapely.transform(np.array(shapes, object), self._points)
        return projected

    def points(self, places: Sequence[tuple[float, float]]) -> FloatArray:
        """Projects places; N x 2."""
        return self._points(np.array(places, float).reshape(-1, 2))

    def _points(self, places: FloatArray) -> FloatArray:
        return np.column_stack(self._transform(*places.T))


def _is_building(tags: Mapping[str, str]) -> bool:
    return tags.get("building", "no") != "no"


def _is_part(tags: Mapping[str, str]) -> bool:
    return tags.get("building:part", "no") != "no"


def has_body(tags: Mapping[str, str]) -> bool:
    """True for a building or a part of one."""
    return _is_building(tags) or _is_part(tags)


def _outlines_of(parts: Shapes, footprints: Shapes) -> IntArray:
    """Number of the building that holds most of each part; -1 where none holds half of it."""
    owners = np.full(len(parts), -1)
    part, building = shapely.STRtree(footprints).query(parts, predicate="intersects")
    shared = shapely.area(shapely.intersection(parts[part], footprints[building]))
    order = np.argsort(shared, kind="stable")
    order = order[shared[order] >= _SHARED * shapely.area(parts[part[order]])]
    owners[part[order]] = building[order]
    return owners


def _houses(footprints: Shapes, tags: Sequence[Mapping[str, str]], landuse: list[str]) -> Houses:
    heights, bottoms, storeys = _levels(tags)

    def known(key: str, names: Mapping[str, str]) -> np.ndarray:
        return np.array([names.get(tag.get(key, ""), "") for tag in tags], np.str_)

    return Houses(
        footprints,
        heights,
        storeys,
        np.array([tag["building"] for tag in tags], np.str_),
        np.array(landuse, np.str_),
        known("roof:shape", ROOFS),
        known("building:material", MATERIALS),
        known("roof:material", MATERIALS),
        bottoms,
        np.array([_number(tag, "roof:height") for tag in tags]),
    )


def _levels(tags: Sequence[Mapping[str, str]]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Top and underside above the ground, metres, and storeys between them.

    A body that begins above the ground gets a height in any case, so that its top is known.
    """
    keys = ("height", "building:levels", "roof:height", "min_height", "building:min_level")
    height, levels, roof, low, skipped = (
        np.array([_number(tag, key) for tag in tags]) for key in keys
    )
    rise = np.nan_to_num(roof)
    storey = np.clip(np.nan_to_num((height - rise) / levels, nan=_STOREY), 2.0, 10.0)
    bottom = np.nan_to_num(np.where(np.isfinite(low), low, skipped * storey))
    by_levels = np.fmax(levels * storey, bottom + storey) + rise
    by_levels = np.where(np.isfinite(levels), by_levels, bottom + storey + rise)
    top = np.where((bottom > 0.0) & np.isnan(height), by_levels, height)
    below = np.where(np.isfinite(skipped), skipped, np.round(bottom / storey))
    return top, bottom, np.where(levels > below, levels - below, np.where(bottom, np.nan, levels))


def _landuse(
    footprints: Shapes, tags: Sequence[Mapping[str, str]], land: Shapes, uses: Sequence[str]
) -> list[str]:
    """Landuse of each building: of its kind, else of the smallest area around its centroid."""
    found = [landuse_of_kind(tag["building"]) for tag in tags]
    order = np.argsort(-shapely.area(land))
    inside = shapely.STRtree(land[order]).query(shapely.centroid(footprints), "within")
    around: dict[int, str] = {}
    for house, area in sorted(inside.T.tolist()):
        around[house] = uses[order[area]]
    return [kind or around.get(number, "") for number, kind in enumerate(found)]


def _streets(
    lines: Shapes, streets: Sequence[tuple[shapely.Geometry, Mapping[str, str]]]
) -> Streets:
    tags = [tag for _, tag in streets]
    stated = np.array([_number(tag, "width") for tag in tags])
    lanes = np.array([_number(tag, "lanes") for tag in tags])
    usual = np.array([STREETS[tag["highway"]] for tag in tags])
    by_lanes = np.where(np.isfinite(lanes), lanes * LANE, usual)
    return Streets(
        lines,
        np.where(np.isfinite(stated), stated, by_lanes),
        np.isfinite(stated),
        lanes,
        np.array([_sidewalk(tag) for tag in tags]),
    )


def _sidewalk(tags: Mapping[str, str]) -> float:
    """Width of a street's sidewalk, metres; 0 without, NaN where nothing is said."""
    for key in ("sidewalk:both:width", "sidewalk:left:width", "sidewalk:right:width"):
        if key in tags:
            return _number({"width": tags[key]}, "width")
    said = tags.get("sidewalk", tags.get("sidewalk:both", ""))
    return {"no": 0.0, "none": 0.0, "both": SIDEWALK, "yes": SIDEWALK}.get(said, float("nan"))


def _number(tags: Mapping[str, str], key: str) -> float:
    """Number of a tag, e.g. of ``12.5 m``; NaN without one, and for implausible ones."""
    found = _FIRST_NUMBER.match(tags.get(key, ""))
    value = float(found[1].replace(",", ".")) if found else 0.0
    return value if 0.0 < value <= _GREATEST[key] else float("nan")

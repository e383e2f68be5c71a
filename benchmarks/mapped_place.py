"""Holds environments of `build --osm` against their maps.

    python benchmarks/mapped_place.py FOLDER EXTRACT [FOLDER EXTRACT ...]

The map's buildings are read from the extract by libosmium alone. Each building of the environment
has to stand within 0.5 m of one of them; no building, tree or piece of furniture stands on a
carriageway, no generated enclosure on any part of a road, and neither a road nor any part of a
carriageway that is wider than 6 cm is steeper than 15 %. Exit code 1 if any does.
"""

import re
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import osmium
import shapely
from osmium.osm import Area
from pyproj import Transformer

from envgen_usd.city.footprints import footprint_of
from envgen_usd.citygml.read import read_city
from envgen_usd.landuse.landuse_geotiff import read_landuse_map
from envgen_usd.landuse.shape_cells import cells_of_shapes
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.places.osm_tags import RESIDENTIAL_KINDS
from envgen_usd.recipe.map_land import read_road

AWAY = 0.5
"""Largest distance of a building from the map's, metres."""
STEEPEST = 0.15
SLIVER = 0.06
"""Width of a triangle up to which its slope does not count, metres."""
BESIDE = frozenset({"sidewalk", "walking", "border", "none", "median", "curb"})
"""Types of lanes that are no carriageway."""
HOMES = frozenset({"yes", "farm", *RESIDENTIAL_KINDS})
"""Values of ``building`` of homes and of buildings of unknown use."""
ENCLOSURE = re.compile(r"(fence|hedge|wall|gate)_plot_.*")
"""Ids of generated enclosures."""
WIDTHS = {"hedge": 0.5, "wall": 0.2}
"""Widths of the bodies of enclosures, metres."""
EMBEDDED = frozenset({"gully"})
"""What lies in the road."""


@dataclass(frozen=True)
class Held:
    """What the comparison shows.

    Attributes:
        buildings: Number of buildings of the environment.
        of_map: Number of buildings of the map within the land.
        without: Buildings of the map on whose middle none stands.
        farthest: Largest distance of a wall from the map's outline, metres.
        far: Ids of buildings farther than `AWAY`.
        on_road: Number of each kind of object on a carriageway.
        slope: Steepest slope of a road.
        surface_slope: Steepest slope of a carriageway, also in junctions and beside bends.
        carriageway: Its area in plan, m².
        plots: Number of plots that are generated around houses.
        homes: Homes of the map by their tags on the land, and how many of them stand on a plot.
        enclosures: Length of generated fences, hedges and walls, metres.
        gates: Number of gates in them.
        enclosures_on_road: Number of their pieces on a road or sidewalk.
    """

    buildings: int
    of_map: int
    without: int
    farthest: float
    far: tuple[str, ...]
    on_road: Counter[str]
    slope: float
    surface_slope: float
    carriageway: float
    plots: int
    homes: tuple[int, int]
    enclosures: float
    gates: int
    enclosures_on_road: int

    def __bool__(self) -> bool:
        """True if the environment departs from the map."""
        steep = max(self.slope, self.surface_slope) > STEEPEST
        return bool(self.far) or self.on_road.total() + self.enclosures_on_road > 0 or steep


def map_buildings(
    extract: Path, crs: str, kinds: frozenset[str] = frozenset()
) -> list[shapely.Geometry]:
    """Outlines of the buildings of an extract in a reference system, all or those of some kinds."""
    factory, found = osmium.geom.WKBFactory(), []
    for item in osmium.FileProcessor(str(extract)).with_areas():
        kind = item.tags.get("building", "no")
        if isinstance(item, Area) and kind != "no" and (not kinds or kind in kinds):
            found.append(shapely.from_wkb(factory.create_multipolygon(item)))
    move = Transformer.from_crs(4326, crs, always_xy=True).transform
    return [shapely.transform(shape, lambda p: np.column_stack(move(*p.T))) for shape in found]


def plan_of(building: CityObject) -> shapely.Geometry:
    """The ground that a building's walls enclose."""
    grounds = [
        polygons.rings(n)
        for part in (building, *building.children)
        for surface in part.surfaces
        if surface.kind == "GroundSurface"
        for polygons in (surface.polygons,)
        for n in range(len(polygons))
    ]
    shapes = [shapely.Polygon(r[0][:, :2], [hole[:, :2] for hole in r[1:]]) for r in grounds]
    return shapely.union_all(shapely.make_valid(shapes))


def carriageway(surface: RoadSurface, beside: frozenset[str] = BESIDE) -> shapely.STRtree:
    """Triangles of the road that vehicles drive on, all without the types of lanes beside."""
    shapes = shapely.polygons(driven_triangles(surface, beside)[:, :, :2])
    return shapely.STRtree(shapes[shapely.area(shapes) > 1e-6])


def driven_triangles(surface: RoadSurface, beside: frozenset[str] = BESIDE) -> FloatArray:
    """Triangles of the road that vehicles drive on, T x 3 x 3, metres."""
    driven = np.array(
        [patch.lane_type not in beside and patch.kind != "kerb" for patch in surface.patches]
    )
    return surface.vertices[surface.triangles[driven[surface.triangle_patch]]]


def surface_slope(triangles: FloatArray) -> tuple[float, float]:
    """Steepest slope of triangles that are no slivers, and the area of all in plan."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    up = np.abs(normal[:, 2])
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(1)
    wide = up > SLIVER * longest
    slopes = np.hypot(normal[wide, 0], normal[wide, 1]) / up[wide]
    return float(slopes.max(initial=0.0)), float(0.5 * up.sum())


def road_slope(surface: RoadSurface) -> float:
    """Steepest slope of the reference lines."""
    return max(
        float(np.abs(np.diff(r.points[:, 2]) / np.maximum(np.diff(r.s), 1e-6)).max())
        for r in surface.roads
        if len(r.s) > 1
    )


def hold(folder: Path, extract: Path) -> Held:
    """Compares an environment with its map."""
    _, surface = read_road(folder / "road.xodr", 0.02)
    outlines = np.array(map_buildings(extract, surface.crs), object)
    tree, road = shapely.STRtree(outlines), carriageway(surface)
    whole = carriageway(surface, frozenset())
    features = [
        feature
        for path in sorted(folder.glob("chunks/*/city.gml"))
        for feature in read_city(path).objects
    ]
    plans = {f.id: plan_of(f) for f in features if f.kind == "Building"}
    distances = {name: _from_map(plan, tree, whole) for name, plan in plans.items()}
    standing = shapely.STRtree(list(plans.values()))
    land = shapely.union_all([p.buffer(1.0) for p in plans.values()]).convex_hull
    inside = [o for o in outlines if land.contains(o.representative_point())]
    without = sum(
        not len(standing.query(o.representative_point(), predicate="intersects")) for o in inside
    )
    on_road = _on_road(features, plans, road)
    slope = road_slope(surface)
    far = tuple(name for name, away in distances.items() if away > AWAY)
    known = [away for away in distances.values() if np.isfinite(away)]
    steep, area = surface_slope(driven_triangles(surface))
    homes = [o for o in map_buildings(extract, surface.crs, HOMES) if land.contains(o)]
    plots, with_plot = plots_of_homes(folder, homes)
    made = [f for f in features if ENCLOSURE.fullmatch(f.id)]
    return Held(
        len(plans),
        len(inside),
        without,
        max(known, default=0.0),
        far,
        on_road,
        slope,
        steep,
        area,
        plots,
        (len(homes), with_plot),
        sum(map(enclosure_length, made)),
        sum(f.id.startswith("gate") for f in made),
        sum(bool(len(whole.query(footprint_of(f), predicate="intersects"))) for f in made),
    )


def plots_of_homes(folder: Path, homes: Sequence[shapely.Geometry]) -> tuple[int, int]:
    """Number of plots with homes, and of homes most of whose cells lie on one, by the landuse."""
    maps = [read_landuse_map(path) for path in sorted(folder.glob("chunks/*/landuse.tif"))]
    numbers: dict[int, Counter[int]] = {}
    for each in maps:
        pairs = ((home, n + 1) for n, home in enumerate(homes))
        cells = cells_of_shapes(each.chunk, pairs)
        inside = cells > 0
        for home, plot in zip(cells[inside].tolist(), each.plots[inside].tolist(), strict=True):
            numbers.setdefault(home, Counter())[plot] += 1
    main = [counts.most_common(1)[0][0] for counts in numbers.values()]
    return len({plot for plot in main if plot}), sum(plot > 0 for plot in main)


def enclosure_length(feature: CityObject) -> float:
    """Length of a piece of an enclosure without gates, metres."""
    if feature.placement is not None:
        return 0.0 if feature.id.startswith("gate") else float(feature.placement.size[1])
    return float(footprint_of(feature).area) / WIDTHS[feature.id.split("_", 1)[0]]


def _from_map(plan: shapely.Geometry, tree: shapely.STRtree, road: shapely.STRtree) -> float:
    """Largest distance of a building's corners from its outline on the map, infinite without."""
    near = tree.geometries[tree.query(plan, predicate="intersects")]
    if not len(near):
        return float(np.inf)
    own = int(np.argmax(shapely.area(shapely.intersection(near, plan))))
    edge = shapely.points(shapely.get_coordinates(plan))
    away = shapely.distance(edge, near[own].boundary)
    # Where roads and other buildings cut it, its corners lie within the outline.
    _, beside = road.query_nearest(edge, return_distance=True, all_matches=False)
    others = shapely.union_all(np.delete(near, own))
    cut = (beside < AWAY) | (shapely.distance(edge, others) < AWAY)
    within = shapely.intersects(near[own], edge)
    return float(np.where(cut & within, 0.0, away).max())


def _on_road(
    features: Sequence[CityObject], plans: Mapping[str, shapely.Geometry], road: shapely.STRtree
) -> Counter[str]:
    """How many objects of each kind stand on a carriageway."""
    found: Counter[str] = Counter()
    for feature in features:
        template = feature.placement.template if feature.placement else feature.kind
        if feature.kind in {"Building", "SolitaryVegetationObject", "CityFurniture"}:
            shape = plans.get(feature.id) or footprint_of(feature)
            if feature.placement is not None:
                shape = shapely.Point(feature.placement.position[:2])
            hit = road.query(shape, predicate="intersects")
            if template not in EMBEDDED and len(hit):
                found[template] += 1
    return found


def main() -> int:
    """Prints what each environment shows."""
    pairs, faults = sys.argv[1:], 0
    for folder, extract in zip(pairs[::2], pairs[1::2], strict=True):
        held = hold(Path(folder), Path(extract))
        print(f"{folder}: {held}")
        faults += bool(held)
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())

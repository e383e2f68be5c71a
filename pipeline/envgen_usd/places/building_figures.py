"""Measures the buildings of a place: sizes, and how they stand to streets and to neighbours.

Real and generated places are measured alike, from footprints, storeys and streets alone. What a
figure means:

1. A main building is large enough and of no ancillary kind (`osm_tags.ANCILLARY`).
2. Streets are cut where they meet. A building at a street has a carriageway within `FARTHEST` of
   its wall, and no other main building on the way.
3. The setback leads from the carriageway to the wall; the gap to the next building along the
   street and on its side; the plot reaches half-way to what lies beside and behind.
4. The coverage is the footprint's share of the land that is nearer to it than to other main
   buildings, without carriageways, within `TERRITORY` of its walls (Voronoi cells, as where no
   parcels are known).
"""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.place import Houses, Place, Shapes, Streets
from envgen_usd.places.osm_tags import ANCILLARY

LEAST_AREA = 30.0
"""Least footprint of a main building, m²; a larger value leaves out more sheds."""
FARTHEST = 30.0
"""Longest way from a street to a building that stands at it, metres."""
WIDEST_GAP = 60.0
"""Longest distance of neighbours along a street, metres."""
HALF_GAP = 8.0
"""Most land beside a building that belongs to its plot, metres."""
END_GAP = 3.0
"""Land of a plot beside a building without a neighbour, metres."""
BEHIND = 35.0
"""Most land behind a building that belongs to its plot, metres."""
TERRITORY = 25.0
"""Farthest land that may belong to a building, metres from its walls."""
TOUCHING = 0.3
"""Gap of buildings that count as wall to wall, metres."""
STOREY = 3.0
"""Height of a storey where a building's height is unknown, metres."""
_CROSSED = 0.5
"""Length in another building from which a way to the street is blocked, metres."""
_EDGE = 4.0
"""Distance between points on walls from which cells are drawn, metres."""
_LATTICE = 0.5
"""Lattice of the points from which cells are drawn, metres: nearly coincident ones break GEOS."""
_SIMPLE = 0.2
"""Largest move of a wall by which footprints are simplified for cells, metres."""


@dataclass(frozen=True)
class BuildingFigures:
    """Figures of the main buildings of a place.

    Figures of a building that it does not have are NaN, such as the setback far from streets.

    Attributes:
        houses: The main buildings, B.
        area: B, footprint, m².
        width: B, along the street, metres; width times depth is the area.
        depth: B, away from the street, metres.
        fill: B, footprint as a share of the rectangle around it.
        height: B, metres: the known height, else storeys times `STOREY`.
        coverage: B, footprint as a share of its cell.
        setback: B, from the carriageway to the wall, metres.
        frontage: B, width of the plot along the street, metres.
        plot_depth: B, from the carriageway to the plot's back, metres.
        side_gap: B, half of the smaller gap beside the building, metres.
        gaps: G, metres between neighbours along a street.
        groups: R, numbers of buildings with at most `HALF_GAP` of land each between them.
    """

    houses: Houses
    area: FloatArray
    width: FloatArray
    depth: FloatArray
    fill: FloatArray
    height: FloatArray
    coverage: FloatArray
    setback: FloatArray
    frontage: FloatArray
    plot_depth: FloatArray
    side_gap: FloatArray
    gaps: FloatArray
    groups: FloatArray

    @property
    def at_street(self) -> BoolArray:
        """True for the buildings at a street."""
        return np.isfinite(self.setback)


def measure(place: Place, landuse: str = "") -> BuildingFigures:
    """Measures the main buildings of a place.

    Args:
        place: Real or generated place.
        landuse: ``residential`` or ``industrial`` keeps the figures of these buildings; others
            still are their neighbours. Empty keeps all.
    """
    houses = main_buildings(place.houses)
    edges, widths = street_edges(place.streets)
    fronts = _fronts(houses.footprints, edges, widths)
    rectangles = _rectangles(houses.footprints, fronts.along)
    area = shapely.area(houses.footprints)
    around = np.prod(rectangles, axis=1)
    fill = area / np.where(around > 0.0, around, 1.0)
    width, depth = (rectangles * np.sqrt(fill)[:, None]).T
    beside, gaps, groups = _neighbours(houses.footprints, fronts)
    frontage = rectangles[:, 0] + np.minimum(beside, HALF_GAP).sum(axis=1)
    behind = _behind(houses.footprints, fronts, edges, widths)
    wanted = np.ones(len(houses), bool) if not landuse else houses.landuse == landuse
    kept_gaps = gaps[wanted[gaps[:, 0].astype(int)], 1]
    height = np.where(np.isfinite(houses.heights), houses.heights, houses.storeys * STOREY)
    outside = ~np.isfinite(fronts.setback)
    frontage[outside] = np.nan
    coverage = area / _cells(houses.footprints, edges, widths)
    return BuildingFigures(
        houses=houses.take(wanted),
        area=area[wanted],
        width=width[wanted],
        depth=depth[wanted],
        fill=fill[wanted],
        height=height[wanted],
        coverage=coverage[wanted],
        setback=fronts.setback[wanted],
        frontage=frontage[wanted],
        plot_depth=(fronts.setback + rectangles[:, 1] + behind)[wanted],
        side_gap=np.where(outside, np.nan, np.minimum(beside.min(axis=1), HALF_GAP))[wanted],
        gaps=kept_gaps,
        groups=groups,
    )


def main_buildings(houses: Houses) -> Houses:
    """The main buildings; see rule 1."""
    is_main = shapely.area(houses.footprints) >= LEAST_AREA
    return houses.take(is_main & ~np.isin(houses.kinds, sorted(ANCILLARY)))


def street_edges(streets: Streets) -> tuple[Shapes, FloatArray]:
    """Streets between places where they meet: E lines, and their widths in metres."""
    if not len(streets):
        return np.empty(0, object), np.empty(0)
    noded = shapely.line_merge(shapely.union_all(streets.lines))
    edges = shapely.get_parts(noded)
    middles = shapely.line_interpolate_point(edges, 0.5, normalized=True)
    nearest = shapely.STRtree(streets.lines).nearest(middles)
    return edges, streets.widths[nearest]


@dataclass(frozen=True)
class _Fronts:
    """How B buildings stand to their nearest street.

    Attributes:
        edge: B, index of the street, -1 without.
        setback: B, metres, NaN without a street.
        side: B, 1 to the left of the street, -1 to the right.
        s: B, arc length of the building's middle along the street, metres.
        along: B x 2, unit direction of the street, (1, 0) without.
    """

    edge: IntArray
    setback: FloatArray
    side: FloatArray
    s: FloatArray
    along: FloatArray


def _fronts(footprints: Shapes, edges: Shapes, widths: FloatArray) -> _Fronts:
    count = len(footprints)
    edge, setback = np.full(count, -1), np.full(count, np.nan)
    side, s, along = np.ones(count), np.zeros(count), np.tile([1.0, 0.0], (count, 1))
    if not len(edges) or not count:
        return _Fronts(edge, setback, side, s, along)
    reach = FARTHEST + widths.max() / 2.0
    house, street = shapely.STRtree(edges).query(footprints, "dwithin", distance=reach)
    away = shapely.distance(footprints[house], edges[street]) - widths[street] / 2.0
    order = np.lexsort((away, house))
    house, street, away = house[order], street[order], away[order]
    first = np.concatenate([[True], np.diff(house) > 0]) if len(house) else np.empty(0, bool)
    house, street, away = house[first], street[first], away[first]
    way = shapely.shortest_line(footprints[house], edges[street])
    of, other = shapely.STRtree(footprints).query(way, "intersects")
    # Neighbours wall to wall touch the way in a point, their common corner.
    inside = shapely.length(shapely.intersection(way[of], footprints[other]))
    crossed = (other != house[of]) & (inside > _CROSSED)
    blocked = np.isin(np.arange(len(way)), of[crossed])
    seen = ~blocked & (away <= FARTHEST)
    house, street, away = house[seen], street[seen], away[seen]
    middle = shapely.centroid(footprints[house])
    place = shapely.line_locate_point(edges[street], middle)
    ends = [
        shapely.get_coordinates(
            shapely.line_interpolate_point(
                edges[street], np.clip(place + step, 0.0, shapely.length(edges[street]))
            )
        )
        for step in (-1.0, 0.0, 1.0)
    ]
    direction = ends[2] - ends[0]
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-9)
    to_house = shapely.get_coordinates(middle) - ends[1]
    turn = direction[:, 0] * to_house[:, 1] - direction[:, 1] * to_house[:, 0]
    edge[house], setback[house], s[house], along[house] = (
        street,
        np.maximum(away, 0),
        place,
        direction,
    )
    side[house] = np.where(turn >= 0.0, 1.0, -1.0)
    return _Fronts(edge, setback, side, s, along)


def _rectangles(footprints: Shapes, along: FloatArray) -> FloatArray:
    """Sides of the least rectangle around each footprint, B x 2: first that along the street."""
    corners = shapely.get_coordinates(shapely.oriented_envelope(footprints)).reshape(-1, 5, 2)
    sides = corners[:, 1:3] - corners[:, :2]
    lengths: FloatArray = np.linalg.norm(sides, axis=2)
    facing = np.abs(np.einsum("bsc,bc->bs", sides, along)) / np.maximum(lengths, 1e-9)
    turned = facing[:, 1] > facing[:, 0]
    lengths[turned] = lengths[turned][:, ::-1]
    return lengths


def _neighbours(footprints: Shapes, fronts: _Fronts) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Land beside buildings.

    Returns:
        B x 2, half of the gap before and after, `END_GAP` without a neighbour; G x 2, building and
        gap to the next; sizes of groups.
    """
    beside = np.full((len(footprints), 2), END_GAP)
    placed = np.flatnonzero(fronts.edge >= 0)
    order = placed[np.lexsort((fronts.s[placed], fronts.side[placed], fronts.edge[placed]))]
    first, second = order[:-1], order[1:]
    same = (fronts.edge[first] == fronts.edge[second]) & (fronts.side[first] == fronts.side[second])
    gap = shapely.distance(footprints[first], footprints[second])
    beside[first[same], 1] = beside[second[same], 0] = gap[same] / 2.0
    near = same & (gap <= WIDEST_GAP)
    breaks = np.flatnonzero(~(same & (gap <= 2.0 * HALF_GAP)))
    groups = np.diff(np.concatenate([[-1], breaks, [len(order) - 1]])) if len(order) else breaks
    return beside, np.column_stack([first[near], gap[near]]), groups.astype(float)


def _behind(footprints: Shapes, fronts: _Fronts, edges: Shapes, widths: FloatArray) -> FloatArray:
    """Half of the land behind each building, or all of it up to a street, metres."""
    behind: FloatArray = np.full(len(footprints), np.nan)
    placed = np.flatnonzero(fronts.edge >= 0)
    if not len(placed):
        return behind
    into = fronts.side[placed, None] * np.stack(
        [-fronts.along[placed, 1], fronts.along[placed, 0]], axis=1
    )
    middle = shapely.get_coordinates(shapely.centroid(footprints[placed]))
    rays = shapely.linestrings(np.stack([middle, middle + 200.0 * into], axis=1))
    start = shapely.length(shapely.intersection(rays, footprints[placed]))
    land = np.full(len(placed), 2.0 * BEHIND)
    for shapes, share, half in ((footprints, 1.0, None), (edges, 2.0, widths / 2.0)):
        ray, hit = shapely.STRtree(shapes).query(rays, "intersects")
        other = np.ones(len(ray), bool) if half is not None else hit != placed[ray]
        ray, hit = ray[other], hit[other]
        points = shapely.points(middle[ray])
        away = shapely.distance(points, shapely.intersection(rays[ray], shapes[hit]))
        away = away - start[ray] - (half[hit] if half is not None else 0.0)
        np.minimum.at(land, ray, share * np.maximum(away, 0.0))
    behind[placed] = np.minimum(land / 2.0, BEHIND)
    return behind


def _cells(footprints: Shapes, edges: Shapes, widths: FloatArray) -> FloatArray:
    """Area of the cell of each building, m²; see rule 4."""
    land = shapely.buffer(footprints, TERRITORY)
    paved = shapely.buffer(edges, widths / 2.0, cap_style="flat")
    house, street = shapely.STRtree(paved).query(land, "intersects")
    for number in np.unique(house).tolist():
        roads = shapely.union_all(paved[street[house == number]])
        land[number] = shapely.difference(land[number], roads)
    area: FloatArray = shapely.area(footprints)
    if len(footprints) < 2:
        alone: FloatArray = np.maximum(shapely.area(land), area)
        return alone
    simple = shapely.segmentize(shapely.simplify(footprints, _SIMPLE), _EDGE)
    points, of = shapely.get_coordinates(simple, return_index=True)
    points, kept = np.unique(np.round(points / _LATTICE) * _LATTICE, axis=0, return_index=True)
    cells = shapely.get_parts(shapely.voronoi_polygons(shapely.multipoints(points), ordered=True))
    # A building's cell is the union of its points' cells, which share only borders.
    parts = shapely.area(shapely.intersection(cells, land[of[kept]]))
    return np.maximum(np.bincount(of[kept], parts, len(footprints)), area)

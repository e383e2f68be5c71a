"""What a map has on the land: trees, lamps and furniture, hedges, fences, walls, railways."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from scipy.spatial import cKDTree

from envgen_usd.chunks import Chunk, chunk_at, snap
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.headings import heading_of
from envgen_usd.city.plots.enclosures import enclosure_body, spaced_line, without_stubs
from envgen_usd.city.plots.fence_panels import fence_panels
from envgen_usd.city.plots.harbour_cranes import FUNCTION as CRANE_FUNCTION
from envgen_usd.city.plots.harbour_cranes import TEMPLATE as CRANE
from envgen_usd.city.plots.harbour_cranes import design_at
from envgen_usd.city.plots.railways import railway
from envgen_usd.city.plots.squares import FUNCTIONS as SQUARE_FUNCTIONS
from envgen_usd.city.plots.street_furniture import FUNCTIONS
from envgen_usd.city.plots.street_lights import FUNCTION as LIGHT_FUNCTION
from envgen_usd.city.plots.trees import TRUNK, house_distances, tree_feature
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.place import Shapes
from envgen_usd.models.street_plan import MapLine, StreetPoint
from envgen_usd.seeds import Draws

_WORDS = {
    "tree": "trees",
    "lamp": "lamps",
    "bench": "benches",
    "bin": "bins",
    "mailbox": "post boxes",
    "phone_box": "telephones",
    "bicycle_rack": "bicycle stands",
    "hydrant": "hydrants",
    "bollard": "bollards",
    "fountain": "fountains",
    "monument": "monuments",
    "crane": "cranes",
}
"""Names of the kinds of points in messages."""
CODES = {**FUNCTIONS, **SQUARE_FUNCTIONS, CRANE: CRANE_FUNCTION}
"""Code of the SIG3D list CityFurniture_function of each template."""
_CLEARANCE = 0.15
"""Least distance of lines from houses and roads, metres; a larger value shortens them."""
_LEAST_LENGTH = 0.8
"""Least length of a piece of a line, metres."""
_STEP = 3.0
"""Distance of heights along hedges and walls, metres."""
_ON_LINE = 0.5
"""Farthest gate from its line, metres."""
_GATE = 3.0
"""Width of the gap at a gate, metres."""
_TRUNK_ROOM = 0.6
"""Least distance of a trunk from a wall, metres."""
_CRANE_ROOM = 3.6
"""Least distance of the middle of a crane's portal from a wall, metres."""
_AT_QUAY = 60.0
"""Farthest water that a crane looks at, metres."""


@dataclass(frozen=True, eq=False)
class MapLand:
    """The land that objects of a map stand on.

    Attributes:
        ground: Heights.
        chunks: Its tiles.
        road: Triangles of the road in plan, T x 3 x 2.
        lines: Points of the reference lines of roads, N x 2, at least one; furniture looks at them.
        houses: Footprints of buildings.
        water: Places in water, N x 2, metres; cranes look at it.
    """

    ground: Ground
    chunks: frozenset[Chunk]
    road: FloatArray
    lines: FloatArray
    houses: tuple[shapely.Geometry, ...]
    water: FloatArray = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True)
class MappedObjects:
    """Objects of a map on the land.

    Attributes:
        objects: Features with the chunk that each belongs to.
        issues: What stands there, and what was left out.
    """

    objects: tuple[tuple[Chunk, CityObject], ...]
    issues: tuple[Issue, ...]


def make_mapped_objects(  # noqa: PLR0913, PLR0917 - what objects follow from
    points: Sequence[StreetPoint],
    lines: Sequence[MapLine],
    gates: Sequence[StreetPoint],
    land: MapLand,
    profile: Profile,
    seed: int,
    source: str = "",
) -> MappedObjects:
    """Sets objects of a map onto the ground.

    Args:
        points: Trees, lamps and furniture beyond the borders of roads.
        lines: Hedges, fences, walls and railways; roads and houses cut them.
        gates: Gates, which leave gaps in lines.
        land: What they stand on.
        profile: The environment; gives the sizes that the map lacks.
        seed: The user's seed.
        source: Name of the map, for messages.
    """
    roads = shapely.STRtree(shapely.polygons(land.road) if len(land.road) else [])
    site = _Site(land, roads, profile, seed)
    used: Counter[str] = Counter()
    found = [*_points(points, site), *_lines(lines, gates, site)]
    placed = []
    for kind, chunk, features in found:
        if chunk in land.chunks:
            used[kind] += len(features)
            placed += [(chunk, feature) for feature in features]
        else:
            site.lost["beyond the land around the roads"] += 1
    return MappedObjects(tuple(placed), tuple(_issues(used, site.lost, source)))


@dataclass(frozen=True)
class _Site:
    """What all objects of a map follow from, and how many were left out for what reason."""

    land: MapLand
    roads: shapely.STRtree
    profile: Profile
    seed: int
    lost: Counter[str] = field(default_factory=Counter)

    def draws(self, *names: str | int) -> Draws:
        """Draws of an object."""
        return Draws(self.seed, "city", "map", *names)


_Made = tuple[str, Chunk, Sequence[CityObject]]
"""Name in messages, chunk, and features."""


def _points(points: Sequence[StreetPoint], site: _Site) -> Iterator[_Made]:
    if not points:
        return
    land = site.land
    places = snap(np.array([point.place for point in points]))
    positions = np.column_stack([places, snap(land.ground.heights(places))])
    room = house_distances(places, land.houses)
    on_road = np.zeros(len(points), bool)
    on_road[site.roads.query(shapely.points(places), predicate="intersects")[0]] = True
    streets = land.lines[np.asarray(cKDTree(land.lines).query(places)[1])]
    away, number = map(np.asarray, cKDTree(land.water).query(places, distance_upper_bound=_AT_QUAY))
    for n, point in enumerate(points):
        draws = site.draws(point.kind, n)
        least = {"tree": _TRUNK_ROOM, "crane": _CRANE_ROOM}.get(point.kind, 0.1)
        if on_road[n] or room[n] < least:
            site.lost["on a road" if on_road[n] else "in a building"] += 1
            continue
        name = f"map_{point.kind}_{n}"
        if point.kind == "tree":
            feature = _tree(name, positions[n], float(room[n]), site.profile, draws)
        else:
            is_at_quay = point.kind == "crane" and np.isfinite(away[n])
            seen = land.water[number[n]] if is_at_quay else streets[n]
            heading = heading_of(seen - places[n])
            feature = _furniture(name, point.kind, positions[n], heading, site.profile, draws)
            if point.kind == "crane":
                design = design_at(float(away[n]), site.profile, draws)
                feature = replace(feature, attributes={**feature.attributes, "design": design})
        yield _WORDS[point.kind], chunk_at(places[n]), (feature,)


def _tree(
    name: str, position: FloatArray, room: float, profile: Profile, draws: Draws
) -> CityObject:
    rules = profile.trees
    share = draws.within("crown", rules.crown)
    # The crown of a tree beside a house ends at the wall.
    tall = min(draws.within("height", rules.height), 2.0 * room / share)
    trunk = tall * draws.within("trunk", TRUNK)
    turn = draws.within("turn", (-np.pi, np.pi))
    return tree_feature(name, "tree", position, np.array([tall, tall * share, trunk]), turn)


def _furniture(  # noqa: PLR0913, PLR0917 - what furniture follows from
    name: str, kind: str, position: FloatArray, heading: float, profile: Profile, draws: Draws
) -> CityObject:
    template, function, height = kind, CODES.get(kind, ""), 0.0
    if kind == "lamp":
        template, function = "street_light", LIGHT_FUNCTION
        height = draws.within("height", profile.street_lights.height)
    size = np.array([0.0, 0.0, round(height, 2)])
    facts = {"class": "1000", "function": function}
    placement = Placement(position, heading, size, template)
    return CityObject(name, "CityFurniture", facts, placement=placement)


def _lines(lines: Sequence[MapLine], gates: Sequence[StreetPoint], site: _Site) -> Iterator[_Made]:
    houses, ground = Footprints(site.land.houses), site.land.ground
    openings = shapely.points(np.array([gate.place for gate in gates]).reshape(-1, 2))
    rules = site.profile.enclosures
    materials = {str(kind): weights for kind, weights in rules.materials.items()}
    for number, each in enumerate(lines):
        draws = site.draws(each.kind, "line", number)
        height = round(
            each.height if np.isfinite(each.height) else draws.within("height", rules.height), 2
        )
        material = draws.choice("material", materials.get(each.kind, {"concrete": 1.0}))
        free = _free(shapely.LineString(each.line), openings, site.roads, houses)
        if free.is_empty:
            site.lost["on roads or in buildings"] += 1
        for chunk, parts in _by_chunk(free):
            name = f"map_{number}_{chunk.prim_name}"
            if each.kind == "rail":
                yield "pieces of railways", chunk, railway(name, parts, ground)
            elif each.kind == "fence":
                yield "panels of fences", chunk, fence_panels(name, parts, height, ground)
            else:
                body = enclosure_body(
                    f"{each.kind}_{name}", each.kind, height, material, parts, ground
                )
                yield f"pieces of {each.kind}s", chunk, (body,)


def _free(
    line: shapely.LineString, openings: Shapes, roads: shapely.STRtree, houses: Footprints
) -> shapely.Geometry:
    """A line without what lies on roads, in houses and at gates."""
    near = line.buffer(_CLEARANCE)
    hit = roads.geometries[roads.query(near, predicate="intersects")]
    taken = [shapely.union_all(hit).buffer(_CLEARANCE), *houses.grown(near, _CLEARANCE)]
    own = openings[shapely.distance(openings, line) < _ON_LINE] if len(openings) else []
    taken += [gate.buffer(_GATE / 2.0) for gate in own]
    return shapely.difference(line, shapely.union_all(taken))


def _by_chunk(line: shapely.Geometry) -> Iterator[tuple[Chunk, list[FloatArray]]]:
    """The pieces of a line in each chunk that it runs through, N_i x 2."""
    if line.is_empty:
        return
    west, south, east, north = line.bounds
    first, last = chunk_at(np.array([west, south])), chunk_at(np.array([east, north]))
    for x in range(first.x, last.x + 1):
        for y in range(first.y, last.y + 1):
            chunk = Chunk(x, y)
            cut = shapely.intersection(line, shapely.box(*chunk.bounds))
            if cut.geom_type == "MultiLineString":
                cut = shapely.line_merge(cut)
            parts = [
                spaced_line(shapely.get_coordinates(without_stubs(part).segmentize(_STEP)))
                for part in shapely.get_parts(cut)
                if part.length >= _LEAST_LENGTH
            ]
            parts = [part[:-1] if (part[0] == part[-1]).all() else part for part in parts]
            parts = [part for part in parts if len(part) > 1]
            if parts:
                yield chunk, parts


def _issues(used: Counter[str], lost: Counter[str], source: str) -> Iterator[Issue]:
    if used:
        what = ", ".join(f"{kind}: {count}" for kind, count in sorted(used.items()))
        text = f"what the map has on the land: {what}"
        yield Issue("osm.used", Severity.INFO, source, text, "used")
    for why, count in sorted(lost.items()):
        text = f"{count} trees, lamps, pieces of furniture and of barriers lie {why}"
        yield Issue("osm.point", Severity.INFO, source, text, "left out")

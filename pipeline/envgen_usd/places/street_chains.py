"""Joins ways of a map to streets between nodes where streets meet or end."""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from pyproj import Transformer
from scipy.spatial import cKDTree

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.street_plan import MappedStreet, StreetPlan, StreetProfile
from envgen_usd.places.mapped_points import lines_of_map, points_of_map
from envgen_usd.places.osm_streets import Bounds, MapWay, Places, StreetExtract
from envgen_usd.places.street_tags import Surroundings, is_one_way, read_profile

_TOWN = 45.0
"""Distance of buildings from a street in a town, metres; a larger value makes more towns."""
_TOWN_SHARE = 0.4
"""Least share of a way's points with a building near, in a town."""
_TWIN = 25.0
"""Largest distance between the carriageways of a street, metres."""
_WALL_STEP = 3.0
"""Distance of the points of a wall, metres; a larger value misses more of it."""
_BESIDE = 20.0
"""Farthest wall that narrows a sidewalk, metres."""
_STEP = 10.0
"""Distance of the points by which ways are compared, metres."""


@dataclass(frozen=True)
class _Piece:
    """A part of a way between two nodes where chains may end.

    Attributes:
        way: Number of the way.
        nodes: Ids of its nodes.
        points: N x 2, metres.
        profile: Cross-section along it.
        name: Name of the street.
        ring: Part of a roundabout.
        flow: 1 for one-way traffic along it, -1 against it, 0 for both.
    """

    way: int
    nodes: tuple[int, ...]
    points: FloatArray
    profile: StreetProfile
    name: str
    ring: bool
    flow: int

    def reversed(self) -> "_Piece":
        """The same piece in the other direction."""
        return replace(
            self,
            nodes=self.nodes[::-1],
            points=self.points[::-1],
            profile=self.profile.reversed(),
            flow=-self.flow,
        )


def plan_crs(bounds: Bounds) -> str:
    """Transverse Mercator about the middle of an area."""
    west, south, east, north = bounds
    return (
        f"+proj=tmerc +lat_0={(south + north) / 2:.6f} +lon_0={(west + east) / 2:.6f} +k=1"
        " +x_0=0 +y_0=0 +ellps=WGS84 +units=m +no_defs"
    )


def street_plan(extract: StreetExtract, path: Path, country: str = "") -> StreetPlan:
    """The streets of an extract in metres.

    Args:
        extract: The extract.
        path: Its file, for messages.
        country: Country of the environment, whose figures complete the tags.
    """
    crs = plan_crs(extract.bounds)
    project = Transformer.from_crs(4326, crs, always_xy=True).transform

    def metric(places: Places) -> FloatArray:
        return _metric(project, places)

    lines = [_metric(project, way.places) for way in extract.ways]
    faults: dict[str, list[int]] = defaultdict(list)
    profiles = []
    around = _surroundings(extract, lines, _walls(extract, project), country)
    for way, surroundings in zip(extract.ways, around, strict=True):
        read = read_profile(way.tags, surroundings)
        profiles.append(read.profile)
        for key in read.faults:
            faults[key].append(way.id)
    pieces = list(_pieces(extract.ways, lines, profiles))
    chains = list(_chains(pieces))
    ends = sorted({node for chain in chains for node in (chain[0].nodes[0], chain[-1].nodes[-1])})
    number = {node: n for n, node in enumerate(ends)}
    places = {
        node: point
        for piece in pieces
        for node, point in ((piece.nodes[0], piece.points[0]), (piece.nodes[-1], piece.points[-1]))
    }
    streets = tuple(_street(chain, number, extract.ways) for chain in chains)
    return StreetPlan(
        np.array([places[node] for node in ends]).reshape(-1, 2),
        streets,
        points_of_map(extract, metric),
        frozenset(_banned(extract, number)),
        crs,
        path.name,
        (*_issues(extract, path, faults),),
        {"ways": len(extract.ways), "clipped": extract.clipped, "streets": len(streets)},
        lines_of_map(extract, metric),
    )


def _metric(project: object, places: Sequence[tuple[float, float]]) -> FloatArray:
    degrees = np.array(places, float).reshape(-1, 2)
    return np.column_stack(project(*degrees.T))  # type: ignore[operator]


def _pieces(
    ways: Sequence[MapWay], lines: Sequence[FloatArray], profiles: Sequence[StreetProfile]
) -> Iterator[_Piece]:
    """Parts of ways between the nodes that several ways share."""
    uses = Counter(node for way in ways for node in way.nodes)
    for number, (way, line, profile) in enumerate(zip(ways, lines, profiles, strict=True)):
        last = len(way.nodes) - 1
        cuts = [0, *(n for n in range(1, last) if uses[way.nodes[n]] > 1), last]
        if way.nodes[0] == way.nodes[last] and len(cuts) == 2:
            cuts = [0, last // 2, last]  # A loop without a junction needs two ends.
        for first, end in pairwise(cuts):
            yield _Piece(
                number,
                way.nodes[first : end + 1],
                line[first : end + 1],
                profile,
                way.tags.get("name", ""),
                _is_ring(way),
                is_one_way(way.tags),
            )


def _chains(pieces: Sequence[_Piece]) -> Iterator[list[_Piece]]:
    """Joins pieces at nodes where exactly two of them meet and traffic goes on."""
    at: dict[int, list[int]] = defaultdict(list)
    for number, piece in enumerate(pieces):
        at[piece.nodes[0]].append(number)
        at[piece.nodes[-1]].append(number)
    used = [False] * len(pieces)

    def onward(piece: _Piece, number: int) -> tuple[_Piece, int] | None:
        node = piece.nodes[-1]
        ends = at[node]
        if len(ends) != 2 or ends[0] == ends[1]:
            return None
        other = ends[0] if ends[1] == number else ends[1]
        after = pieces[other]
        if used[other] or after.ring != piece.ring:
            return None
        after = after if after.nodes[0] == node else after.reversed()
        return None if piece.flow * after.flow < 0 else (after, other)

    for number, piece in enumerate(pieces):
        if used[number]:
            continue
        used[number] = True
        chain = [(piece, number)]
        for _ in range(2):
            while (step := onward(*chain[-1])) is not None:
                used[step[1]] = True
                chain.append(step)
            chain = [(each.reversed(), of) for each, of in chain[::-1]]
        yield [each for each, _ in chain]


def _street(
    chain: Sequence[_Piece], number: Mapping[int, int], ways: Sequence[MapWay]
) -> MappedStreet:
    """A chain as a street; neighbouring pieces of equal cross-section are a single stretch."""
    # One-way streets run with their traffic.
    if chain[0].flow < 0 or (chain[0].flow == 0 and any(piece.flow < 0 for piece in chain)):
        chain = [piece.reversed() for piece in chain[::-1]]
    points, breaks, profiles, of = [chain[0].points[:1]], [0], [chain[0].profile], [chain[0].way]
    count = 1
    for piece in chain:
        if count > 1 and piece.profile != profiles[-1]:
            breaks.append(count - 1)
            profiles.append(piece.profile)
            of.append(piece.way)
        points.append(piece.points[1:])
        count += len(piece.points) - 1
    return MappedStreet(
        number[chain[0].nodes[0]],
        number[chain[-1].nodes[-1]],
        np.concatenate(points),
        tuple(breaks),
        tuple(profiles),
        tuple(ways[n].id for n in of),
        next((piece.name for piece in chain if piece.name), ""),
        chain[0].ring,
    )


def _banned(extract: StreetExtract, number: Mapping[int, int]) -> Iterator[tuple[int, int, int]]:
    """Turns that restrictions exclude; of an only allowed turn, all others at its node."""
    for first, node, last in extract.banned:
        if node in number:
            yield first, number[node], last
    at: dict[int, set[int]] = defaultdict(set)
    for way in extract.ways:
        for node in way.nodes:
            at[node].add(way.id)
    for first, node, last in extract.only:
        if node in number:
            for other in at[node] - {first, last}:
                yield first, number[node], other


def _surroundings(
    extract: StreetExtract, lines: Sequence[FloatArray], walls: FloatArray, country: str
) -> list[Surroundings]:
    """What lies beside each way: buildings, and the other carriageway of the street."""
    samples = [_samples(line) for line in lines]
    near = cKDTree(walls) if len(walls) else None
    flows = [is_one_way(way.tags) for way in extract.ways]
    single = [n for n, flow in enumerate(flows) if flow and not _is_ring(extract.ways[n])]
    places = np.concatenate([samples[n][0] for n in single] or [np.empty((0, 2))])
    heads = np.concatenate([flows[n] * samples[n][1] for n in single] or [np.empty((0, 2))])
    twins = cKDTree(places) if len(places) else None
    found = []
    for n, (middle, heading) in enumerate(samples):
        town = True
        if near is not None:
            town = bool(np.mean(near.query(middle)[0] < _TOWN) >= _TOWN_SHARE)
        if extract.ways[n].tags["highway"].startswith("motorway"):
            town = False
        twin = False
        if flows[n] and twins is not None:
            twin = _has_twin(middle, flows[n] * heading, places, heads, twins)
        free = (np.inf, np.inf) if near is None else _free(middle, heading, walls, near)
        found.append(Surroundings(town, twin, country, *free))
    return found


def _walls(extract: StreetExtract, project: object) -> FloatArray:
    """Points on the walls of buildings, N x 2, metres."""
    rings = [shapely.LineString(_metric(project, ring)) for ring in extract.buildings]
    lines = shapely.segmentize(np.array(rings, object), _WALL_STEP)
    walls: FloatArray = shapely.get_coordinates(lines)
    return walls


def _free(
    middle: FloatArray, heading: FloatArray, walls: FloatArray, tree: cKDTree
) -> tuple[float, float]:
    """Distance of the nearest wall beside a way, on its left and on its right."""
    left, right = np.inf, np.inf
    for place, ahead, near in zip(
        middle, heading, tree.query_ball_point(middle, _BESIDE), strict=True
    ):
        steps = walls[near] - place
        across = ahead[0] * steps[:, 1] - ahead[1] * steps[:, 0]
        beside = np.abs(steps @ ahead) <= 0.55 * _STEP
        left = min(left, float(across[beside & (across > 0.0)].min(initial=np.inf)))
        right = min(right, float(-across[beside & (across < 0.0)].max(initial=-np.inf)))
    return left, right


def _is_ring(way: MapWay) -> bool:
    return way.tags.get("junction") in {"roundabout", "circular"}


def _has_twin(
    middle: FloatArray, heading: FloatArray, places: FloatArray, heads: FloatArray, tree: cKDTree
) -> bool:
    """True if opposite one-way traffic runs on the left of most of a way."""
    hits = []
    for place, ahead, others in zip(
        middle, heading, tree.query_ball_point(middle, _TWIN), strict=True
    ):
        steps, ways = places[others] - place, heads[others]
        left = ahead[0] * steps[:, 1] - ahead[1] * steps[:, 0] > 0.5
        hits.append(bool((left & (ways @ ahead < -0.8)).any()))
    return sum(hits) * 2 > len(hits)


def _samples(line: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points along a line and the direction there, each N x 2."""
    steps = np.diff(line, axis=0)
    lengths = np.maximum(np.linalg.norm(steps, axis=1), 1e-9)
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(int(ends[-1] / _STEP), 1)
    at = (np.arange(count) + 0.5) * ends[-1] / count
    segment = np.clip(np.searchsorted(ends, at, "right") - 1, 0, len(steps) - 1)
    share = ((at - ends[segment]) / lengths[segment])[:, None]
    return line[segment] + share * steps[segment], steps[segment] / lengths[segment][:, None]


def _issues(
    extract: StreetExtract, path: Path, faults: Mapping[str, Sequence[int]]
) -> Iterator[Issue]:
    if extract.incomplete:
        yield Issue(
            "osm.incomplete_way",
            Severity.WARNING,
            f"{path.name}: way {extract.incomplete[0]}",
            f"{len(extract.incomplete)} streets refer to nodes that the extract lacks",
            "existing nodes used",
        )
    if extract.unclear_islands:
        yield Issue(
            "osm.implausible_tag",
            Severity.WARNING,
            f"{path.name}: {extract.unclear_islands[0]}",
            f"{len(extract.unclear_islands)} crossings have a value of crossing:island that is"
            " neither yes nor no",
            "no island built",
        )
    for key, ways in sorted(faults.items()):
        yield Issue(
            "osm.implausible_tag",
            Severity.WARNING,
            f"{path.name}: way {ways[0]}",
            f"{len(ways)} streets have a value of {key} that no street has",
            "figures of the class of street used",
        )

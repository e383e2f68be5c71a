"""The roads of a region: their surface for its chunks, and their outline for the land around."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.chunks import chunks_of_points
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.geometry.joined_outline import joined_outline
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.geometry.square_index import Bounds
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_marks import MarkRules
from envgen_usd.models.road_piece import RoadPiece
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.opendrive.surface import street_lines
from envgen_usd.recipe.map_land import surface_of
from envgen_usd.recipe.map_regions import Region

BESIDE = 100.0
"""Distance from a region within which roads belong to its surface, metres.

What a chunk shows lies nearer, and so does what decides where a road becomes a bridge. A larger
value needs more time and memory.
"""
_PLACE = re.compile(r"(road|junction)\[id=(.*?)\]")


def build_roads(
    network: RoadNetwork, region: Region, tolerance: float, marks: MarkRules, margin: float
) -> tuple[RoadSurface, RoadPiece]:
    """Builds the surface of a region's roads.

    Args:
        network: Its roads, and those within `BESIDE`.
        region: The region.
        tolerance: Chord error, metres.
        marks: Sizes of marks that the file leaves open.
        margin: Width of the land beside the road, metres.
    """
    try:
        surface = surface_of(network, tolerance, marks)
    except EnvgenError:
        surface = _bare(network)
    outline = Outline.of(surface)
    edges = np.stack([outline.start, outline.end], axis=1)
    decks = surface.vertices[surface.triangles[surface.triangle_level > 0]]
    vertices = surface.vertices[region.holds(surface.vertices)]
    own = _own_roads(surface, region)
    piece = RoadPiece(
        edges[region.holds(edges.mean(axis=1))],
        decks[region.holds(decks.mean(axis=1))],
        tuple(chunks_of_points(vertices, margin)),
        tuple(lane for lane in surface.lanes if lane.road in own),
        tuple(_own_issues(surface, own)),
    )
    # Features follow from the roads in less time than they are read.
    return replace(surface, features=(), issues=()), piece


def joined_roads(
    pieces: Sequence[RoadPiece], network: RoadNetwork, tolerance: float, bounds: Bounds
) -> tuple[RoadSurface, tuple[Issue, ...]]:
    """The roads in a rectangle, without their triangles.

    Args:
        pieces: Roads of the regions that the rectangle meets.
        network: The roads in the rectangle.
        tolerance: Chord error, metres.
        bounds: The rectangle, metres.

    Returns:
        Outline, lanes and reference lines; an issue where edges of two regions do not meet.
    """
    outline = joined_outline(np.concatenate([piece.edges for piece in pieces]), bounds)
    lanes, lines = street_lines(network, tolerance)
    road = replace(
        _bare(network),
        vertices=outline.vertices,
        outline=outline.loops,
        lanes=lanes,
        roads=lines,
    )
    return road, tuple(_gaps(outline.gaps))


def with_decks(road: RoadSurface, pieces: Sequence[RoadPiece]) -> RoadSurface:
    """A road with the bridges and tunnels of regions as its only triangles."""
    decks = np.concatenate([piece.decks for piece in pieces])
    count = len(decks)
    return replace(
        road,
        vertices=np.concatenate([road.vertices, decks.reshape(-1, 3)]),
        triangles=len(road.vertices) + np.arange(3 * count).reshape(-1, 3),
        triangle_patch=np.zeros(count, np.int64),
        triangle_level=np.ones(count, np.int64),
    )


def _gaps(places: FloatArray) -> Iterator[Issue]:
    if len(places):
        x, y = places[0].tolist()
        yield Issue(
            "road.open_outline",
            Severity.WARNING,
            f"place[{x:.0f} {y:.0f}]",
            f"the outline of the roads has {len(places)} open ends between regions",
            "closed by straight edges",
        )


def _bare(network: RoadNetwork) -> RoadSurface:
    """The surface of roads without an area."""
    faces = (np.empty((0, 3), np.int64), *(np.empty(0, np.int64),) * 2)
    crs, offset = network.geo_reference, network.offset[:3]
    return RoadSurface(np.empty((0, 3)), *faces, (), (), (), (), crs=crs, offset=offset)


def _own_roads(surface: RoadSurface, region: Region) -> frozenset[str]:
    """Ids of the roads whose middle lies in a region."""
    middles = np.array([line.points[len(line.points) // 2, :2] for line in surface.roads])
    own = region.holds(middles.reshape(-1, 2)).tolist()
    return frozenset(line.road for line, is_own in zip(surface.roads, own, strict=True) if is_own)


def _own_issues(surface: RoadSurface, roads: frozenset[str]) -> Iterator[Issue]:
    """Issues of the roads of a region, and of junctions whose first road is one of them."""
    first: dict[str, str] = {}
    for line in surface.roads:
        first.setdefault(line.junction, line.road)
    for issue in surface.issues:
        place = _PLACE.match(issue.where)
        if place is None or (place[2] if place[1] == "road" else first.get(place[2], "")) in roads:
            yield issue

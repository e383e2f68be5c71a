"""The roads of a map by place: made once, so that a chunk looks at nothing but what is near it."""

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.city.roads.chunk_pieces import ChunkPieces
from envgen_usd.city.roads.feature_relations import crosswalk_links, virtual_links
from envgen_usd.city.roads.intersections import chunk_of_junction, without_area
from envgen_usd.geometry.square_index import Bounds, LineIndex, SquareIndex
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.lanes import DRIVEN
from envgen_usd.models.road_feature import RoadFeature
from envgen_usd.models.road_surface import LaneLine, Patch, RoadLine, RoadSurface

UNCUT = Chunk(0, 0)
"""The chunk that everything belongs to where roads are not cut."""
_LEAST_AREA = 1e-6
"""Least double area in plan of a triangle that has a height, m²."""

RoadKey = tuple[str, str, int]
"""Junction, road and section that a patch belongs to."""


class RoadIndex:
    """The roads of a map with what a chunk asks of them.

    What takes a look at the whole map is done here, once. Each question about a chunk then takes
    time that grows with the roads in it and near it.

    Attributes:
        surface: All roads.
        pieces: The surface, cut into chunks.
        lines: Reference lines by road.
        features: Features of the file by id.
        sites: Junctions by id.
        reached: Ids of the junctions that each road leads to, comes from, or passes.
        walks: Patches that pedestrians can go to from each patch.
        ways: Lanes that traffic can go to from places along each lane, and those it can come from.
    """

    def __init__(self, surface: RoadSurface, *, cut: bool = True) -> None:
        """Sorts the roads by place.

        Args:
            surface: All roads.
            cut: False if everything is to belong to the chunk `UNCUT`.
        """
        self.surface = surface
        self.pieces = ChunkPieces(surface, None if cut else UNCUT)
        self.lines = {line.road: line for line in surface.roads}
        self.features = {feature.id: feature for feature in surface.features}
        self.sites = {site.id: site for site in surface.junctions}
        self.reached = _junctions_by_road(surface, self.pieces.lanes)
        self.walks, self.ways = crosswalk_links(surface), virtual_links(surface)
        self._members = _members(surface.patches)
        self._chunks: dict[tuple[str, str, int | None], frozenset[Chunk]] = {}
        self._bare = self._junctions_without_area()
        self._abreast: dict[tuple[str, int, bool], list[LaneLine]] = {}
        for lane in surface.lanes:
            if lane.lane_type in DRIVEN:
                self._abreast.setdefault(_side(lane), []).append(lane)
        corners = surface.vertices[:, :2][surface.triangles]
        self._triangles = SquareIndex.of(corners.min(axis=1), corners.max(axis=1))
        reach = [np.abs([line.t_left, line.t_right]).max(initial=0.0) for line in surface.roads]
        self._lines = LineIndex.of([line.points for line in surface.roads], np.array(reach))
        self._placed, self._places = _by_place(surface.features)

    def corners_near(self, bounds: Bounds, margin: float) -> FloatArray:
        """Returns the corners of triangles near a rectangle, T x 3 x 3, without tunnels.

        Args:
            bounds: The rectangle, metres.
            margin: Metres; all triangles whose bounding boxes come this near are there.
        """
        rows = self._triangles.near(bounds, margin)
        rows = rows[self.surface.triangle_level[rows] >= 0]
        corners: FloatArray = self.surface.vertices[self.surface.triangles[rows]]
        return corners

    def triangles_near(self, bounds: Bounds, margin: float) -> FloatArray:
        """Returns the same triangles in plan, T x 3 x 2."""
        return self.corners_near(bounds, margin)[:, :, :2]

    def height_at(self, place: FloatArray) -> float | None:
        """Returns the height of the road below a place (2), metres; `None` beside the road."""
        x, y = place.tolist()
        rows = self._triangles.near((x, y, x, y), 0.0)
        rows = rows[self.surface.triangle_level[rows] >= 0]
        first, second, third = self.surface.vertices[self.surface.triangles[rows]].swapaxes(0, 1)
        across, along, to = second - first, third - first, place - first[:, :2]
        area = across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0]
        # Kerb faces are vertical and have no area in plan.
        area = np.where(np.abs(area) > _LEAST_AREA, area, np.inf)
        u = (to[:, 0] * along[:, 1] - to[:, 1] * along[:, 0]) / area
        v = (across[:, 0] * to[:, 1] - across[:, 1] * to[:, 0]) / area
        inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & np.isfinite(area)
        heights = first[:, 2] + u * across[:, 2] + v * along[:, 2]
        return float(heights[inside].max()) if inside.any() else None

    def lines_near(self, bounds: Bounds, margin: float) -> tuple[RoadLine, ...]:
        """Returns at least the roads that come within a margin of a rectangle, metres."""
        roads = self.surface.roads
        return tuple(roads[number] for number in self._lines.near(bounds, margin).tolist())

    def features_near(self, bounds: Bounds, margin: float) -> tuple[RoadFeature, ...]:
        """Returns at least the features of the file within a margin of a rectangle, metres."""
        rows = self._placed[self._places.near(bounds, margin)]
        return tuple(self.surface.features[row] for row in rows.tolist())

    def abreast(self, lane: LaneLine) -> Sequence[LaneLine]:
        """Returns the lanes for vehicles on the same side of a lane's section, itself included."""
        return self._abreast.get(_side(lane), ())

    def chunks_of(self, junction: str, road: str, section: int | None = None) -> frozenset[Chunk]:
        """Returns the chunks that hold a part of a junction, a road or a section of it."""
        key = junction, road, section
        if key not in self._chunks:
            chunks = map(self.pieces.chunks_of, self._members.get(key, ()))
            self._chunks[key] = frozenset(itertools.chain(*chunks))
        return self._chunks[key]

    def junctions_without_area(self, chunk: Chunk) -> Sequence[str]:
        """Returns the junctions that lie in a chunk with nothing but the roads that meet there."""
        return self._bare.get(chunk, ())

    def _junctions_without_area(self) -> dict[Chunk, list[str]]:
        junctions: dict[Chunk, list[str]] = {}
        for site in without_area(self.surface):
            # Where nothing is cut, all of them are there.
            whole = self.pieces.is_whole
            tile = UNCUT if whole else chunk_of_junction(site, self.lines)
            if tile is not None:
                junctions.setdefault(tile, []).append(site.id)
        return junctions


def road_key(patch: Patch) -> RoadKey:
    """Returns what a patch belongs to; in a junction no road owns it alone."""
    return (patch.junction, "", 0) if patch.junction else ("", patch.road, patch.section)


def _members(patches: Sequence[Patch]) -> dict[tuple[str, str, int | None], list[int]]:
    """Indices of the patches of each junction and road, and of each section."""
    members: dict[tuple[str, str, int | None], list[int]] = {}
    for index, patch in enumerate(patches):
        junction, road, section = road_key(patch)
        for place in (None, section):
            members.setdefault((junction, road, place), []).append(index)
    return members


def _by_place(features: Sequence[RoadFeature]) -> tuple[IntArray, SquareIndex]:
    """Rows of the features that lie somewhere, and the index of these."""
    points = [feature.plan() for feature in features]
    placed = np.array([row for row, own in enumerate(points) if len(own)], dtype=np.int64)
    boxes = [(points[row].min(axis=0), points[row].max(axis=0)) for row in placed.tolist()]
    low, high = np.array(boxes).reshape(-1, 2, 2).transpose(1, 0, 2)
    return placed, SquareIndex.of(low, high)


def _side(lane: LaneLine) -> tuple[str, int, bool]:
    return lane.road, lane.section, lane.lane > 0


def _junctions_by_road(surface: RoadSurface, lanes: Mapping[str, LaneLine]) -> dict[str, set[str]]:
    junctions: dict[str, set[str]] = {}
    for site in surface.junctions:
        for road in site.roads:
            junctions.setdefault(road, set()).add(site.id)
    for lane in lanes.values():
        for other in (*lane.predecessors, *lane.successors):
            if not lane.junction and other in lanes and lanes[other].junction:
                junctions.setdefault(lane.road, set()).add(lanes[other].junction)
    return junctions

"""The land of a map that streets open up: blocks between roads, and strips along them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.landuse.blocks.empty_blocks import STEEPEST, slope_of
from envgen_usd.landuse.blocks.land_areas import NARROW, common, union, without
from envgen_usd.landuse.roadside import Roadside
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.land_rules import PlotRules
from envgen_usd.models.road_surface import RoadLine, RoadSurface

STREET = 1.5
"""Largest distance of a plot's side from the edge of the verge, metres, to face the street."""

_BORDER = 1.5
"""Distance of the outline from the border of a road that it follows, metres."""


@dataclass(frozen=True)
class MapFrame:
    """The map around a part that is laid out by itself.

    Attributes:
        middle: Middle of the map, 2, metres.
        reach: Distance of the farthest street from it, metres.
        area: All land that is laid out lies in it; what lies beyond is left aside.
    """

    middle: FloatArray
    reach: float
    area: shapely.Geometry


class StreetLand:
    """Streets of a map, and the land along them and between them.

    Attributes:
        land: Land for plots: that of all blocks, and strips along the streets outside of them.
        inside: The part of it that lies in blocks.
        band: Land near a street, whose plots open onto it.
        blocks: Polygons of the blocks with plots.
        reach: Distance of the farthest street from the middle of the map, metres.
    """

    def __init__(  # noqa: PLR0913 - what the land follows from
        self,
        roadsides: Sequence[Roadside],
        surface: RoadSurface,
        rules: PlotRules,
        settled: shapely.Geometry,
        frame: MapFrame | None = None,
        *,
        at_junctions: bool,
    ) -> None:
        """Finds the blocks and the strips along the streets.

        Args:
            roadsides: Roadsides of the whole map.
            surface: The whole road.
            rules: Sizes of plots.
            settled: Points of plots: blocks without any, as islands of roundabouts, stay empty.
            frame: The map around the part that is laid out; `None` lays out all of it.
            at_junctions: True for strips along junctions, too.
        """
        area = frame.area if frame is not None else None
        whole = [loop for loop in surface.outline_loops() if len(loop) > 2 and _meets(loop, area)]
        loops = [loop[:, :2] for loop in whole]
        rings = [shapely.linearrings(loop) for loop in loops]
        faces = shapely.make_valid(shapely.polygons(rings))
        is_enclosed = ~shapely.is_ccw(rings)  # the road lies to the left of its outline
        is_block = is_enclosed & shapely.intersects(faces, settled)
        is_block &= np.array([slope_of(loop) <= STEEPEST for loop in whole], bool)
        strips = [_strip(side, rules.depth[0]) for side in roadsides if side.open]
        if at_junctions:
            corners = _at_junctions(loops, roadsides, surface, area)
            # One buffer of many short lines takes time in the square of their number.
            strips += list(shapely.buffer(shapely.get_parts(corners), rules.depth[0]))
        edges = _within(shapely.multilinestrings(rings), area)
        roads = _within(union(faces[~is_enclosed]), area)
        self.blocks: NDArray[np.object_] = faces[is_block]
        blocks = union(self.blocks)
        beside = union([shapely.make_valid(strip) for strip in strips])
        margins = union(
            [shapely.buffer(edges, rules.verge[0]), *_kept_free(roadsides, surface, rules, area)]
        )
        enclosed = union([roads, *faces[is_enclosed]])
        self.land = without(union([blocks, without(beside, enclosed)]), margins)
        self.inside = without(blocks, margins)
        near = shapely.buffer(edges, rules.depth[0] + rules.verge[1])
        self.band = union([near, beside])
        self._street = _open_edges(edges, roadsides, rules)
        shapely.prepare(self._street)
        self._front = shapely.buffer(self._street, rules.verge[1] + STREET)
        shapely.prepare(self._front)
        self._middle, self.reach = _extent(loops) if frame is None else (frame.middle, frame.reach)

    def beside(self, middles: FloatArray) -> BoolArray:
        """Tells which points (N x 2) are at the edge of the verge."""
        beside: BoolArray = shapely.intersects_xy(self._front, *middles.T)
        return beside

    def away(self, place: FloatArray) -> float:
        """Distance of a point (2) from the street, metres."""
        return float(shapely.distance(self._street, shapely.Point(place)))

    def density(self, place: FloatArray, falloff: float) -> float:
        """Density at a point (2) as a share of that in the middle of the map.

        Args:
            place: Point, metres.
            falloff: Share that is lost at the farthest street.
        """
        away = float(np.hypot(*(place - self._middle))) / self.reach
        return 1.0 - falloff * min(away, 1.0)

    def first_row(self, depth: float) -> shapely.Geometry:
        """The land within a distance of a street, metres."""
        return shapely.buffer(self._street, depth)

    def longest_front(self, part: shapely.Geometry) -> FloatArray | None:
        """The longest side of land that faces a street, 2 x 2, counter-clockwise; or `None`."""
        if part.geom_type != "Polygon":
            return None
        simple = shapely.orient_polygons(shapely.simplify(part, 0.5))
        ring = shapely.get_coordinates(simple.exterior)
        sides = np.stack([ring[:-1], ring[1:]], axis=1)
        lengths = np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1)
        lengths[~self.beside(sides.mean(axis=1))] = 0.0
        longest = int(np.argmax(lengths))
        return sides[longest] if lengths[longest] >= NARROW else None


def _kept_free(
    roadsides: Sequence[Roadside],
    surface: RoadSurface,
    rules: PlotRules,
    area: shapely.Geometry | None,
) -> Sequence[shapely.Geometry]:
    """Verges, and the land below bridges and beside them."""
    verges = [np.empty((0, 4, 2)), *(side.verges() for side in roadsides)]
    triangles = surface.vertices[surface.triangles[surface.triangle_level > 0], :2]
    decks = shapely.polygons(triangles)
    if area is not None:
        decks = decks[shapely.intersects(area, decks)]
    below = shapely.buffer(decks, rules.verge[0])
    return [*shapely.make_valid(shapely.polygons(np.concatenate(verges))), *below]


def _open_edges(
    edges: shapely.Geometry, roadsides: Sequence[Roadside], rules: PlotRules
) -> shapely.Geometry:
    """The edges of roads without those along closed roadsides."""
    closed = [shapely.linestrings(side.points) for side in roadsides if not side.open]
    if not closed:
        return edges
    unreachable = shapely.buffer(shapely.multilinestrings(closed), rules.verge[1] + STREET)
    return shapely.difference(edges, unreachable)


def _extent(loops: Sequence[FloatArray]) -> tuple[FloatArray, float]:
    """Middle of the outlines of roads, and the distance of the farthest point, 1 m at least."""
    corners = np.concatenate(loops) if loops else np.zeros((1, 2))
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
    return middle, max(float(np.linalg.norm(corners - middle, axis=1).max()), 1.0)


def _meets(points: FloatArray, area: shapely.Geometry | None) -> bool:
    """Tells whether the box around points (N x 2 or N x 3) meets an area; `None` is everywhere."""
    if area is None:
        return True
    return bool(
        area.intersects(shapely.box(*points[:, :2].min(axis=0), *points[:, :2].max(axis=0)))
    )


def _within(shape: shapely.Geometry, area: shapely.Geometry | None) -> shapely.Geometry:
    """The part of a shape in an area."""
    return shape if area is None else shapely.intersection(shape, area)


def _strip(side: Roadside, depth: float) -> shapely.Geometry:
    """The land along a roadside, down to a depth in metres."""
    back = side.points + depth * side.normals
    quads = np.stack([side.points[:-1], side.points[1:], back[1:], back[:-1]], axis=1)
    return union(shapely.make_valid(shapely.polygons(quads)))


def inside_of(blocks: NDArray[np.object_], land: shapely.Geometry) -> NDArray[np.object_]:
    """The polygons of land that lie in blocks."""
    parts = shapely.get_parts(common(land, union(blocks)))
    inside: NDArray[np.object_] = parts[shapely.area(parts) > 0.0]
    return inside


def _at_junctions(
    loops: Sequence[FloatArray],
    roadsides: Sequence[Roadside],
    surface: RoadSurface,
    area: shapely.Geometry | None,
) -> shapely.Geometry:
    """The outline of the roads along junctions: without roadsides, and without ends of roads."""
    edges = np.concatenate(
        [np.empty((0, 2, 2)), *(np.stack([p, np.roll(p, -1, axis=0)], axis=1) for p in loops)]
    )
    lines = shapely.linestrings(edges)
    lines = lines if area is None else lines[shapely.intersects(area, lines)]
    borders = [side.points - side.verge * side.normals for side in roadsides]
    known = [shapely.buffer(shapely.linestrings(border), _BORDER) for border in borders]
    known += [
        _end(line, place)
        for line in surface.roads
        if _meets(line.points, area)
        for place in (0, -1)
    ]
    rest = shapely.difference(shapely.multilinestrings(lines), shapely.union_all(known))
    return shapely.union_all(rest)


def _end(line: RoadLine, place: int) -> shapely.Geometry:
    """The land just before an end of a road, or behind it."""
    left, right = line.left_border()[place], line.right_border()[place]
    return shapely.buffer(shapely.linestrings([left, right]), _BORDER)

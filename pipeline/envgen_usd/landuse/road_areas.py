"""The road of a map as polygons, cut into chunks."""

import math
from collections.abc import Iterator, Mapping

import numpy as np
import shapely

from envgen_usd.chunks import CHUNK_SIZE, Chunk
from envgen_usd.models.road_surface import RoadSurface

_BEYOND = 10.0
"""Metres around a chunk that a piece keeps, so that no cut moves what lies in the chunk."""

_Range = tuple[int, int, int, int]
"""First and last column and row of chunks: (x, y, x, y)."""


class RoadAreas:
    """The road on the ground, made once for a map and cut to any chunk.

    A loop of the outline may surround the whole map. It is halved until each piece belongs to a
    single chunk. So the time of a chunk grows only with the road in it.
    """

    def __init__(self, surface: RoadSurface) -> None:
        """Divides the loops of the road's outline among the chunks."""
        loops = [loop[:, :2] for loop in surface.outline_loops() if len(loop) > 2]
        areas = np.array([shapely.Polygon(loop) for loop in loops], dtype=object)
        outer = shapely.is_ccw(shapely.get_exterior_ring(areas)).tolist()
        self._pieces: dict[Chunk, list[tuple[bool, shapely.Geometry]]] = {}
        for is_outer, area in zip(outer, shapely.make_valid(areas), strict=True):
            # The last point of a ring is its first.
            places = {place: n for n, place in reversed([*enumerate(_points(area))])}
            for chunk, piece in _divided(area, _range(area)):
                ordered = _in_order(piece, places, is_outer)
                self._pieces.setdefault(chunk, []).append((is_outer, ordered))

    def in_chunk(self, chunk: Chunk) -> shapely.Geometry:
        """Returns the road on the ground of a chunk; may be empty or have several parts."""
        pieces = self._pieces.get(chunk, [])
        outer = np.array([is_outer for is_outer, _ in pieces], dtype=bool)
        near = np.array([piece for _, piece in pieces], dtype=object)
        parts = shapely.intersection(near, shapely.box(*chunk.bounds))
        return shapely.difference(shapely.union_all(parts[outer]), shapely.union_all(parts[~outer]))


def _range(area: shapely.Geometry) -> _Range:
    """Chunks that the bounding box of an area touches."""
    x0, y0, x1, y1 = (side / CHUNK_SIZE for side in area.bounds)
    return math.ceil(x0) - 1, math.ceil(y0) - 1, math.floor(x1), math.floor(y1)


def _divided(area: shapely.Geometry, tiles: _Range) -> Iterator[tuple[Chunk, shapely.Geometry]]:
    """Chunks of a range with what lies of an area in each and close around it."""
    x0, y0, x1, y1 = tiles
    if (x0, y0) == (x1, y1):
        yield Chunk(x0, y0), area
        return
    if x1 - x0 >= y1 - y0:
        middle = (x0 + x1) // 2
        halves = (x0, y0, middle, y1), (middle + 1, y0, x1, y1)
    else:
        middle = (y0 + y1) // 2
        halves = (x0, y0, x1, middle), (x0, middle + 1, x1, y1)
    for half in halves:
        low, high = Chunk(*half[:2]).bounds[:2], Chunk(*half[2:]).bounds[2:]
        box = shapely.buffer(shapely.box(*low, *high), _BEYOND, join_style="mitre")
        part = shapely.intersection(area, box)
        if not part.is_empty:
            yield from _divided(part, half)


def _in_order(
    piece: shapely.Geometry, places: Mapping[tuple[float, float], int], is_outer: bool
) -> shapely.Geometry:
    """A piece of a loop whose rings begin where the loop begins, as if it had been cut at once.

    So what is written of a chunk does not depend on the way in which the map was divided.

    Args:
        piece: Polygons.
        places: Number of each point along the loop.
        is_outer: Whether the loop runs counter-clockwise.
    """
    parts = []
    for part in shapely.get_parts(shapely.orient_polygons(piece, exterior_cw=not is_outer)):
        if part.geom_type != "Polygon":
            continue
        points = _points(part.exterior)[:-1]
        numbers = [places.get(point, len(places)) for point in points]
        first = int(np.argmin(numbers))
        # A loop that begins elsewhere comes in through the cut before its first point.
        start = first if numbers[first] == 0 else first - 1
        parts.append((numbers[first], points[start:] + points[:start], part.interiors))
    parts.sort(key=lambda part: part[0])
    return shapely.multipolygons([shapely.Polygon(ring, holes) for _, ring, holes in parts])


def _points(shape: shapely.Geometry) -> list[tuple[float, float]]:
    return [(x, y) for x, y in shapely.get_coordinates(shape).tolist()]

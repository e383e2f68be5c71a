"""Moves vertices on the borders between landuse classes onto straight lines.

A straight border of a field or a yard comes as a staircase of cells. With their corners cut
(`cut_corners`), it still bends at each step.
"""

import numpy as np
import shapely

from envgen_usd.chunks import CELL_SIZE, snap
from envgen_usd.geometry.unique_rows import unique_rows
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

TOLERANCE = CELL_SIZE
"""Largest distance of a vertex from its new place, metres; a larger value straightens more.

A vertex of a digitised straight line is up to half a cell beside it.
"""
_LEAST_SHARE = 0.02
"""Least area at each corner of a face, as a share of what it was; a larger value moves less."""
_LEAST_MOVE = 0.02
"""Share of a move below which it is taken back wholly; a smaller value tries more."""


def straighten(plan: FloatArray, faces: IntArray, kinds: IntArray, fixed: BoolArray) -> FloatArray:
    """Returns new places of the vertices of a mesh; its faces stay the same.

    1. Edges between faces of different kinds are joined to lines. They end where three kinds meet
       and at fixed vertices.
    2. Each line is simplified (Douglas and Peucker, 1973), and its vertices move to the nearest
       point on the result.
    3. Vertices of faces that would become narrow or turn over move less, or stay.

    Args:
        plan: V x 2, places on `chunks.GRID`, metres.
        faces: F x 4, vertices, counter-clockwise; triangles repeat their last vertex.
        kinds: F, kind of each face.
        fixed: V, True for vertices that must not move.
    """
    lines = _border_lines(plan, faces, kinds, fixed)
    if not len(lines):
        return plan
    simple = shapely.simplify(lines, TOLERANCE, preserve_topology=False)
    places, line = shapely.get_coordinates(lines, return_index=True)
    onto = shapely.line_interpolate_point(
        simple[line], shapely.line_locate_point(simple[line], shapely.points(places))
    )
    moved = plan.copy()
    vertex = _vertices_at(plan, places)
    moved[vertex] = snap(shapely.get_coordinates(onto))
    ends = np.unique(shapely.get_coordinates(shapely.boundary(lines)), axis=0)
    moved[fixed] = plan[fixed]
    moved[_vertices_at(plan, ends)] = plan[_vertices_at(plan, ends)]
    return _without_narrow_faces(plan, moved, faces)


def _border_lines(
    plan: FloatArray, faces: IntArray, kinds: IntArray, fixed: BoolArray
) -> np.ndarray:
    """Lines along the edges between kinds, from end to end."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    kind = np.repeat(kinds, faces.shape[1])
    real = start != end
    edges = np.sort(np.stack([start[real], end[real]], axis=1), axis=1)
    codes = edges[:, 0] * len(plan) + edges[:, 1]
    order = np.argsort(codes, kind="stable")
    codes, kind, edges = codes[order], kind[real][order], edges[order]
    twice = np.flatnonzero((codes[1:] == codes[:-1]) & (kind[1:] != kind[:-1]))
    between = edges[twice]
    if not len(between):
        return np.empty(0, dtype=object)
    merged = shapely.get_parts(
        shapely.line_merge(shapely.multilinestrings(shapely.linestrings(plan[between])))
    )
    return _divided(merged, plan[np.intersect1d(between, np.flatnonzero(fixed))])


def _divided(lines: np.ndarray, places: FloatArray) -> np.ndarray:
    """Lines that end at those of the places (N x 2) that are among their vertices."""
    points, line = shapely.get_coordinates(lines, return_index=True)
    known = {tuple(place) for place in places.tolist()}
    stops = np.array([tuple(point) in known for point in points.tolist()])
    first = np.append(True, line[1:] != line[:-1])
    last = np.append(first[1:], True)
    # A place in the middle ends a line and begins the next.
    inside = stops & ~first & ~last
    repeats = 1 + inside.astype(np.int64)
    number = np.repeat(np.cumsum(first | inside), repeats)
    number[np.cumsum(repeats)[inside] - 2] -= 1
    divided: np.ndarray = shapely.linestrings(
        np.repeat(points, repeats, axis=0), indices=number - 1
    )
    return divided


def _vertices_at(plan: FloatArray, places: FloatArray) -> IntArray:
    """Vertex at each place, which equals one of the plan's."""
    first, inverse = unique_rows(np.concatenate([plan, places]))
    vertex = np.empty(len(first), np.int64)
    vertex[inverse[: len(plan)]] = np.arange(len(plan))
    found: IntArray = vertex[inverse[len(plan) :]]
    return found


def _without_narrow_faces(plan: FloatArray, moved: FloatArray, faces: IntArray) -> FloatArray:
    """Takes moves back by halves, in the end wholly, until no face loses a corner's area."""
    touched = faces[(moved[faces] != plan[faces]).any(axis=(1, 2))]
    least = _LEAST_SHARE * _corner_areas(plan, touched)
    result, share = moved, 1.0
    while True:
        narrow = touched[(_corner_areas(result, touched) < least).any(axis=1)]
        again = np.unique(narrow[(result[narrow] != plan[narrow]).any(axis=-1)])
        if not len(again):
            return result
        share = share / 2.0 if share > _LEAST_MOVE else 0.0
        result = result.copy()
        result[again] = snap(plan[again] + share * (moved[again] - plan[again]))


def _corner_areas(plan: FloatArray, faces: IntArray) -> FloatArray:
    """Twice the signed area of the triangle at each corner of faces, F x 4; 0 at repeated ones."""
    places = plan[faces]
    following = np.roll(places, -1, axis=1)
    # A triangle repeats its last vertex, whose neighbour is the vertex before.
    following[:, 2] = np.where((faces[:, 2] == faces[:, 3])[:, None], places[:, 0], following[:, 2])
    before = np.roll(places, 1, axis=1)
    before[:, 0] = np.where((faces[:, 2] == faces[:, 3])[:, None], places[:, 2], before[:, 0])
    ahead, behind = following - places, before - places
    areas: FloatArray = ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0]
    areas[:, 3] = np.where(faces[:, 2] == faces[:, 3], 0.0, areas[:, 3])
    return areas

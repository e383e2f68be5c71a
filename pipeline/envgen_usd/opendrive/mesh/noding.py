"""Nodes segments on a grid: splits them at all crossings and contacts.

Snap rounding (Hobby 1999), repeated until all vertices keep a distance from each other and from
all other edges (Halperin and Packer 2002). Only segments of the same cell of a metre are compared,
so that the time grows with the length of the segments.
"""

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE, GRID
from envgen_usd.geometry.flat_arrays import ascending
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.opendrive.mesh.segment_cells import SegmentCells, beside, place_among
from envgen_usd.opendrive.mesh.vertex_welding import weld

_CHUNK = round(CHUNK_SIZE / GRID)
_MOST_ROUNDS = 12
"""Rounds with the full distance; dense tangles are then noded at a single grid unit."""


def noded(
    segments: IntArray, apart: int = 1, anchors: IntArray | None = None
) -> tuple[IntArray, IntArray]:
    """Splits segments so that they meet at common ends only.

    Vertices nearer than ``apart`` to a chunk border move onto it. Vertices nearer than ``apart`` to
    each other are merged. Edges are routed through vertices nearer than half of it.

    Args:
        segments: N x 2 x 2, grid units.
        apart: Distance in grid units, measured along the axes; 1 merges equal vertices only.
        anchors: A x 2, grid units, ends of segments that others merge into.

    Returns:
        Vertices, P x 2, grid units; unique edges without zero lengths, E x 2, indices of vertices.
    """
    ends = _on_chunk_borders(segments.reshape(-1, 2).T, apart)
    first = ends[:, :0] if anchors is None else _on_chunk_borders(anchors.T, apart)
    sites, number = _merged(first, ends, apart)
    edges = _unique_edges(number.reshape(-1, 2).T, sites.shape[1])
    fresh = np.ones(edges.shape[1], dtype=bool)
    rounds = 0
    while fresh.any():
        rounds += 1
        sites, edges, fresh = _round(sites, edges, fresh, apart if rounds <= _MOST_ROUNDS else 1)
    return np.ascontiguousarray(sites.T), np.ascontiguousarray(edges.T)


def _on_chunk_borders(points: IntArray, apart: int) -> IntArray:
    """Moves coordinates nearer than ``apart`` to a chunk border onto it."""
    border = (points + _CHUNK // 2) // _CHUNK * _CHUNK
    return np.where(np.abs(points - border) < apart, border, points)


def _merged(sites: IntArray, points: IntArray, apart: int) -> tuple[IntArray, IntArray]:
    """Adds points (2 x P) to sites (2 x S); returns the sites that stay, and that of each point."""
    if not points.size:
        return sites, np.empty(0, dtype=np.int64)
    both = np.concatenate([sites, points], axis=1)
    apart_y = int(np.ptp(both[1])) + 1
    codes = (both[0] - both[0].min()) * apart_y + both[1] - both[1].min()
    order = np.argsort(codes, kind="stable")
    new = np.diff(codes[order], prepend=-1) != 0
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.cumsum(new) - 1
    # Equal points keep the order of the first of them, as earlier points stay.
    first = order[new]
    rank = np.argsort(first)
    back = np.empty_like(rank)
    back[rank] = np.arange(len(rank))
    distinct = both[:, first[rank]]
    into = weld(distinct, apart)
    stays = into == np.arange(len(into))
    number = np.cumsum(stays) - 1
    return distinct[:, stays], number[into[back[place[sites.shape[1] :]]]]


def _unique_edges(edges: IntArray, count: int) -> IntArray:
    """Returns unique edges (2 x E, of ``count`` sites), the lower site first."""
    low, high = np.minimum(*edges), np.maximum(*edges)
    codes = ascending((low * count + high)[low < high])
    return np.stack(np.divmod(codes, count))


def _round(
    sites: IntArray, edges: IntArray, fresh: BoolArray, apart: int
) -> tuple[IntArray, IntArray, BoolArray]:
    """Splits the edges beside fresh ones; returns the sites and edges, and the fresh ones."""
    ends = sites[:, edges].astype(np.float64)
    chosen = beside(ends[:, 0], ends[:, 1], 2.0 * apart, fresh)
    used = np.zeros(sites.shape[1], dtype=bool)
    used[edges[:, chosen]] = True
    number = np.cumsum(used) - 1
    local, split, news = _split(sites[:, used], number[edges[:, chosen]], fresh[chosen], apart)
    known = np.flatnonzero(used)
    added = local[:, len(known) :]
    everywhere = np.append(known, sites.shape[1] + np.arange(added.shape[1]))
    others = np.ones(edges.shape[1], dtype=bool)
    others[chosen] = False
    return (
        np.concatenate([sites, added], axis=1),
        np.concatenate([edges[:, others], everywhere[split]], axis=1),
        np.concatenate([np.zeros(others.sum(), dtype=bool), news]),
    )


def _split(
    sites: IntArray, edges: IntArray, fresh: BoolArray, apart: int
) -> tuple[IntArray, IntArray, BoolArray]:
    """Splits edges at crossings and near sites; marks the resulting edges as fresh."""
    ends = sites[:, edges]
    real = ends.astype(np.float64)
    cells = SegmentCells(real[:, 0], real[:, 1], 2.0 * apart, fresh)
    found = [_crossings(ends, fresh, *pairs) for pairs in cells.pairs()]
    crossing, places = (np.concatenate(parts, axis=1) for parts in zip(*found, strict=True))
    before = sites.shape[1]
    crossing, places = _by_place(crossing, _on_chunk_borders(places, apart))
    sites, site = _merged(sites, places, apart)
    point, edge = cells.near(sites)
    news = fresh[edge] | (point >= before)
    point, edge = _near(sites, ends, (point[news], edge[news]), apart / 2)
    edge, point = np.append(edge, crossing), np.append(point, np.append(site, site))
    through = (edges[0, edge] != point) & (edges[1, edge] != point)
    edge, point = edge[through], point[through]
    whole = np.ones(edges.shape[1], dtype=bool)
    whole[edge] = False
    count = sites.shape[1]
    pieces = _unique_edges(_pieces(sites, edges, edge, point), count)
    old = edges[:, whole]
    known = place_among(pieces[0] * count + pieces[1], old[0] * count + old[1])
    pieces = np.delete(pieces, known[known >= 0], axis=1)
    marks = np.arange(old.shape[1] + pieces.shape[1]) >= old.shape[1]
    return sites, np.concatenate([old, pieces], axis=1), marks


def _crossings(
    ends: IntArray, fresh: BoolArray, one: IntArray, other: IntArray
) -> tuple[IntArray, IntArray]:
    """Returns pairs of segments that cross inside both (2 x C), and the grid places (2 x C)."""
    if not fresh.all():
        meet = fresh[one] | fresh[other]
        one, other = one[meet], other[meet]
    for low, high in zip(ends.min(axis=1), ends.max(axis=1), strict=True):
        meet = (low[one] <= high[other]) & (low[other] <= high[one])
        one, other = one[meet], other[meet]
    a, b = ends[:, 0, one], ends[:, 1, one]
    c, d = ends[:, 0, other], ends[:, 1, other]
    first, second = _turn(c, d, a), _turn(c, d, b)
    cross = np.flatnonzero(np.sign(first) * np.sign(second) < 0)
    a, b, c, d = a[:, cross], b[:, cross], c[:, cross], d[:, cross]
    cuts = np.sign(_turn(a, b, c)) * np.sign(_turn(a, b, d)) < 0
    cross, a, b = cross[cuts], a[:, cuts], b[:, cuts]
    c, d = c[:, cuts], d[:, cuts]
    return np.stack((one[cross], other[cross])), _crossing_places(a, b, c, d)


def _crossing_places(a: IntArray, b: IntArray, c: IntArray, d: IntArray) -> IntArray:
    """Returns where segments a to b and c to d (each 2 x N) cross, on the grid.

    Segments and ends are put in the order of their coordinates first: rounding then does not depend
    on what else is noded.
    """
    a, b = _in_order(a, b, a, b)
    c, d = _in_order(c, d, c, d)
    (a, c), (b, d) = _in_order(a, c, a, c), _in_order(a, c, b, d)
    first, second = _turn(c, d, a), _turn(c, d, b)
    share = first / (first - second)
    places: IntArray = a + np.round(share * (b - a)).astype(np.int64)
    return places


def _in_order(
    low: IntArray, high: IntArray, first: IntArray, second: IntArray
) -> tuple[IntArray, IntArray]:
    """Exchanges the columns of two arrays (2 x N) where ``low`` lies behind ``high`` (2 x N)."""
    behind = (low[0] > high[0]) | ((low[0] == high[0]) & (low[1] > high[1]))
    return np.where(behind, second, first), np.where(behind, first, second)


def _by_place(crossing: IntArray, places: IntArray) -> tuple[IntArray, IntArray]:
    """Sorts crossings by place, so that what stays of near ones follows from their places alone."""
    order = np.lexsort(places[::-1])
    return crossing[:, order].reshape(-1), places[:, order]


def _turn(a: IntArray, b: IntArray, c: IntArray) -> IntArray:
    """Returns twice the signed area of triangles between points (2 x N)."""
    turn: IntArray = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return turn


def _near(
    sites: IntArray, ends: IntArray, pairs: tuple[IntArray, IntArray], reach: float
) -> tuple[IntArray, IntArray]:
    """Returns the pairs of site and edge where it passes the square of half side ``reach``."""
    point, edge = pairs
    for place, low, high in zip(sites, ends.min(axis=1), ends.max(axis=1), strict=True):
        near = (low[edge] < place[point] + reach) & (high[edge] > place[point] - reach)
        point, edge = point[near], edge[near]
    a, b = ends[:, 0, edge], ends[:, 1, edge]
    span: FloatArray = reach * (np.abs(b[0] - a[0]) + np.abs(b[1] - a[1]))
    near = np.abs(_turn(a, b, sites[:, point])) < span
    return point[near], edge[near]


def _pieces(sites: IntArray, edges: IntArray, edge: IntArray, point: IntArray) -> IntArray:
    """Returns the pieces (2 x P) of edges that pass points, in the order along each edge."""
    start, end = sites[:, edges[0, edge]], sites[:, edges[1, edge]]
    along = ((sites[:, point] - start) * (end - start)).sum(axis=0).astype(np.float64)
    bent = ascending(edge)
    owner = np.concatenate([bent, edge, bent])
    stop = np.concatenate([edges[0, bent], point, edges[1, bent]])
    along = np.concatenate([np.full(len(bent), -np.inf), along, np.full(len(bent), np.inf)])
    order = np.lexsort((along, owner))
    inside = np.flatnonzero(owner[order][1:] == owner[order][:-1])
    return np.stack([stop[order][inside], stop[order][inside + 1]])

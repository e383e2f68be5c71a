"""Plans of streets that nobody surveyed: grids, rings and organic networks."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Voronoi

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.street_network import CrossSection, Street, StreetNetwork
from envgen_usd.seeds import generator

BLOCK = (120.0, 85.0)
"""Length and depth of a block of a grid, metres; a larger value gives longer streets."""
_MAIN_EVERY = 4
"""Each such line of a grid is a main street; a larger value gives fewer."""
_OPEN_SHARE = 0.12
"""Share of the side streets that a grid or a ring lacks, so that blocks differ."""
_JITTER = 0.07
"""Largest move of a crossing, as a share of the block; a larger value bends streets more."""
_ROUNDS = 3
"""Rounds of Lloyd's relaxation; more make the blocks of an organic network more alike."""
_BULGE = 0.06
"""Largest bend of an organic street, as a share of its length."""
_SHARPEST = np.radians(50.0)
"""Least angle between two streets at a junction; a smaller value keeps more streets."""
_SHORTEST = 45.0
"""Least length of a street, metres; nearer junctions become one."""
_ARC = np.radians(6.0)
"""Angle between two points of a ring."""

MAIN = CrossSection(lane_width=3.4, parking=2.2, sidewalk=3.0, speed=50, main=True)
SIDE = CrossSection(lane_width=2.9, parking=2.0, sidewalk=2.0, speed=30)
AVENUE = CrossSection(forward=2, backward=2, lane_width=3.25, sidewalk=3.5, main=True)
"""Cross-sections of main streets, of side streets, and of the rings around a town."""


def grid_network(blocks: tuple[int, int], seed: int) -> StreetNetwork:
    """Rows and columns of streets; some side streets are missing.

    Args:
        blocks: Number of blocks along x and y.
        seed: Seed of the crossings' places and of the missing streets.
    """
    chance = generator(seed, "streets", "grid")
    across, along = blocks[0] + 1, blocks[1] + 1
    column, row = (part.ravel() for part in np.meshgrid(range(across), range(along)))
    moves = chance.uniform(-_JITTER, _JITTER, (len(row), 2))
    nodes = (np.stack([column, row], axis=1) + moves) * BLOCK
    number = np.arange(len(nodes)).reshape(along, across)
    pairs = np.concatenate(
        [
            np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], axis=1),
            np.stack([number[:-1].ravel(), number[1:].ravel()], axis=1),
        ]
    )
    level = pairs[:, 1] - pairs[:, 0] == 1
    line = np.where(level, row[pairs[:, 0]], column[pairs[:, 0]])
    main = line % _MAIN_EVERY == _MAIN_EVERY // 2
    edge = np.where(level, (line == 0) | (line == blocks[1]), (line == 0) | (line == blocks[0]))
    kept = _kept(pairs, main | edge, chance)
    sections = [MAIN if is_main else SIDE for is_main in main[kept]]
    lines = [nodes[pair] for pair in pairs[kept]]
    return _joined(nodes, pairs[kept], lines, sections)


def ring_network(blocks: tuple[int, int], seed: int) -> StreetNetwork:
    """Rings around a centre, and streets that lead outwards.

    Args:
        blocks: Number of rings of blocks, and of blocks around the innermost ring.
        seed: Seed of the missing streets.
    """
    rings, sectors = blocks[0], max(blocks[1], 4)
    chance = generator(seed, "streets", "ring")
    inner = max(sectors * BLOCK[0] * 0.6 / (2.0 * np.pi), 45.0)
    radii = inner + BLOCK[1] * np.arange(rings + 1)
    step = 2.0 * np.pi / sectors
    angles = step * np.arange(sectors)
    nodes = np.concatenate(
        [radius * np.stack([np.cos(angles), np.sin(angles)], axis=1) for radius in radii]
    )
    pairs, lines, main = [], [], []
    for ring, radius in enumerate(radii):
        for sector in range(sectors):
            here, after = ring * sectors + sector, ring * sectors + (sector + 1) % sectors
            turns = angles[sector] + np.linspace(0.0, step, max(int(step / _ARC), 2) + 1)
            pairs.append((here, after))
            lines.append(radius * np.stack([np.cos(turns), np.sin(turns)], axis=1))
            main.append(ring in {0, rings})
            if ring < rings:
                pairs.append((here, here + sectors))
                lines.append(nodes[[here, here + sectors]])
                main.append(sector % 3 == 0)
    ends, important = np.array(pairs), np.array(main)
    kept = _kept(ends, important, chance)
    outer = np.all(ends >= rings * sectors, axis=1)
    sections = [AVENUE if outer[n] else MAIN if important[n] else SIDE for n in kept]
    return _joined(nodes, ends[kept], [lines[n] for n in kept], sections)


def organic_network(blocks: tuple[int, int], seed: int) -> StreetNetwork:
    """Streets of a town that grew: the borders of relaxed Voronoi cells, gently bent.

    Args:
        blocks: Number of blocks along x and y.
        seed: Seed of all places.
    """
    chance = generator(seed, "streets", "organic")
    size = np.array(blocks) * np.mean(BLOCK)
    points = chance.uniform(0.0, 1.0, (blocks[0] * blocks[1], 2)) * size
    for _ in range(_ROUNDS):
        cells = _cells(points, size)
        points = np.array([shapely.get_coordinates(shapely.centroid(cell))[0] for cell in cells])
    nodes, pairs = _borders(_cells(points, size))
    nodes, pairs = _without_short(nodes, pairs)
    pairs = _without_sharp(nodes, pairs)
    bends = chance.uniform(-_BULGE, _BULGE, len(pairs))
    lines = [_bent(nodes[pair], bend) for pair, bend in zip(pairs, bends, strict=True)]
    main = _through_routes(nodes, pairs, blocks)
    sections = [MAIN if n in main else SIDE for n in range(len(pairs))]
    return _joined(nodes, pairs, lines, sections)


LAYOUTS: Mapping[str, Callable[[tuple[int, int], int], StreetNetwork]] = {
    "grid": grid_network,
    "ring": ring_network,
    "organic": organic_network,
}
"""The layouts by name."""


def _kept(
    pairs: IntArray,
    important: np.ndarray[tuple[int], np.dtype[np.bool_]],
    chance: np.random.Generator,
) -> IntArray:
    """Numbers of the streets that stay: important ones, and most others; no dead end arises."""
    degree = np.bincount(pairs.ravel())
    kept = np.ones(len(pairs), bool)
    for n in np.flatnonzero((chance.random(len(pairs)) < _OPEN_SHARE) & ~important).tolist():
        if (degree[pairs[n]] > 3).all():
            kept[n] = False
            degree[pairs[n]] -= 1
    return np.flatnonzero(kept)


def _cells(points: FloatArray, size: FloatArray) -> list[shapely.Polygon]:
    """Voronoi cells within a rectangle: the points mirrored at its sides make them end there."""
    mirrored = [points]
    for axis in (0, 1):
        for side in (0.0, size[axis]):
            other = points.copy()
            other[:, axis] = 2.0 * side - other[:, axis]
            mirrored.append(other)
    diagram = Voronoi(np.concatenate(mirrored))
    return [
        shapely.Polygon(diagram.vertices[diagram.regions[diagram.point_region[n]]])
        for n in range(len(points))
    ]


def _borders(cells: Sequence[shapely.Polygon]) -> tuple[FloatArray, IntArray]:
    """Corners of the cells, and the pairs of corners that a border joins."""
    rings = [shapely.get_coordinates(cell.exterior) for cell in cells]
    corners = np.round(np.concatenate(rings), 3)
    nodes, number = np.unique(corners, axis=0, return_inverse=True)
    number, pairs, first = number.ravel(), [], 0
    for ring in rings:
        own = number[first : first + len(ring)]
        pairs.append(np.stack([own[:-1], own[1:]], axis=1))
        first += len(ring)
    joined = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
    return nodes, joined[joined[:, 0] != joined[:, 1]]


def _without_short(nodes: FloatArray, pairs: IntArray) -> tuple[FloatArray, IntArray]:
    """Joins the ends of short borders in their middle, the shortest first."""
    nodes = nodes.copy()
    while True:
        lengths = np.linalg.norm(nodes[pairs[:, 1]] - nodes[pairs[:, 0]], axis=1)
        n = int(lengths.argmin())
        if lengths[n] >= _SHORTEST:
            return nodes, pairs
        keep, drop = pairs[n]
        nodes[keep] = nodes[[keep, drop]].mean(0)
        pairs = np.sort(np.where(pairs == drop, keep, pairs), axis=1)
        pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


def _without_sharp(nodes: FloatArray, pairs: IntArray) -> IntArray:
    """Leaves out the shorter of two streets that meet at a sharp angle."""
    kept = np.ones(len(pairs), bool)
    steps = nodes[pairs[:, 1]] - nodes[pairs[:, 0]]
    lengths = np.linalg.norm(steps, axis=1)
    at_node = np.argsort(pairs.ravel(), kind="stable")
    firsts = np.searchsorted(pairs.ravel()[at_node], np.arange(len(nodes) + 1))
    for node in range(len(nodes)):
        ends = at_node[firsts[node] : firsts[node + 1]]
        # An end at an odd place of the pairs is a last one, from where the step points back.
        out = steps[ends // 2] * np.where(ends % 2, -1.0, 1.0)[:, None]
        turns = np.arctan2(out[:, 1], out[:, 0])
        while True:
            here = np.flatnonzero(kept[ends // 2])
            order = here[np.argsort(turns[here])]
            gaps = np.diff(turns[order], append=turns[order[:1]] + 2.0 * np.pi)
            if len(order) < 2 or gaps.min() >= _SHARPEST:
                break
            k = int(gaps.argmin())
            two = ends[order[[k, (k + 1) % len(order)]]] // 2
            kept[two[lengths[two].argmin()]] = False
    return pairs[kept]


def _through_routes(nodes: FloatArray, pairs: IntArray, blocks: tuple[int, int]) -> set[int]:
    """Numbers of the streets on the shortest ways across the town, some blocks apart."""
    lengths = np.linalg.norm(nodes[pairs[:, 1]] - nodes[pairs[:, 0]], axis=1)
    graph = csr_array((lengths, (pairs[:, 0], pairs[:, 1])), (len(nodes), len(nodes)))
    number = {(a, b): n for n, (a, b) in enumerate(pairs.tolist())}
    used = np.unique(pairs)
    size, main = nodes.max(0), set[int]()
    for axis in (0, 1):
        ways = max(round(blocks[1 - axis] / _MAIN_EVERY), 1)
        for way in range(ways):
            ends = np.zeros((2, 2))
            ends[:, 1 - axis] = size[1 - axis] * (way + 0.5) / ways
            ends[1, axis] = size[axis]
            first, last = (
                int(used[np.linalg.norm(nodes[used] - end, axis=1).argmin()]) for end in ends
            )
            start = np.array(first)
            _, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
            while last != first and before[last] >= 0:
                step = int(before[last])
                main.add(number[min(step, last), max(step, last)])
                last = step
    return main


def _bent(ends: FloatArray, bend: float) -> FloatArray:
    """A gentle arc between two nodes, as five points."""
    chord = ends[1] - ends[0]
    share = np.linspace(0.0, 1.0, 5)[:, None]
    normal = np.array([-chord[1], chord[0]])
    points: FloatArray = ends[0] + share * chord + 4.0 * bend * share * (1.0 - share) * normal
    return points


def _joined(
    nodes: FloatArray,
    pairs: IntArray,
    lines: Sequence[FloatArray],
    sections: Sequence[CrossSection],
) -> StreetNetwork:
    """The network of the nodes that streets use, numbered anew."""
    used, number = np.unique(pairs, return_inverse=True)
    ends = number.reshape(-1, 2).tolist()
    return StreetNetwork(
        nodes[used],
        tuple(
            Street(start, end, line, section)
            for (start, end), line, section in zip(ends, lines, sections, strict=True)
        ),
    )

"""Random road layouts for the training data."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, product

import numpy as np
import shapely
from scipy.spatial import cKDTree

from envgen_usd.chunks import CHUNK_SIZE, snap
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.models.road_surface import Patch, RoadLine, RoadSurface

KINDS = ("straight", "curve", "winding", "tee", "cross", "parallel", "bend", "grid")
"""Kinds of layouts."""
AREA = 2 * CHUNK_SIZE
"""Side length of a layout's square, metres; its lower left corner is at (0, 0)."""
STEP = 2.0
"""Distance between points of a reference line, metres; a larger value is coarser."""
REACH = 330.0
"""Distance from the centre to the end of roads that leave the square, metres."""
HILLY_STEP = 4.0
"""Distance between border vertices of hilly roads, metres; a larger value is coarser."""
LINE_POINTS, LINE_REACH = 24, 5.0
"""Number of reference line points behind a height, and the distance of their fading, metres.

"""


@dataclass(frozen=True)
class _Section:
    """Cross-section of a road: t of its borders, metres."""

    left: float
    right: float


def draw_layout(kind: str, rng: np.random.Generator, land: Heights | None = None) -> RoadSurface:
    """Draws roads of random position, orientation, width and slope.

    Args:
        kind: One of `KINDS`.
        rng: Source of all draws.
        land: Terrain under the reference lines; roads are level across. `None` means a common
            plane.
    """
    middle = AREA / 2 + rng.uniform(-60.0, 60.0, 2)
    turn = rng.uniform(0.0, 2 * math.pi)
    if kind in ("tee", "cross"):
        lines = _junction(kind, middle, turn, rng)
    elif kind == "parallel":
        lines = _parallel(middle, turn, rng)
    elif kind == "grid":
        lines = _grid(middle, turn, rng)
    else:
        lines = [_through(kind, "1", middle, turn, rng)]
    slope = rng.uniform(-0.03, 0.03, 2)
    if land is not None:
        return make_surface([_on_land(line, land) for line in lines], hilly=True)
    return make_surface([_on_plane(line, slope) for line in lines])


def lay_streets(lines: Sequence[FloatArray], widths: Sequence[float], land: Heights) -> RoadSurface:
    """Lays streets of a map over land; they are level across.

    Args:
        lines: Middle lines, N x 2, metres.
        widths: Width of each street, metres.
        land: Terrain under the middle lines.
    """
    streets = []
    for number, (points, width) in enumerate(zip(lines, widths, strict=True)):
        dense = shapely.get_coordinates(shapely.segmentize(shapely.linestrings(points), STEP))
        along = np.gradient(dense, axis=0)
        heading = np.arctan2(along[:, 1], along[:, 0])
        section = _Section(width / 2.0, -width / 2.0)
        streets.append(_on_land(_line(f"{number + 1}", dense, heading, section), land))
    return make_surface(streets, hilly=True)


def make_surface(lines: Sequence[RoadLine], hilly: bool = False) -> RoadSurface:
    """Builds the surface of the strips along reference lines.

    Args:
        lines: Reference lines.
        hilly: True if the surface follows the heights of the lines, false for a plane through them.
    """
    strips = [shapely.Polygon([*line.right_border(), *line.left_border()[::-1]]) for line in lines]
    joined = shapely.union_all(shapely.buffer(strips, 0.05, join_style="mitre"))
    closed = shapely.buffer(shapely.buffer(joined, 4.0), -4.0)  # fills the notches of junctions
    area = shapely.orient_polygons(shapely.simplify(closed, 0.02))
    area = shapely.segmentize(area, HILLY_STEP) if hilly else area
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
    corners = shapely.get_coordinates(shapely.orient_polygons(triangles)).reshape(-1, 4, 2)
    corners = snap(corners[:, :3])
    places, index = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    heights = (_heights_along if hilly else _heights)(places, lines)
    loops = shapely.get_rings(shapely.get_parts(area))
    numbers = {tuple(place): number for number, place in enumerate(places.tolist())}
    outline = tuple(
        np.array([numbers[tuple(p)] for p in snap(shapely.get_coordinates(loop)[:-1]).tolist()])
        for loop in loops
    )
    count = len(corners)
    return RoadSurface(
        vertices=np.column_stack([places, heights]),
        triangles=index.reshape(-1, 3).astype(np.int64),
        triangle_patch=np.zeros(count, dtype=np.int64),
        triangle_level=np.zeros(count, dtype=np.int64),
        patches=(Patch("road", "lane", "driving"),),
        outline=outline,
        lanes=(),
        roads=tuple(lines),
    )


def _heights(places: FloatArray, lines: Sequence[RoadLine]) -> FloatArray:
    """Height of the plane through all reference lines, metres."""
    points = np.concatenate([line.points for line in lines])
    base = np.column_stack([points[:, :2], np.ones(len(points))])
    plane = np.linalg.lstsq(base, points[:, 2], rcond=None)[0]
    heights: FloatArray = places @ plane[:2] + plane[2]
    return heights


def _heights_along(places: FloatArray, lines: Sequence[RoadLine]) -> FloatArray:
    """Heights of the nearest reference line points, blended where several are near, metres."""
    points = np.concatenate([line.points for line in lines])
    neighbours = cKDTree(points[:, :2]).query(places, LINE_POINTS)
    distance, near = np.asarray(neighbours[0]), np.asarray(neighbours[1])
    beyond = distance**2 - distance[:, :1] ** 2
    weight = np.exp(-beyond / (2 * LINE_REACH**2))
    heights: FloatArray = np.sum(weight * points[near, 2], axis=1) / weight.sum(axis=1)
    return heights


def _line(
    name: str, points: FloatArray, heading: FloatArray, section: _Section, junction: str = ""
) -> RoadLine:
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    return RoadLine(
        name,
        junction,
        s,
        np.column_stack([points, np.zeros(len(points))]),
        heading,
        np.full(len(points), section.left),
        np.full(len(points), section.right),
    )


def _trace(
    start: FloatArray, heading: float, curvature: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Integrates curvatures at every `STEP` metres; N x 2 points and N headings."""
    headings = heading + np.concatenate([[0.0], np.cumsum(curvature * STEP)])
    middle = (headings[1:] + headings[:-1]) / 2
    steps = STEP * np.column_stack([np.cos(middle), np.sin(middle)])
    return start + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), headings


def _section(rng: np.random.Generator) -> _Section:
    lane, sides = rng.uniform(2.8, 4.0), rng.uniform(0.0, 3.0, 2)
    lanes = rng.integers(1, 3, 2) if rng.uniform() < 0.3 else np.ones(2)
    return _Section(float(lane * lanes[0] + sides[0]), -float(lane * lanes[1] + sides[1]))


def _through(
    kind: str, name: str, middle: FloatArray, turn: float, rng: np.random.Generator
) -> RoadLine:
    """A road through the centre of the square."""
    count = int(REACH / STEP)
    place = np.arange(2 * count) * STEP
    if kind == "straight":
        curvature = np.zeros(2 * count)
    elif kind == "bend":
        radius = rng.uniform(12.0, 45.0)
        inside = np.abs(place - REACH) < radius * rng.uniform(0.5, 0.9)
        curvature = np.where(inside, rng.choice([-1, 1]) / radius, 0.0)
    elif kind == "curve":
        curvature = np.full(2 * count, rng.choice([-1, 1]) / rng.uniform(130.0, 500.0))
    else:
        wave = 2 * math.pi / rng.uniform(150.0, 350.0)
        curvature = np.sin(place * wave + rng.uniform(0, 6)) / rng.uniform(60.0, 200.0)
    points, heading = _trace(np.zeros(2), turn, curvature)
    points += middle - points[count]
    first = int(rng.integers(0, count // 2)) if rng.uniform() < 0.3 else 0
    last = len(points) - (int(rng.integers(0, count // 2)) if rng.uniform() < 0.3 else 0)
    return _line(name, points[first:last], heading[first:last], _section(rng))


def _parallel(middle: FloatArray, turn: float, rng: np.random.Generator) -> list[RoadLine]:
    """Two roads on opposite sides of a block."""
    apart = rng.uniform(50.0, 190.0) / 2 * np.array([-math.sin(turn), math.cos(turn)])
    lean = rng.uniform(-0.15, 0.15)
    return [
        _through("straight", "1", middle + apart, turn, rng),
        _through("straight", "2", middle - apart, turn + lean + rng.choice([0.0, math.pi]), rng),
    ]


def _junction(
    kind: str, middle: FloatArray, turn: float, rng: np.random.Generator
) -> list[RoadLine]:
    """Arms of a junction, and a connecting road for each pair of them."""
    quarters = (0, 1, 2, 3) if kind == "cross" else (0, 1, 2)
    headings = turn + np.array(quarters) * math.pi / 2 + rng.uniform(-0.2, 0.2, len(quarters))
    radius = rng.uniform(14.0, 20.0)
    section = _section(rng)
    arms, ends = [], []
    for number, heading in enumerate(headings):
        start = middle + radius * np.array([math.cos(heading), math.sin(heading)])
        bend = rng.uniform(-1, 1) / 300.0 if rng.uniform() < 0.5 else 0.0
        points, along = _trace(start, heading, np.full(int(REACH / STEP), bend))
        outwards = section if rng.uniform() < 0.5 else _Section(-section.right, -section.left)
        arm = _line(f"{number + 1}", points, along, outwards)
        arms.append(arm if rng.uniform() < 0.5 else _reverse(arm))
        ends.append(start)
    return arms + _links(middle, ends, 10)


def _links(middle: FloatArray, ends: Sequence[FloatArray], first: int) -> list[RoadLine]:
    """A connecting road for each pair of road ends, numbered from the first."""
    pairs = [(a, b) for a in range(len(ends)) for b in range(a)]
    return [_link(f"{first + n}", ends[a], middle, ends[b]) for n, (a, b) in enumerate(pairs)]


def _grid(middle: FloatArray, turn: float, rng: np.random.Generator) -> list[RoadLine]:
    """Streets around blocks: two to three rows and columns of junctions."""
    section, radius = _section(rng), rng.uniform(12.0, 18.0)
    counts = rng.integers(2, 4, 2)
    steps = [np.concatenate([[0.0], np.cumsum(rng.uniform(60.0, 180.0, n - 1))]) for n in counts]
    x, y = np.meshgrid(*(step - step.mean() for step in steps), indexing="ij")
    axes = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    nodes = middle + np.stack([x, y], axis=-1) @ axes
    ends: dict[tuple[int, ...], list[FloatArray]] = {n: [] for n in np.ndindex(*counts)}
    streets: list[RoadLine] = []
    for node, axis, sign in product(ends, (0, 1), (1, -1)):
        beyond = (node[0] + sign * (axis == 0), node[1] + sign * (axis == 1))
        inner = beyond in ends
        if (inner and sign < 0) or (not inner and rng.uniform() < 0.5):
            continue  # drawn from its other end, or a missing street
        start = nodes[node] + sign * radius * axes[axis]
        length = REACH
        ends[node].append(start)
        if inner:
            length = float(np.linalg.norm(nodes[beyond] - nodes[node])) - 2 * radius
            ends[beyond].append(nodes[beyond] - sign * radius * axes[axis])
        heading = turn + axis * math.pi / 2 + (sign < 0) * math.pi
        points, along = _trace(start, heading, np.zeros(max(1, round(length / STEP))))
        street = _line(f"{len(streets) + 1}", points, along, section)
        streets.append(street if rng.uniform() < 0.5 else _reverse(street))
    links = [_links(nodes[node], met, 100 + 10 * n) for n, (node, met) in enumerate(ends.items())]
    return [*streets, *chain.from_iterable(links)]


def _reverse(line: RoadLine) -> RoadLine:
    return _line(
        line.road,
        line.points[::-1, :2],
        line.heading[::-1] + math.pi,
        _Section(-float(line.t_right[0]), -float(line.t_left[0])),
        line.junction,
    )


def _link(name: str, start: FloatArray, middle: FloatArray, end: FloatArray) -> RoadLine:
    """A connecting road: a quadratic Bézier curve through a junction."""
    share = np.linspace(0.0, 1.0, 17)[:, None]
    points = (1 - share) ** 2 * start + 2 * share * (1 - share) * middle + share**2 * end
    tangent = (1 - share) * (middle - start) + share * (end - middle)
    return _line(name, points, np.arctan2(*tangent.T[::-1]), _Section(3.5, -3.5), "1")


def _on_plane(line: RoadLine, slope: FloatArray) -> RoadLine:
    points = line.points.copy()
    points[:, 2] = points[:, :2] @ slope
    return RoadLine(**{**vars(line), "points": points})


def _on_land(line: RoadLine, land: Heights) -> RoadLine:
    points = line.points.copy()
    points[:, 2] = land(points[:, :2])
    return RoadLine(**{**vars(line), "points": points})

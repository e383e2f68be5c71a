"""Roads made by hand: centre lines of one width, with the area that they cover."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest
import shapely

from envgen_usd.models.road_surface import RoadLine, RoadSurface

Lines = Mapping[str, np.ndarray]
Make = Callable[..., RoadSurface]


def _road_line(name: str, points: np.ndarray, half: float, town: str) -> RoadLine:
    steps = np.diff(points, axis=0)
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    middle = (heading[:-1] + heading[1:]) / 2
    heading = np.concatenate([heading[:1], middle, heading[-1:]])
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.T))])
    wide = np.full(len(s), half)
    xyz = np.column_stack([points, np.zeros(len(s))])
    junction = "9" if name.startswith("junction") else ""
    return RoadLine(name, junction, s, xyz, heading, wide, -wide, town)


def _surface(lines: Lines, half: float = 5.0, town: str = "town") -> RoadSurface:
    roads = tuple(_road_line(name, points, half, town) for name, points in lines.items())
    area = shapely.union_all(
        [
            shapely.polygons(np.concatenate([road.left_border(), road.right_border()[::-1]]))
            for road in roads
        ],
        grid_size=1e-3,
    )
    loops, vertices = [], np.empty((0, 3))
    parts = shapely.orient_polygons(shapely.get_parts(area), exterior_cw=False)
    for ring in shapely.get_rings(parts):
        plan = shapely.get_coordinates(ring)[:-1]
        loops.append(np.arange(len(vertices), len(vertices) + len(plan)))
        vertices = np.concatenate([vertices, np.column_stack([plan, np.zeros(len(plan))])])
    none = np.empty(0, dtype=np.int64)
    return RoadSurface(vertices, none.reshape(0, 3), none, none, (), tuple(loops), (), roads)


@pytest.fixture(scope="session")
def make_roads() -> Make:
    return _surface


@pytest.fixture(scope="session")
def lines() -> dict[str, Lines]:
    """Straight, curved, tight bends, T junction, crossing."""
    turn = np.linspace(0.0, 1.5, 60)
    tight = np.linspace(0.0, np.pi, 40)
    x = np.linspace(-100.0, 500.0, 200)

    def straight(a: tuple[float, float], b: tuple[float, float]) -> np.ndarray:
        return np.linspace(a, b, 8)

    arms = {
        "west": straight((-190.0, 100.0), (90.0, 100.0)),
        "east": straight((110.0, 100.0), (390.0, 100.0)),
        "junction_through": straight((90.0, 100.0), (110.0, 100.0)),
        "south": straight((100.0, -190.0), (100.0, 90.0)),
        "junction_south": straight((100.0, 90.0), (100.0, 100.0)),
    }
    return {
        "straight": {"1": straight((-300.0, 31.0), (700.0, 97.0))},
        "curved": {"1": np.stack([200 * np.sin(turn), 300 - 200 * np.cos(turn)], axis=1)},
        "winding": {"1": np.stack([x, 100 + 40 * np.sin(x / 45)], axis=1)},
        "hairpin": {"1": np.stack([100 + 15 * np.cos(tight), 100 + 15 * np.sin(tight)], axis=1)},
        "t": arms,
        "x": {
            **arms,
            "junction_north": straight((100.0, 100.0), (100.0, 110.0)),
            "north": straight((100.0, 110.0), (100.0, 390.0)),
        },
    }

"""Road surfaces made by hand: a polygon in plan and a height for each place."""

from collections.abc import Callable

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import CHUNK_SIZE, chunks_of_points, snap
from envgen_usd.models.road_surface import Patch, RoadSurface

Height = Callable[[np.ndarray, np.ndarray], np.ndarray]
Make = Callable[..., RoadSurface]


def _split(area: shapely.Geometry) -> list[shapely.Polygon]:
    """The area cut along the borders of chunks, on the millimetre grid."""
    chunks = chunks_of_points(shapely.get_coordinates(shapely.segmentize(area, CHUNK_SIZE / 4)))
    return [
        part
        for chunk in chunks
        for part in shapely.get_parts(
            shapely.intersection(area, shapely.box(*chunk.bounds), grid_size=1e-3)
        )
        if part.geom_type == "Polygon"
    ]


def _surface(area: shapely.Geometry, height: Height) -> RoadSurface:
    pieces = _split(area)
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(np.array(pieces)))
    corners = snap(shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3])
    a, b, c = np.moveaxis(corners, 1, 0)
    turned = _cross(b - a, c - a) < 0
    corners[turned] = corners[turned][:, ::-1]
    plan, index = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    number = {tuple(point): place for place, point in enumerate(plan.tolist())}
    outline = shapely.orient_polygons(
        shapely.get_parts(shapely.union_all(pieces, grid_size=1e-3)), exterior_cw=False
    )
    loops = [
        np.array(
            [number[tuple(point)] for point in snap(shapely.get_coordinates(ring))[:-1].tolist()]
        )
        for ring in shapely.get_rings(outline)
    ]
    vertices = np.column_stack([plan, snap(height(plan[:, 0], plan[:, 1]) + 0.0 * plan[:, 0])])
    zeros = np.zeros(len(corners), dtype=np.int64)
    patch = Patch("road_1_s0_lane_-1", "lane", "driving", "1", 0, -1)
    return RoadSurface(vertices, index.reshape(-1, 3), zeros, zeros, (patch,), tuple(loops), (), ())


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


@pytest.fixture(scope="session")
def make_surface() -> Make:
    return _surface


@pytest.fixture(scope="session")
def areas() -> dict[str, shapely.Geometry]:
    """Roads in plan: straight, curved, cross, ring with a block inside, tiny, on a border."""
    arc = np.linspace(0.0, 2.2, 80)
    bend = np.stack([250 * np.sin(arc) - 70.5, 260 - 250 * np.cos(arc)], axis=1)
    horizontal = shapely.LineString([(-150.3, 33.3), (333.3, 71.7)])
    vertical = shapely.LineString([(60.1, -120.0), (77.7, 260.2)])
    ring = shapely.Point(200.0, 200.0).buffer(90.05).boundary
    return {
        "straight": horizontal.buffer(5.0, cap_style="flat"),
        "curved": shapely.LineString(bend).buffer(4.2, cap_style="flat"),
        "cross": shapely.union(horizontal, vertical).buffer(6.1, cap_style="flat"),
        "ring": ring.buffer(3.5, join_style="mitre"),
        "lane": shapely.box(100.0, 100.0, 103.0, 400.0),
        "border": shapely.box(40.0, 200.0, 360.0, 207.0),
        "sliver": shapely.box(40.0, 200.1, 360.05, 207.0),
    }

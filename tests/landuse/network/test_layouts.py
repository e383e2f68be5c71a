import numpy as np
import pytest
import shapely

from envgen_usd.landuse.network.data.road_layouts import KINDS, draw_layout, lay_streets


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_layout_is_one_road_without_overlaps(kind, seed):
    surface = draw_layout(kind, np.random.default_rng(seed))
    triangles = shapely.polygons(surface.vertices[surface.triangles, :2])
    joined = shapely.union_all(triangles)
    assert shapely.area(triangles).sum() == pytest.approx(joined.area, rel=1e-6)
    assert all(np.all(np.diff(line.s) > 0) for line in surface.roads)
    if kind != "parallel":
        assert joined.buffer(0.01).geom_type == "Polygon"


def test_streets_of_a_grid_meet_in_junctions():
    surface = draw_layout("grid", np.random.default_rng(3))
    links = [line for line in surface.roads if line.junction]
    streets = [line for line in surface.roads if not line.junction]
    ends = np.concatenate([line.points[[0, -1], :2] for line in streets])
    for link in links:
        for end in link.points[[0, -1], :2]:
            assert np.linalg.norm(ends - end, axis=1).min() < 2.5


def test_streets_of_a_map_follow_the_land():
    lines = [np.array([[0.0, 0.0], [120.0, 0.0]]), np.array([[60.0, 0.0], [60.0, 80.0]])]
    surface = lay_streets(
        lines, [8.0, 6.0], lambda points: 0.1 * points[:, 0] - 0.05 * points[:, 1]
    )
    triangles = shapely.polygons(surface.vertices[surface.triangles, :2])
    crossing = 120.0 * 8.0 + 76.0 * 6.0
    # Streets are 0.1 m wider, and the notches of the junction are filled.
    assert crossing - 1.0 < shapely.area(triangles).sum() < crossing + 30.0
    for line, points in zip(surface.roads, lines, strict=True):
        assert line.s[-1] == pytest.approx(np.hypot(*(points[-1] - points[0])))
        assert np.diff(line.s).max() <= 2.0 + 1e-9
        heights = 0.1 * line.points[:, 0] - 0.05 * line.points[:, 1]
        assert line.points[:, 2] == pytest.approx(heights)
    # Away from the junction the first street is level across.
    x, y, z = surface.vertices.T
    along = (x > 10.0) & (x < 40.0)
    assert z[along] == pytest.approx(0.1 * x[along], abs=0.05)
    assert np.ptp(y[along]) == pytest.approx(8.0, abs=0.2)

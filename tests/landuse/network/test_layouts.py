import numpy as np
import pytest
import shapely

from envgen_usd.landuse.network.data.road_layouts import KINDS, draw_layout


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

"""The road of a map, cut to chunks: the same land as if each chunk had cut it out by itself."""

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import Chunk, chunks_of_points
from envgen_usd.landuse.road_areas import RoadAreas


@pytest.mark.parametrize("name", ["straight", "curved", "winding", "hairpin", "x"])
def test_a_chunk_has_the_road_that_lies_in_it(make_roads, lines, name):
    surface = make_roads(lines[name])
    rings = [shapely.Polygon(loop[:, :2]) for loop in surface.outline_loops()]
    whole = shapely.union_all([ring for ring in rings if ring.exterior.is_ccw])
    whole -= shapely.union_all([ring for ring in rings if not ring.exterior.is_ccw])
    areas = RoadAreas(surface)
    for chunk in chunks_of_points(surface.vertices, 200.0):
        found, expected = areas.in_chunk(chunk), whole & shapely.box(*chunk.bounds)
        assert found.is_valid
        assert shapely.symmetric_difference(found, expected).area < 1e-6
    far = areas.in_chunk(Chunk(50, 50))
    assert far.is_empty


def test_rings_begin_where_the_loop_begins(make_roads, lines):
    """What is written of a chunk is the same as if the loop had been cut to it at once."""
    surface = make_roads(lines["winding"])
    areas = RoadAreas(surface)
    (loop,) = surface.outline_loops()
    whole = shapely.make_valid(shapely.Polygon(loop[:, :2]))
    for chunk in chunks_of_points(surface.vertices):
        at_once = shapely.union_all([shapely.intersection(whole, shapely.box(*chunk.bounds))])
        at_once = shapely.difference(at_once, shapely.union_all([]))
        one, two = (shapely.get_coordinates(shape) for shape in (areas.in_chunk(chunk), at_once))
        # The edges here cross borders without a vertex, so that the cut rounds.
        assert np.allclose(one, two, atol=1e-9)

import numpy as np
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.landuse.shape_cells import cells_of_shapes


def test_an_empty_shape_covers_nothing_and_is_no_matter():
    """A plot that others cover wholly; GDAL warned of each."""
    left = shapely.box(0, 0, 100, 200)
    cells = cells_of_shapes(Chunk(0, 0), [(shapely.Polygon(), 1), (left, 2)])
    assert np.unique(cells[:, :127]).tolist() == [2]
    assert np.unique(cells[:, 128:]).tolist() == [0]
    assert not cells_of_shapes(Chunk(0, 0), [(shapely.Polygon(), 1)]).any()

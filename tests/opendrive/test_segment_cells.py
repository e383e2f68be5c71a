"""Segments beside fresh ones are found through cells of the plane."""

import numpy as np
import pytest
import shapely

from envgen_usd.opendrive.mesh.segment_cells import beside


@pytest.mark.parametrize("length", [500, 5_000, 60_000])
@pytest.mark.parametrize("seed", range(3))
def test_no_segment_within_reach_of_a_fresh_one_is_left_out(seed, length):
    rng = np.random.default_rng(seed)
    low = rng.integers(-400_000, 400_000, (2, 3000)).astype(float)
    high = low + rng.integers(-length, length + 1, low.shape)
    fresh = np.arange(3000) < 20
    reach = 2_000.0
    lines = shapely.linestrings(np.stack([low, high], axis=1).T)
    tree = shapely.STRtree(lines)
    near = np.unique(tree.query(lines[fresh], predicate="dwithin", distance=reach)[1])
    chosen = beside(low, high, reach, fresh)
    assert len(near) > 20
    assert np.isin(near, chosen).all()
    assert len(np.unique(chosen)) == len(chosen)
    # The selection is worth its cost: most others are left out.
    assert len(chosen) < 2000 or length == 60_000

"""Equal rows, held against NumPy's own search for them."""

import numpy as np
import pytest

from envgen_usd.geometry.unique_rows import unique_rows


@pytest.mark.parametrize("columns", [1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 2, 500])
@pytest.mark.parametrize("kind", [np.int64, np.float64])
def test_the_sets_are_those_of_numpy(columns, count, kind):
    draws = np.random.default_rng(columns + count)
    rows = draws.integers(-3, 4, (count, columns)).astype(kind)
    _, first, sets = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    found = unique_rows(rows)
    np.testing.assert_array_equal(found[0], first)
    np.testing.assert_array_equal(found[1], sets.ravel())


def test_a_zero_has_no_sign():
    first, sets = unique_rows(np.array([[0.0, 1.0], [-0.0, 1.0], [0.0, -0.0]]))
    np.testing.assert_array_equal(first, [2, 0])
    np.testing.assert_array_equal(sets, [1, 1, 0])

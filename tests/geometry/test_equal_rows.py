"""Equal rows have one place, and ranges follow one another."""

import numpy as np

from envgen_usd.geometry.flat_arrays import ascending, distinct_rows, spans


def test_distinct_rows_agree_with_sorted_tuples():
    rows = np.random.default_rng(3).integers(-2, 3, (200, 3))
    first, place = distinct_rows(rows)
    named = [tuple(row) for row in rows.tolist()]
    expected = sorted(set(named))
    assert [named[k] for k in first] == expected
    assert first.tolist() == [named.index(name) for name in expected]
    assert [expected[k] for k in place] == named


def test_no_rows_have_no_place():
    first, place = distinct_rows(np.empty((0, 2), dtype=np.int64))
    assert len(first) == len(place) == 0


def test_spans_are_ranges_one_after_another():
    starts, sizes = np.array([5, 0, 9, -1]), np.array([2, 0, 3, 1])
    assert spans(starts, sizes).tolist() == [5, 6, 9, 10, 11, -1]
    assert spans(starts[:0], sizes[:0]).tolist() == []


def test_ascending_values_are_distinct():
    assert ascending(np.array([2.5, -1.0, 2.5])).tolist() == [-1.0, 2.5]

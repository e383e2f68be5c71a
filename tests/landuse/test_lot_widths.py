"""Widths of sampled plots beside those that an environment asks for."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from envgen_usd.landuse.lot_widths import Lot, with_asked_widths
from envgen_usd.models.distribution import Quantiles

ROADSIDES = [SimpleNamespace(length=400.0), SimpleNamespace(length=300.0)]
ASKED = (20.0, 30.0)


def row(*lines, side=0, depth=30.0):
    """Lots that touch, between places along a roadside."""
    return [Lot(n, side, a, b, 0.0, depth, 0.5) for n, (a, b) in enumerate(pairwise(lines))]


def lines_of(lots):
    return [(round(lot.start, 6), round(lot.end, 6)) for lot in lots]


def test_lots_of_the_asked_width_stay_as_they_are():
    lots = [*row(0.0, 21.0, 50.0, 78.0), *row(10.0, 35.0, side=1)]
    assert lines_of(with_asked_widths(lots, ROADSIDES, ASKED)) == lines_of(lots)


def test_a_wide_lot_is_divided_into_equal_parts_nearest_to_the_mean():
    parts = with_asked_widths(row(10.0, 110.0), ROADSIDES, ASKED)
    assert lines_of(parts) == [(10.0, 35.0), (35.0, 60.0), (60.0, 85.0), (85.0, 110.0)]
    assert [part.depth for part in parts] == [30.0] * 4
    assert [part.entrance for part in parts] == [0.5] * 4
    assert len({part.number for part in parts}) == 4


def test_a_lot_too_wide_for_one_and_too_narrow_for_two_stays_whole():
    assert lines_of(with_asked_widths(row(0.0, 35.0), ROADSIDES, ASKED)) == [(0.0, 35.0)]


def test_narrow_lots_join_the_narrower_neighbour_and_keep_their_area():
    lots = row(0.0, 24.0, 36.0, 49.0, 75.0)
    lots[1] = Lot(1, 0, 24.0, 36.0, 0.0, 43.0, 0.5)
    joined = with_asked_widths(lots, ROADSIDES, ASKED)
    assert lines_of(joined) == [(0.0, 24.0), (24.0, 49.0), (49.0, 75.0)]
    assert joined[1].width * joined[1].depth == pytest.approx(12.0 * 43.0 + 13.0 * 30.0)
    # The entrance is that of the wider one, at 42.5 m.
    assert joined[1].start + joined[1].entrance * joined[1].width == pytest.approx(42.5)


def test_lots_join_across_land_on_which_no_lot_has_room():
    near = [*row(0.0, 12.0), *row(20.0, 33.0)]
    assert lines_of(with_asked_widths(near, ROADSIDES, ASKED)) == [(0.0, 33.0)]
    far = [*row(0.0, 21.0), *row(60.0, 82.0)]
    assert lines_of(with_asked_widths(far, ROADSIDES, ASKED)) == lines_of(far)


def test_a_narrow_lot_alone_takes_the_land_beside_it_and_no_more_than_there_is():
    least = 20.5  # below it lie 5 % of the asked widths
    (alone,) = with_asked_widths(row(100.0, 110.0), ROADSIDES, ASKED)
    assert alone.width == pytest.approx(least)
    assert alone.start + alone.entrance * alone.width == pytest.approx(105.0)
    (at_end,) = with_asked_widths(row(392.0, 398.0), ROADSIDES, ASKED)
    assert (at_end.start, at_end.end) == pytest.approx((400.0 - least, 400.0))
    lots = [Lot(0, 0, 0.0, 22.0, 0.0, 30.0, 0.5), Lot(1, 0, 43.0, 53.0, 0.0, 30.0, 0.5)]
    first, second = with_asked_widths(lots, ROADSIDES, ASKED)
    assert first.end <= second.start
    assert second.width == pytest.approx(least)


def test_widths_of_random_rows_lie_within_what_is_asked():
    rng = np.random.default_rng(1)
    asked = Quantiles((8.0, 10.0, 14.0, 25.0))
    for _ in range(50):
        starts = np.cumsum(rng.uniform(1.0, 40.0, 20))
        widths = np.minimum(rng.uniform(2.0, 60.0, 19), np.diff(starts))
        lots = [
            Lot(n, 0, a, a + w, 0.0, 25.0, 0.5)
            for n, (a, w) in enumerate(zip(starts[:-1].tolist(), widths.tolist(), strict=True))
        ]
        result = with_asked_widths(lots, [SimpleNamespace(length=900.0)], asked)
        ends = np.array([(lot.start, lot.end) for lot in result])
        assert np.all(ends[1:, 0] >= ends[:-1, 1] - 1e-9)
        assert np.all(np.diff(ends) <= 25.0)
        assert all(0.0 <= lot.entrance <= 1.0 for lot in result)

"""Which days belong to which season of deciduous plants."""

from datetime import date, timedelta

import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.light.seasons import SEASONS, check_season, days_of, season_of


@pytest.mark.parametrize(
    ("day", "northern", "southern"),
    [
        (date(2025, 1, 15), "winter", "summer"),
        (date(2025, 3, 31), "winter", "summer"),
        (date(2025, 7, 1), "summer", "winter"),
        (date(2025, 11, 1), "autumn", "summer"),
        (date(2025, 5, 1), "summer", "autumn"),
        (date(2025, 12, 31), "winter", "summer"),
    ],
)
def test_seasons_of_both_hemispheres(day, northern, southern):
    assert (season_of(day, 52.0), season_of(day, -34.0)) == (northern, southern)


@pytest.mark.parametrize("latitude", [52.0, -34.0])
def test_each_day_is_in_one_season(latitude):
    days = [day for season in SEASONS for day in days_of(season, latitude)]
    assert sorted(days) == [date(2025, 1, 1) + timedelta(days=n) for n in range(365)]


def test_a_stage_without_a_season_has_the_whole_year():
    assert len(days_of("", 50.0)) == 365


def test_an_unknown_season_is_refused_with_the_known_ones():
    for name in ("", "random", *SEASONS):
        check_season(name)
    with pytest.raises(EnvgenError, match=r"monsoon; known: summer, autumn, winter, random"):
        check_season("monsoon")

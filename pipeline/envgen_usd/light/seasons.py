"""Seasons of deciduous plants: which days they have leaves."""

from datetime import date, timedelta

from envgen_usd.errors import EnvgenError
from envgen_usd.light.weather import RANDOM

SUMMER, AUTUMN, WINTER = "summer", "autumn", "winter"
SEASONS = (SUMMER, AUTUMN, WINTER)
"""Names of the option ``--season`` and of the variants of plants."""
FIRST_DAY = date(2025, 1, 1)
YEAR = 365
_STARTS = ((date(2025, 4, 28), SUMMER), (date(2025, 10, 16), AUTUMN), (date(2025, 11, 14), WINTER))
"""First days in the north.

Late autumn, when oaks colour, begins on 16 October in Germany (German Weather Service, mean of 1981
to 2010). The days of leaf unfolding and of bare crowns are ours: the last days of April, and four
weeks after colouring.
"""


def season_of(day: date, latitude: float) -> str:
    """Returns the season of a day; south of the equator it is that of half a year later.

    Args:
        day: Date.
        latitude: Degrees, north positive.
    """
    shift = YEAR // 2 if latitude < 0.0 else 0
    northern = FIRST_DAY + timedelta(days=((day - FIRST_DAY).days + shift) % YEAR)
    begun = [season for start, season in _STARTS if start <= northern]
    return begun[-1] if begun else WINTER


def days_of(season: str, latitude: float) -> tuple[date, ...]:
    """Returns the days of a season in the order of the year; all days for an unknown name."""
    days = [FIRST_DAY + timedelta(days=number) for number in range(YEAR)]
    chosen = tuple(day for day in days if season_of(day, latitude) == season)
    return chosen or tuple(days)


def check_season(name: str) -> None:
    """Raises an error unless a name is empty, a season or ``random``.

    Raises:
        EnvgenError: Any other name.
    """
    if name and name not in {*SEASONS, RANDOM}:
        known = ", ".join((*SEASONS, RANDOM))
        raise EnvgenError(f"render: unknown season {name}; known: {known}")

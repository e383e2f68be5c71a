"""The light of each frame: that of the stage, of a weather, or of weathers drawn at random."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import date, datetime, timedelta
from functools import lru_cache

import numpy as np
from pxr import Usd

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.geometry.georeference import origin_degrees
from envgen_usd.light.seasons import FIRST_DAY, YEAR, check_season, days_of, season_of
from envgen_usd.light.sky import make_atmosphere
from envgen_usd.light.sun_position import sun_direction
from envgen_usd.light.weather import RANDOM, Moment, Weather, read_weather, read_weathers
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.render_scene import Lamps
from envgen_usd.render.stage.stage_season import stage_season
from envgen_usd.seeds import generator

LASTS = 4
"""Frames that share a drawn moment; a larger value renders faster and varies less."""
_TRIES = 500
"""Draws of date and hour until the sun has an elevation of the weather."""
_LATITUDE = 48.0
"""Latitude in degrees of a stage without a georeference."""
_GOLDEN = (5.0**0.5 - 1.0) / 2.0
"""Step between the draws of weathers, which spreads any number of them evenly (L. Kuipers and
H. Niederreiter, "Uniform distribution of sequences", 1974)."""
_LAMPS_ON = -6.0
"""Elevation of the sun in degrees at the end of civil twilight: streets need lamps."""
_EQUINOX = date(2025, 3, 20)
"""Date that holds where only the hour is given."""


@dataclass(frozen=True)
class LightChoice:
    """What the user asks of the light.

    Attributes:
        weather: Name of a shipped weather, a TOML file, ``random``, or empty for the stage's light.
        hour: Solar time; `None` draws it.
        day: Date; `None` draws it, or is the equinox if the hour is given.
        seed: Random seed.
        season: Season of the plants, ``random``, or empty. Empty is the season of `day`, is drawn
            with a random weather, and is otherwise that of the stage.
    """

    weather: str = ""
    hour: float | None = None
    day: date | None = None
    seed: int = 0
    season: str = ""


@dataclass(frozen=True)
class FrameMoment:
    """The drawn light of a frame.

    Attributes:
        record: What `cameras.json` says of it.
        moment: Air and clouds.
        sun: 3, unit vector towards the sun.
    """

    record: Mapping[str, object]
    moment: Moment
    sun: FloatArray


class FrameLight:
    """The light of all frames of a run.

    Attributes:
        weathers: The weathers among which frames choose, by name; empty for the stage's light.
        issues: What was decided about the light.
    """

    def __init__(
        self,
        choice: LightChoice,
        stage: Usd.Stage,
        weathers: Mapping[str, Weather] | None = None,
    ) -> None:
        """Reads the weathers, unless they are given by name.

        Raises:
            EnvgenError: The weather does not exist or its file is faulty.
        """
        self._choice = choice
        self.weathers = self._read() if weathers is None else weathers
        known = latitude_of(stage)
        self._latitude = _LATITUDE if known is None else known
        self._season = stage_season(stage)
        self._days = days_of(self._season, self._latitude)
        self.issues: tuple[Issue, ...] = ()
        if known is None and self.is_chosen:
            text = "the stage has no georeference that gives a latitude"
            action = f"the sun is that of {_LATITUDE:g} degrees north"
            self.issues = (Issue("render.latitude", Severity.INFO, "/", text, action),)
        self._skies = lru_cache(maxsize=2)(self._sky)

    def _read(self) -> Mapping[str, Weather]:
        name = self._choice.weather or ("clear" if self.is_chosen else "")
        shipped = read_weathers() if name == RANDOM else {}
        return shipped or ({name: read_weather(name)} if name else {})

    @property
    def is_chosen(self) -> bool:
        """False if the light is that of the stage."""
        choice = self._choice
        return bool(choice.weather) or choice.hour is not None or choice.day is not None

    @property
    def settings(self) -> dict[str, object]:
        """All that the drawn light follows from; nothing for the stage's light."""
        if not self.is_chosen:
            return {}
        weathers = {name: asdict(weather) for name, weather in self.weathers.items()}
        choice = asdict(self._choice)
        return {"choice": choice, "weathers": weathers, "latitude": self._latitude}

    def record(self, frame: int) -> Mapping[str, object]:
        """Returns weather, date, hour and elevation of the sun; nothing for the stage's light."""
        return self._moment(frame // LASTS).record if self.is_chosen else {}

    def at(self, frame: int) -> Atmosphere | None:
        """Returns the light of a frame; `None` for that of the stage."""
        return self._skies(frame // LASTS) if self.is_chosen else None

    def _sky(self, number: int) -> Atmosphere:
        drawn = self._moment(number)
        rng = generator(self._choice.seed, "render", "clouds", number)
        return make_atmosphere(drawn.moment, drawn.sun, rng)

    def _moment(self, number: int) -> FrameMoment:
        rng = generator(self._choice.seed, "render", "light", number)
        name = self._weather(number)
        weather = self.weathers[name]
        sun, day, hour = self._sun(weather, rng)
        record = {
            "weather": name,
            **({"season": self._season} if self._season else {}),
            "date": day.strftime("%m-%d"),
            "hour": round(hour, 2),
            "sun_elevation": round(float(np.degrees(np.arcsin(np.clip(sun[2], -1, 1)))), 2),
        }
        return FrameMoment(record, Moment.drawn(weather, rng), sun)

    def _weather(self, number: int) -> str:
        """Draws a weather so that each has its share in short runs, too."""
        names = list(self.weathers)
        ends = np.cumsum([weather.share for weather in self.weathers.values()])
        start = generator(self._choice.seed, "render", "weathers").random()
        drawn = (start + number * _GOLDEN) % 1.0
        return names[min(int(np.searchsorted(ends, drawn * ends[-1], "right")), len(names) - 1)]

    def _sun(self, weather: Weather, rng: np.random.Generator) -> tuple[FloatArray, date, float]:
        """Draws date and hour, so that the sun has an elevation of the weather."""
        choice = self._choice
        low, high = np.sin(np.radians(weather.elevation))
        best: tuple[float, FloatArray, date, float] | None = None
        for _ in range(_TRIES):
            drawn = self._days[int(rng.integers(len(self._days)))]
            hour = float(rng.uniform(0.0, 24.0)) if choice.hour is None else choice.hour
            day = choice.day or (drawn if choice.hour is None else _EQUINOX)
            sun = sun_direction(self._latitude, day, hour)
            off = max(low - float(sun[2]), float(sun[2]) - high, 0.0)
            if best is None or off < best[0]:
                best = off, sun, day, hour
            if off == 0.0 or choice.hour is not None:
                break
        assert best is not None
        return best[1:]


def lamp_issues(lamps: Lamps, records: Sequence[Mapping[str, object]]) -> list[Issue]:
    """Issue of frames by night on a stage without lamps; only the sky's glow lights them."""
    dark = [record for record in records if _elevation(record) < _LAMPS_ON]
    if not dark or len(lamps.places):
        return []
    text = f"{len(dark)} frames are by night, and the stage has no lamps"
    return [Issue("render.lamps", Severity.WARNING, "/", text, "only the sky lights them")]


def _elevation(record: Mapping[str, object]) -> float:
    value = record.get("sun_elevation", 90.0)
    return value if isinstance(value, float) else 90.0


def chosen_season(choice: LightChoice, latitude: float | None) -> str:
    """Returns the season of a run; empty for that of the stage.

    All frames of a run share a season. A random one is that of a random day of the year.

    Args:
        choice: What the user asks.
        latitude: Degrees, or `None` for a stage without a georeference.

    Raises:
        EnvgenError: The season does not exist.
    """
    check_season(choice.season)
    place = _LATITUDE if latitude is None else latitude
    if choice.season not in {"", RANDOM}:
        return choice.season
    if not choice.season and choice.day is not None:
        return season_of(choice.day, place)
    if RANDOM in {choice.season, choice.weather}:
        number = int(generator(choice.seed, "render", "season").integers(YEAR))
        return season_of(FIRST_DAY + timedelta(days=number), place)
    return ""


def parse_day(text: str) -> date | None:
    """Reads a date as MM-DD; `None` for an empty text.

    Raises:
        EnvgenError: The text is no date.
    """
    if not text:
        return None
    try:
        return datetime.strptime(f"2025-{text}", "%Y-%m-%d").date()
    except ValueError as error:
        raise EnvgenError(f"render: --date {text} is not a date as MM-DD, e.g. 06-21") from error


def latitude_of(stage: Usd.Stage) -> float | None:
    """Returns the latitude of a stage's origin in degrees; `None` without a georeference."""
    data = stage.GetRootLayer().customLayerData
    offset = data.get("offset", (0.0, 0.0, 0.0))
    place = origin_degrees(str(data.get("geo_reference", "")), (offset[0], offset[1], offset[2]))
    return None if place is None else place[0]

"""Weather, date, hour and sun of a frame."""

from collections import Counter
from datetime import date

import numpy as np
import pytest
from pxr import Usd

from envgen_usd.errors import EnvgenError
from envgen_usd.light.seasons import days_of, season_of
from envgen_usd.light.weather import RANDOM, read_weathers
from envgen_usd.render.frames.frame_light import (
    LASTS,
    FrameLight,
    LightChoice,
    chosen_season,
    lamp_issues,
    latitude_of,
    parse_day,
)
from envgen_usd.render.render_scene import Lamps
from envgen_usd.render.stage.stage_season import set_season


@pytest.fixture
def stage():
    return Usd.Stage.CreateInMemory()


@pytest.mark.parametrize("hour", [0.0, 3.0, 6.0, 9.0, 12.0, 15.0, 21.0])
def test_the_elevation_of_the_sun_at_the_equinox(stage, hour):
    """sin h = cos(latitude) cos(hour angle), by day and by night; 48 degrees without a place."""
    record = FrameLight(LightChoice(hour=hour), stage).record(0)
    expected = np.arcsin(np.cos(np.radians(48)) * np.cos(np.radians(15 * (hour - 12))))
    assert record["sun_elevation"] == pytest.approx(np.degrees(expected), abs=0.5)
    assert (record["date"], record["hour"]) == ("03-20", hour)


@pytest.mark.parametrize(("month", "declination"), [(6, 23.44), (12, -23.44)])
def test_the_elevation_of_the_sun_at_noon_of_the_solstices(stage, month, declination):
    record = FrameLight(LightChoice(hour=12.0, day=date(2025, month, 21)), stage).record(0)
    assert record["sun_elevation"] == pytest.approx(90 - 48 + declination, abs=0.1)
    assert record["date"] == f"{month:02d}-21"


def test_drawn_suns_have_the_elevation_of_their_weather(stage):
    weathers = read_weathers()
    lights = FrameLight(LightChoice(RANDOM, seed=5), stage)
    records = [lights.record(frame) for frame in range(0, 400 * LASTS, LASTS)]
    for record in records:
        low, high = weathers[record["weather"]].elevation
        assert low - 0.01 <= record["sun_elevation"] <= high + 0.01


@pytest.mark.parametrize("count", [15, 100, 400])
def test_weathers_have_their_shares_in_short_runs_too(stage, count):
    """Independent draws of a weather that comes with a share of 0.18 would differ by 7.7 of 400."""
    weathers = read_weathers()
    total = sum(weather.share for weather in weathers.values())
    starts = []
    for seed in range(6):
        lights = FrameLight(LightChoice(RANDOM, seed=seed), stage)
        names = [lights.record(LASTS * number)["weather"] for number in range(count)]
        drawn = Counter(names)
        for name, weather in weathers.items():
            assert abs(drawn[name] - count * weather.share / total) < 2.5
        starts.append(tuple(names[:5]))
    assert len(set(starts)) > 3


def test_frames_of_a_moment_share_their_light(stage):
    lights = FrameLight(LightChoice(RANDOM, seed=1), stage)
    records = [dict(lights.record(frame)) for frame in range(3 * LASTS)]
    for start in range(0, len(records), LASTS):
        assert records[start : start + LASTS] == [records[start]] * LASTS
    assert len({tuple(record.items()) for record in records}) == 3


def test_without_a_choice_the_light_is_that_of_the_stage(stage):
    lights = FrameLight(LightChoice(), stage)
    assert (lights.is_chosen, dict(lights.record(0)), lights.at(0)) == (False, {}, None)


def test_a_date_is_a_month_and_a_day():
    assert parse_day("") is None
    assert parse_day("06-21") == date(2025, 6, 21)
    with pytest.raises(EnvgenError, match="02-30"):
        parse_day("02-30")


def test_the_latitude_is_that_of_the_offset_of_the_georeference(stage):
    """A degree of latitude on the sphere of a Mercator map: y = R ln tan(45 deg + half of it)."""
    assert latitude_of(stage) is None
    assert [issue.kind for issue in FrameLight(LightChoice("clear"), stage).issues] == [
        "render.latitude"
    ]
    assert FrameLight(LightChoice(), stage).issues == (), "the stage's light needs no place"
    radius, latitude = 6378137.0, np.radians(52.5)
    y = radius * np.log(np.tan(np.pi / 4 + latitude / 2))
    stage.GetRootLayer().customLayerData = {
        "geo_reference": f"+proj=merc +a={radius} +b={radius} +units=m +no_defs",
        "offset": (1000.0, float(y), 0.0),
    }
    assert latitude_of(stage) == pytest.approx(52.5, abs=0.2)
    assert FrameLight(LightChoice("clear"), stage).issues == ()


@pytest.mark.parametrize(
    ("choice", "season"),
    [
        (LightChoice(), ""),
        (LightChoice("clear"), ""),
        (LightChoice("clear", season="winter"), "winter"),
        (LightChoice(day=date(2025, 7, 1)), "summer"),
        (LightChoice(RANDOM, day=date(2025, 1, 10)), "winter"),
        (LightChoice(day=date(2025, 7, 1), season="autumn"), "autumn"),
    ],
)
def test_the_season_is_asked_for_or_follows_the_date(choice, season):
    assert chosen_season(choice, 50.0) == season


def test_random_seasons_come_by_their_days():
    """Within five standard deviations of a binomial draw."""
    drawn = [chosen_season(LightChoice(RANDOM, seed=seed), 50.0) for seed in range(400)]
    p = len(days_of("winter", 50.0)) / 365
    assert abs(drawn.count("winter") - 400 * p) <= 5 * np.sqrt(400 * p * (1 - p))
    assert set(drawn) == {"summer", "autumn", "winter"}


def test_drawn_dates_lie_in_the_season_of_the_stage(stage):
    set_season(stage, "autumn")
    lights = FrameLight(LightChoice("overcast", seed=3), stage)
    for frame in range(0, 50 * LASTS, LASTS):
        record = lights.record(frame)
        assert record["season"] == "autumn"
        assert season_of(date.fromisoformat(f"2025-{record['date']}"), 48.0) == "autumn"


def test_a_night_without_lamps_is_an_issue(stage):
    night = [dict(FrameLight(LightChoice(hour=0.0), stage).record(0))]
    noon = [dict(FrameLight(LightChoice(hour=12.0), stage).record(0))]
    lamp = Lamps(
        np.zeros((1, 3)), np.ones((1, 3)), np.array([[0.0, 0, -1]]), np.ones(1), np.ones(1)
    )
    assert [issue.kind for issue in lamp_issues(Lamps(), night)] == ["render.lamps"]
    assert (
        lamp_issues(lamp, night) == lamp_issues(Lamps(), noon) == lamp_issues(Lamps(), [{}]) == []
    )

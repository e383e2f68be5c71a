"""Weather, date, hour and sun of a frame."""

import numpy as np
import pytest
from pxr import Usd

from envgen_usd.render.frame_light import FrameLight, LightChoice


@pytest.mark.parametrize("hour", [0.0, 3.0, 6.0, 9.0, 12.0, 15.0, 21.0])
def test_the_elevation_of_the_sun_at_the_equinox(hour):
    """sin h = cos(latitude) cos(hour angle), by day and by night; 48 degrees without a place."""
    record = FrameLight(LightChoice(hour=hour), Usd.Stage.CreateInMemory()).record(0)
    expected = np.arcsin(np.cos(np.radians(48)) * np.cos(np.radians(15 * (hour - 12))))
    assert record["sun_elevation"] == pytest.approx(np.degrees(expected), abs=0.5)
    assert (record["date"], record["hour"]) == ("03-20", hour)

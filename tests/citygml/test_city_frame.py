"""Reference systems of city models: what their names mean is decided by the coordinates."""

import numpy as np
import pytest

from envgen_usd.citygml.city_frame import frame_of

# swisstopo: Bern, the origin of the Swiss grid, is 600 km east, 200 km north in CH1903 / LV03.
BERN = np.array([600_000.0, 200_000.0, 540.0])


@pytest.mark.parametrize("corner", [BERN, BERN[[1, 0, 2]]])
def test_a_datum_alone_means_its_national_projection(corner: np.ndarray) -> None:
    frame = frame_of("CH1903", corner)
    assert frame.crs == "EPSG:21781"
    assert [(i.kind, "CH1903 / LV03" in i.action) for i in frame.issues] == [
        ("city.srs_name", True)
    ]
    placed = frame.place(corner[None])[0] + frame.offset
    assert placed == pytest.approx(BERN)


def test_a_name_that_does_not_fit_is_reported_and_coordinates_stay() -> None:
    frame = frame_of("CH1903", np.array([458_868.0, 5_438_343.0, 110.0]))
    assert frame.crs == ""
    assert [issue.action for issue in frame.issues] == ["coordinates used unchanged"]


def test_an_order_of_axes_against_the_authority_is_reported() -> None:
    """EPSG:31466 gives northing first; this place is Cologne, easting first."""
    place = np.array([2_567_000.0, 5_645_000.0, 50.0])
    frame = frame_of("urn:ogc:def:crs:EPSG::31466", place)
    assert [issue.action for issue in frame.issues] == ["read as easting first"]
    assert frame_of("urn:ogc:def:crs:EPSG::31466", place[[1, 0, 2]]).issues == ()
    assert frame_of("EPSG:31466", place).issues == ()

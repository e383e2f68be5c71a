"""Reference systems of city models: what their names mean is decided by the coordinates."""

import warnings
from functools import cache

import numpy as np
import pyproj
import pytest
from pyproj.database import query_crs_info

from envgen_usd.errors import EnvgenError, Severity
from envgen_usd.geometry.city_frame import Clues, frame_of

# swisstopo: Bern, the origin of the Swiss grid, is 600 km east, 200 km north in CH1903 / LV03.
BERN = np.array([600_000.0, 200_000.0, 540.0])
SOLDNER = "urn:ogc:def:crs:EPSG::3068"
# The origin of the Berlin grid: Müggelberg has 40 km east and 10 km north (EPSG 19996).
BERLIN = np.array([24_750.0, 20_400.0, 35.0])


def orders(frame):
    return [(i.severity, i.action) for i in frame.issues if i.kind == "city.axis_order"]


@pytest.mark.parametrize("corner", [BERN, BERN[[1, 0, 2]]])
def test_a_datum_alone_means_its_national_projection(corner: np.ndarray) -> None:
    frame = frame_of("CH1903", corner)
    assert frame.crs == "EPSG:21781"
    named = [issue for issue in frame.issues if issue.kind == "city.srs_name"]
    assert ["CH1903 / LV03" in issue.action for issue in named] == [True]
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
    assert orders(frame) == [(Severity.WARNING, "read as easting first")]
    declared = frame_of("urn:ogc:def:crs:EPSG::31466", place[[1, 0, 2]])
    assert orders(declared) == [(Severity.INFO, "read as northing first")]


def test_a_name_without_a_question_of_axes_says_nothing() -> None:
    assert frame_of("EPSG:25832", np.array([691_000.0, 5_336_000.0, 0.0])).issues == ()


@pytest.mark.parametrize("swapped", [False, True])
def test_the_order_that_lies_at_the_road_is_taken(swapped: bool) -> None:
    """Both orders lie in the area of use of the Berlin grid, 6 km from each other."""
    to_road = pyproj.Transformer.from_crs("EPSG:3068", "EPSG:25833", always_xy=True)
    east, north = to_road.transform(BERLIN[0], BERLIN[1])
    road = np.array([[east - 100, north - 100, 30], [east + 100, north + 100, 40]])
    # Solids that face inwards do not outweigh the road.
    clues = Clues(facing=4 if swapped else -4, road=road)

    corner = BERLIN[[1, 0, 2]] if swapped else BERLIN
    frame = frame_of(SOLDNER, corner, "EPSG:25833", (0.0, 0.0, 0.0), clues)

    assert frame.place(corner[None])[0] == pytest.approx([east, north, 35], abs=1e-6)
    severity = Severity.INFO if swapped else Severity.WARNING
    order = "northing" if swapped else "easting"
    assert orders(frame) == [(severity, f"read as {order} first")]


@pytest.mark.parametrize(("facing", "swapped"), [(3, False), (-3, True), (0, True)])
def test_solids_decide_the_order_where_the_place_does_not(facing: int, swapped: bool) -> None:
    """Without any sign the authority's order holds: northing first."""
    frame = frame_of(SOLDNER, BERLIN, clues=Clues(facing=facing))
    assert frame.swapped == swapped
    order = "northing" if swapped else "easting"
    severity = Severity.INFO if swapped else Severity.WARNING
    assert orders(frame) == [(severity, f"read as {order} first")]


def test_solids_that_face_inwards_do_not_swap_axes_without_a_question() -> None:
    frame = frame_of("EPSG:25832", [691_000.0, 5_336_000.0, 0.0], clues=Clues(facing=-9))
    assert not frame.swapped


def test_feet_and_depths_become_metres() -> None:
    """NAD83 / New York Long Island in feet, heights in feet: 1 ft is 1200 / 3937 m."""
    corner = np.array([[984_250.0, 200_000.0, 3937.0]])
    frame = frame_of("EPSG:2263+6360", corner, "EPSG:32118", (0.0, 0.0, 0.0))
    assert frame.place(corner)[0] == pytest.approx([300_000.0, 60_960.12, 1200.0], abs=0.01)


def test_geocentric_coordinates_are_placed() -> None:
    """PROJ's own transformation gives the truth."""
    degrees = (9.0, 50.0, 120.0)
    to_earth = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    corner = np.array([to_earth.transform(*degrees)])
    frame = frame_of("EPSG:4978", corner)
    assert frame.crs == "EPSG:32632"
    # Nine degrees east is the central meridian of zone 32.
    placed = frame.place(corner)[0] + frame.offset
    assert placed[[0, 2]] == pytest.approx([500_000.0, 120.0], abs=1e-3)


def test_a_system_that_nobody_knows_is_named_where_a_road_needs_it() -> None:
    with pytest.raises(EnvgenError, match="PROJ does not know the reference system 'EPSG:999999'"):
        frame_of("EPSG:999999", BERLIN, "EPSG:25833")
    assert frame_of("EPSG:999999", BERLIN).crs == ""


@cache
def sample():
    """Every 300th system of each authority and type that PROJ knows."""
    known = query_crs_info(allow_deprecated=True)
    groups: dict[tuple[str, str], list[str]] = {}
    for info in known:
        groups.setdefault((info.auth_name, info.type.name), []).append(
            f"{info.auth_name}:{info.code}"
        )
    return tuple(name for group in groups.values() for name in group[::300])


def test_every_system_that_proj_knows_places_a_city() -> None:
    """On Earth, what was placed leads back to where it was; other planets do not raise."""
    checked = 0
    for name in sample():
        with warnings.catch_warnings(action="ignore"):
            crs = pyproj.CRS.from_user_input(name)
        plan = crs.sub_crs_list[0] if crs.is_compound else crs
        if not plan.is_projected:
            continue
        area = plan.area_of_use
        middle = (0.0, 0.0)
        if area is not None and area.west < area.east:
            middle = ((area.west + area.east) / 2, (area.south + area.north) / 2)
        east, north = pyproj.Transformer.from_crs(
            plan.geodetic_crs, plan, always_xy=True
        ).transform(*middle)
        if not np.isfinite((east, north)).all():
            continue
        corner = np.array([[east, north, 0.0]])
        frame = frame_of(name, corner, offset=(0.0, 0.0, 0.0))
        back = pyproj.Transformer.from_crs(frame.crs, plan, always_xy=True)
        placed = frame.place(corner)[0]
        assert back.transform(placed[0], placed[1]) == pytest.approx((east, north), abs=1e-3), name
        checked += 1
    assert checked > 20


def test_systems_of_other_kinds_are_placed_or_refused_in_a_line() -> None:
    place = np.array([[9.0, 48.0, 500.0]])
    refusals = []
    for name in sample():
        try:
            frame_of(name, place, "EPSG:25832", (0.0, 0.0, 0.0)).place(place)
        except EnvgenError as error:
            refusals.append(str(error))
    assert all("\n" not in text and "no transformation leads from" in text for text in refusals)


def test_other_kinds_of_systems_are_no_places() -> None:
    for name in ("EPSG:5783", "EPSG:3855"):
        assert frame_of(name, BERLIN).crs == ""

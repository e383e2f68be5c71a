import pytest

from envgen_usd.errors import Severity
from envgen_usd.geometry.georeference import check_crs, parse_crs

UNUSABLE = [
    "<TODO/>",
    "+lat_0=4.9000000000000000e+1 +lon_0=8.0000000000000000e+0",
    "EPSG:999999",
    "EPSG:4326",
    "+proj=utm +zone=18 +datum=WGS84 +units=us-ft",
]
GEOID = "+proj=tmerc +lat_0=40 +lon_0=-3 +datum=WGS84 +units=m +geoidgrids=egm96_15.gtx +vunits=m"


@pytest.mark.parametrize("text", UNUSABLE)
def test_an_unusable_reference_system_is_one_issue_and_makes_no_noise(capfd, text):
    assert parse_crs(text) is None
    (issue,) = check_crs(text)
    assert issue.severity == Severity.WARNING
    assert text[:10] in issue.message
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("text", ["", "  \n"])
def test_without_a_reference_system_there_is_nothing_to_say(text):
    assert parse_crs(text) is None
    assert check_crs(text) == ()


@pytest.mark.parametrize(
    ("text", "epsg"),
    [("+proj=utm +zone=32 +datum=WGS84 +units=m", 32632), ("epsg:25833", 25833), (GEOID, None)],
)
def test_reference_systems_in_metres_are_understood(text, epsg):
    crs = parse_crs(text)
    assert crs is not None
    assert crs.is_projected
    assert epsg is None or crs.to_epsg() == epsg
    assert check_crs(text) == ()

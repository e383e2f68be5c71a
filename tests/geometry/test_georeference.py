from pathlib import Path

import numpy as np
import pytest
from rasterio.crs import CRS
from rasterio.transform import Affine

from envgen_usd.errors import Severity
from envgen_usd.geometry.georeference import check_crs, parse_crs, place_raster

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


def test_a_geoid_that_is_not_installed_does_not_hinder_the_plan():
    """Zone 32 of UTM has its central meridian at 9 degrees; false easting 500 km (EPSG 16032)."""
    text = (
        "+proj=utm +lat_0=37.35 +lon_0=-122.08 +k_0=1 +x_0=0 +y_0=0 +datum=WGS84 "
        "+geoidgrids=egm96_15.gtx +vunits=m +zone=32 +ellps=GRS80 +units=m +no_defs"
    )
    place = place_raster(Path("a.tif"), Affine.identity(), CRS.from_epsg(4326), text, (0, 0, 0))
    east, north = place.pixels(np.array([[500_000.0, 0.0]]))
    assert (float(east[0]), float(north[0])) == pytest.approx((9.0, 0.0), abs=1e-9)

from dataclasses import replace

import numpy as np
import pytest
import rasterio
from pyproj import Transformer
from rasterio.transform import Affine

from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.terrain.dem_geotiff import read_dem
from envgen_usd.terrain.heightmap_geotiff import read_heightmap, write_heightmap
from envgen_usd.terrain.heightmaps import build_heightmaps

RULES = TerrainRules(0.0, 100.0, 0.5)
UTM = "+proj=utm +zone=32 +datum=WGS84 +units=m +no_defs"


@pytest.fixture
def heightmap():
    x, y = np.meshgrid(*Chunk(-2, 3).corner_axes())
    return HeightMap(Chunk(-2, 3), 0.01 * x + 0.02 * y)


@pytest.mark.parametrize("crs", ["", UTM, "EPSG:25832", "no such thing"])
def test_a_height_map_comes_back(tmp_path, heightmap, crs):
    write_heightmap(heightmap, tmp_path / "h.tif", crs, (450000.25, 5410000.5, 300.0))
    back = read_heightmap(tmp_path / "h.tif")
    assert back.chunk == heightmap.chunk
    assert np.allclose(back.heights, heightmap.heights, atol=5e-5)
    assert [p.name for p in tmp_path.iterdir()] == ["h.tif"]


def test_other_programs_find_the_corners_where_they_are(tmp_path, heightmap):
    write_heightmap(heightmap, tmp_path / "h.tif", UTM, (450000.0, 5410000.0, 100.0))
    with rasterio.open(tmp_path / "h.tif") as file:
        assert file.crs.to_epsg() == 32632
        south_west = file.xy(255, 0)
        value = next(file.sample([(450000.0 - 400.0, 5410000.0 + 800.0)]))[0]
    assert south_west == pytest.approx((450000.0 - 400.0, 5410000.0 + 600.0))
    assert value == pytest.approx(100.0 - 0.01 * 400 + 0.02 * 800, abs=1e-4)


@pytest.mark.parametrize("content", [b"", b"no raster"])
def test_what_is_no_raster_is_refused(tmp_path, make_surface, areas, content):
    path = tmp_path / "x.tif"
    path.write_bytes(content)
    with pytest.raises(EnvgenError, match="cannot be read"):
        read_heightmap(path)
    with pytest.raises(EnvgenError, match="cannot be read"):
        read_dem(path, make_surface(areas["lane"], lambda x, y: x + y))


def write_dem(path, heights, transform, crs=None, nodata=None):
    with rasterio.open(
        path, "w", driver="GTiff", width=heights.shape[1], height=heights.shape[0], count=1,
        dtype="float32", crs=crs, transform=transform, nodata=nodata,
    ) as file:  # fmt: skip
        file.write(heights.astype(np.float32), 1)


def slope(x, y):
    return 0.03 * x - 0.02 * y


def test_terrain_of_a_dem_is_the_dem_away_from_the_road(tmp_path, make_surface, areas):
    surface = make_surface(areas["curved"], lambda x, y: slope(x, y) + 1.0)
    east, north = np.meshgrid(np.arange(-595.0, 1000, 10), np.arange(995.0, -600, -10))
    path = tmp_path / "dem.tif"
    write_dem(path, slope(east, north), Affine(10, 0, -600, 0, -10, 1000))
    chunks = [Chunk(0, 0), Chunk(0, 1), Chunk(2, 2)]
    made = build_heightmaps(surface, chunks, RULES, 0, read_dem(path, surface))
    far = np.meshgrid(*Chunk(2, 2).corner_axes())
    assert np.allclose(made[Chunk(2, 2)].heights, slope(*far), atol=1e-3)
    assert np.array_equal(made[chunks[0]].heights[-1], made[chunks[1]].heights[0])
    x, y = np.meshgrid(*Chunk(0, 0).corner_axes())
    above = made[Chunk(0, 0)].heights - slope(x, y)
    assert above.min() > -1e-3
    assert above.max() == pytest.approx(1.0, abs=0.03)


def test_a_dem_in_another_reference_system_is_put_in_place(tmp_path, make_surface, areas):
    surface = replace(
        make_surface(areas["straight"], lambda x, y: 7.0 + slope(x, y)),
        crs=UTM,
        offset=(450000.0, 5410000.0, 0.0),
    )
    to_degrees = Transformer.from_crs("EPSG:32632", "EPSG:4326", always_xy=True)
    west, south = to_degrees.transform(449000.0, 5409000.0)
    east, north = to_degrees.transform(451000.0, 5411000.0)
    size = 500
    transform = Affine((east - west) / size, 0, west, 0, -(north - south) / size, north)
    column, row = np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5)
    x, y = to_degrees.transform(
        west + column * transform.a, north + row * transform.e, direction="INVERSE"
    )
    heights = 7.0 + slope(x - 450000.0, y - 5410000.0)
    heights[200:220, 230:260] = -9999.0
    write_dem(tmp_path / "dem.tif", heights, transform, "EPSG:4326", -9999.0)
    dem = read_dem(tmp_path / "dem.tif", surface)
    points = np.stack(np.meshgrid(np.linspace(-300, 300, 20), np.linspace(-300, 300, 20)), -1)
    points = points.reshape(-1, 2)
    # Bilinear between degrees, float32, and a gap that was filled.
    assert np.allclose(dem(points), 7.0 + slope(*points.T), atol=0.05)


def test_another_vertical_datum_is_levelled_out(tmp_path, make_surface, areas):
    surface = make_surface(areas["straight"], slope)
    east, north = np.meshgrid(np.arange(-595.0, 1000, 10), np.arange(995.0, -600, -10))
    write_dem(tmp_path / "d.tif", slope(east, north) + 45, Affine(10, 0, -600, 0, -10, 1000))
    dem = read_dem(tmp_path / "d.tif", surface)
    assert dem.shift == pytest.approx(-45.0, abs=1e-3)
    (issue,) = dem.issues
    assert (issue.kind, issue.action) == ("terrain.ground_level", "lowered by 45.0 m")
    assert np.allclose(dem(surface.vertices), surface.vertices[:, 2], atol=2e-3)


@pytest.mark.filterwarnings("ignore:The given matrix is equal to")
def test_a_dem_that_does_not_say_where_it_lies_is_named(tmp_path, make_surface, areas):
    surface = make_surface(areas["straight"], slope)
    write_dem(tmp_path / "d.tif", np.full((60, 80), 3.0), Affine.identity())
    (issue,) = read_dem(tmp_path / "d.tif", surface).issues
    assert issue.kind == "raster.unplaced"
    assert "from (0, 0) to (80, 60)" in issue.action


@pytest.mark.parametrize("value", [1e30, -1e30, np.inf, -9999.0, -32768.0, 1.5e4])
def test_heights_that_no_land_has_are_gaps(tmp_path, make_surface, areas, value):
    """Undeclared marks of gaps would otherwise be mountains."""
    surface = make_surface(areas["straight"], slope)
    east, north = np.meshgrid(np.arange(-595.0, 1000, 10), np.arange(995.0, -600, -10))
    heights = slope(east, north)
    heights[88:91, 70:75] = value
    write_dem(tmp_path / "d.tif", heights, Affine(10, 0, -600, 0, -10, 1000))
    dem = read_dem(tmp_path / "d.tif", surface)
    (issue,) = dem.issues
    assert issue.kind == "terrain.implausible"
    assert issue.message.startswith("15 of ")
    assert f"such as {np.float32(value):g}, are not between -1000 m and 10000 m" in issue.message
    gap = np.s_[88:91, 70:75]
    places = np.stack([east[gap], north[gap]], -1).reshape(-1, 2)
    assert np.allclose(dem(places), slope(*places.T), atol=0.3)


@pytest.mark.parametrize("value", [1e30, np.nan, np.inf])
def test_a_dem_without_any_height_is_refused(tmp_path, make_surface, areas, value):
    surface = make_surface(areas["straight"], slope)
    write_dem(tmp_path / "d.tif", np.full((160, 160), value), Affine(10, 0, -600, 0, -10, 1000))
    with pytest.raises(EnvgenError, match=r"d\.tif: has no heights around the road"):
        read_dem(tmp_path / "d.tif", surface)


def test_a_dem_elsewhere_is_refused(tmp_path, make_surface, areas):
    surface = make_surface(areas["straight"], slope)
    write_dem(tmp_path / "d.tif", np.zeros((9, 9)), Affine(10, 0, 9e5, 0, -10, 9e5))
    with pytest.raises(EnvgenError, match="does not cover"):
        read_dem(tmp_path / "d.tif", surface)


def test_a_dem_in_degrees_needs_the_roads_reference_system(tmp_path, make_surface, areas):
    surface = make_surface(areas["straight"], slope)
    write_dem(tmp_path / "d.tif", np.zeros((9, 9)), Affine(1, 0, 0, 0, -1, 9), "EPSG:4326")
    with pytest.raises(EnvgenError, match="geoReference"):
        read_dem(tmp_path / "d.tif", surface)

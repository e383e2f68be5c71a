from dataclasses import replace

import numpy as np
import pytest
import rasterio
import shapely
from rasterio.transform import Affine

from envgen_usd.chunks import Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.given_landuse import read_given_landuse
from envgen_usd.landuse.landuse_geotiff import read_landuse_map, write_landuse_map
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.plot_sites import draw_sites
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.landuse.site_fitting import is_reached
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.recipe.build_options import demo_road

UTM = "+proj=utm +zone=32 +datum=WGS84 +units=m +no_defs"
CHUNKS = [Chunk(x, y) for x in (-1, 0) for y in (-1, 0)]
PROFILE = read_profile("1", "residential")


@pytest.fixture
def surface(make_roads, lines):
    return make_roads(lines["t"])


@pytest.fixture
def landuse(surface):
    return RuleProvider().generate(surface, [Chunk(-1, 0)], PROFILE, 0)[Chunk(-1, 0)]


@pytest.mark.parametrize("crs", ["", UTM, "nonsense"])
def test_landuse_comes_back(tmp_path, landuse, crs):
    write_landuse_map(landuse, tmp_path / "l.tif", crs, (5e5, 5.4e6, 0.0))
    write_landuse_map(landuse, tmp_path / "l.tif", crs, (5e5, 5.4e6, 0.0))
    back = read_landuse_map(tmp_path / "l.tif")
    assert back.chunk == landuse.chunk
    assert np.array_equal(back.classes, landuse.classes)
    assert np.array_equal(back.plots, landuse.plots)
    assert [p.name for p in tmp_path.iterdir()] == ["l.tif"]


def test_directions_of_rows_come_back(tmp_path, landuse):
    rows = np.arange(landuse.classes.size).reshape(landuse.classes.shape) % 18_000
    write_landuse_map(replace(landuse, rows=rows), tmp_path / "l.tif")
    back = read_landuse_map(tmp_path / "l.tif")
    np.testing.assert_array_equal(back.rows, rows)
    np.testing.assert_array_equal(back.plots, landuse.plots)
    write_landuse_map(replace(landuse, rows=None), tmp_path / "l.tif")
    assert read_landuse_map(tmp_path / "l.tif").rows is None


def test_other_programs_see_colours_and_places(tmp_path, landuse):
    write_landuse_map(landuse, tmp_path / "l.tif", UTM, (5e5, 5.4e6, 0.0))
    with rasterio.open(tmp_path / "l.tif") as file:
        assert file.crs.to_epsg() == 32632
        assert tuple(file.bounds) == pytest.approx((499800.0, 5400000.0, 500000.0, 5400200.0))
        colours = file.colormap(1)
        assert len({colours[int(kind)] for kind in LanduseClass}) == len(LanduseClass)
        x, y = Chunk(-1, 0).cell_centres()
        value = next(file.sample([(5e5 + x[30], 5.4e6 + y[100])]))[0]
    assert value == landuse.classes[100, 30]


def given(path, classes, transform, crs=None):
    with rasterio.open(
        path, "w", driver="GTiff", width=classes.shape[1], height=classes.shape[0], count=1,
        dtype="uint8", transform=transform, crs=crs,
    ) as file:  # fmt: skip
        file.write(classes, 1)


def test_a_given_map_takes_the_place_of_the_rules(tmp_path, surface):
    classes = np.full((100, 100), LanduseClass.WOOD, dtype=np.uint8)
    classes[20:30, 60:70] = LanduseClass.LAWN
    given(tmp_path / "m.tif", classes, Affine(4, 0, -200, 0, -4, 200))
    provider = read_given_landuse(tmp_path / "m.tif", surface, CHUNKS)
    maps = provider.generate(surface, [Chunk(0, 0), Chunk(1, 1)], PROFILE, 0)
    x, y = np.meshgrid(*Chunk(0, 0).cell_centres())
    lawn = (x > 40) & (x < 80) & (y > 80) & (y < 120)
    made = maps[Chunk(0, 0)]
    on_road = made.classes == LanduseClass.ROAD
    assert np.all(made.classes[lawn & ~on_road] == LanduseClass.LAWN)
    assert np.all(made.classes[~lawn & ~on_road] == LanduseClass.WOOD)
    assert np.array_equal(made.plots > 0, lawn & ~on_road)
    assert on_road.any()
    assert set(np.unique(maps[Chunk(1, 1)].classes)) <= {LanduseClass.GRASS, LanduseClass.ROAD}


def test_a_built_chunk_given_back_keeps_its_plots(tmp_path, surface, landuse):
    write_landuse_map(landuse, tmp_path / "l.tif")
    provider = read_given_landuse(tmp_path / "l.tif", surface, CHUNKS)
    back = provider.generate(surface, [landuse.chunk], PROFILE, 0)[landuse.chunk]
    assert np.array_equal(back.plots, landuse.plots)
    # Specks are repaired: cells of verges that are narrower than a cell.
    assert np.mean(back.classes == landuse.classes) > 0.99


def test_a_band_of_plots_tells_neighbours_apart(tmp_path, surface):
    classes = np.full((100, 100), LanduseClass.LAWN, dtype=np.uint8)
    plots = np.indices((100, 100))[1] // 10
    with rasterio.open(
        tmp_path / "m.tif", "w", driver="GTiff", width=100, height=100, count=2, dtype="int32",
        transform=Affine(2, 0, 0, 0, -2, 200),
    ) as file:  # fmt: skip
        file.write(classes, 1)
        file.write(plots, 2)
        file.set_band_description(2, "plot")
    provider = read_given_landuse(tmp_path / "m.tif", surface, CHUNKS)
    made = provider.generate(surface, [Chunk(0, 0)], PROFILE, 0)[Chunk(0, 0)]
    assert set(np.unique(made.plots)) == set(range(10))


def test_rules_lay_plots_into_areas_that_are_too_large_for_one(tmp_path, surface):
    x, y = np.meshgrid(np.arange(-199.0, 200, 2), np.arange(199.0, -200, -2))
    lawn = (x > -150) & (x < 180) & (y > 20) & (y < 180)
    small = (x > -20) & (x < -10) & (y > -100) & (y < -80)
    classes = np.where(lawn | small, LanduseClass.LAWN, LanduseClass.WOOD).astype(np.uint8)
    given(tmp_path / "m.tif", classes, Affine(2, 0, -200, 0, -2, 200))
    provider = read_given_landuse(tmp_path / "m.tif", surface, CHUNKS)
    chunks = [Chunk(x, y) for x in (-1, 0) for y in (-1, 0)]
    maps = provider.generate(surface, chunks, PROFILE, 0)
    plots = find_plots(maps, surface)
    areas = np.array([shapely.Polygon(plot.polygon).area for plot in plots])
    assert len(plots) > 20
    assert np.sum(areas > 150.0) > 15
    assert areas.max() < 1.3 * PROFILE.plots.frontage[1] * PROFILE.plots.depth[1]
    land = shapely.union(shapely.box(-150, 20, 180, 180), shapely.box(-20, -100, -10, -80))
    outside = [shapely.Polygon(plot.polygon).difference(land.buffer(1.0)).area for plot in plots]
    assert np.sum(outside) < 0.25 * areas.sum()
    again = provider.generate(surface, chunks[:1], PROFILE, 0)[chunks[0]]
    assert np.array_equal(again.plots, maps[chunks[0]].plots)
    assert np.array_equal(again.classes, maps[chunks[0]].classes)


@pytest.mark.filterwarnings("ignore:The given matrix is equal to")
def test_a_raster_that_does_not_say_where_it_lies_is_named(tmp_path, surface):
    classes = np.full((170, 190), LanduseClass.WOOD, np.uint8)
    given(tmp_path / "m.tif", classes, Affine.identity())
    made = read_given_landuse(tmp_path / "m.tif", surface, CHUNKS)
    (issue,) = made.issues
    assert (issue.kind, issue.where) == ("raster.unplaced", str(tmp_path / "m.tif"))
    assert "pixels of 1 m, from (0, 0) to (190, 170)" in issue.action
    inside = made.classes_at(np.array([(0.5, 0.5), (189.5, 169.5), (-0.5, 0.5), (0.5, 170.5)]))
    assert inside.tolist() == [LanduseClass.WOOD, LanduseClass.WOOD, 0, 0]
    away = replace(surface, offset=(5e5, 5.4e6, 0.0))
    with pytest.raises(EnvgenError, match=r"no georeferencing, and does not cover .* -a_ullr"):
        read_given_landuse(tmp_path / "m.tif", away, CHUNKS)
    given(tmp_path / "m.tif", classes, Affine(1, 0, 0, 0, -1, 170))
    assert not read_given_landuse(tmp_path / "m.tif", surface, CHUNKS).issues


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ((99, -200.0, None), "not landuse classes"),
        ((2, 1e6, None), "does not cover"),
        ((2, -200.0, "EPSG:4326"), "geoReference"),
    ],
)
def test_a_map_that_cannot_be_used_is_refused(tmp_path, surface, content, message):
    value, east, crs = content
    given(
        tmp_path / "m.tif", np.full((9, 9), value, np.uint8), Affine(50, 0, east, 0, -50, 200), crs
    )
    with pytest.raises(EnvgenError, match=message):
        read_given_landuse(tmp_path / "m.tif", surface, CHUNKS)


@pytest.mark.parametrize("content", [b"", b"no raster"])
def test_what_is_no_raster_is_refused(tmp_path, surface, content):
    (tmp_path / "m.tif").write_bytes(content)
    with pytest.raises(EnvgenError, match="cannot be read"):
        read_given_landuse(tmp_path / "m.tif", surface, CHUNKS)
    with pytest.raises(EnvgenError, match="cannot be read"):
        read_landuse_map(tmp_path / "m.tif")


def test_a_row_behind_another_ends_where_a_plot_is_left_out():
    """Its lane leads from plot to plot; without the first, none of the row has a way."""
    surface = build_surface(read_network(demo_road("straight")))
    rules = replace(read_profile("1", "residential").plots, rows=2)
    sites = draw_sites(find_roadsides(surface, rules, 0), rules, 0)
    row = np.cumsum(sites.heads) - 1
    behind = np.unique(row[sites.rows > 0])
    assert len(behind)
    for lost in np.flatnonzero(sites.heads & (sites.rows > 0)).tolist():
        within = np.ones(len(sites), bool)
        within[lost] = False
        reached = is_reached(sites, within)
        np.testing.assert_array_equal(reached, row != row[lost])

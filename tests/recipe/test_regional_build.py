"""A map of several regions is built region by region, with the products of the whole map."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from tests.short_roads import IN_NINE_CHUNKS

from envgen_usd.chunks import Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, Plot
from envgen_usd.recipe import map_regions
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build, build_shard
from envgen_usd.recipe.map_land import lay_out_land, read_road_file, surface_of
from envgen_usd.recipe.map_regions import MapRegions
from envgen_usd.recipe.region_roads import BESIDE
from envgen_usd.recipe.region_stages import STAGES
from envgen_usd.recipe.regional_build import (
    FOLDER,
    RegionMaps,
    StreetLayout,
    lay_out_regions,
    regional_map,
)
from envgen_usd.recipe.stored_products import ProductStore
from envgen_usd.step_clock import Clock
from envgen_usd.streets.network_roads import network_xml
from envgen_usd.streets.street_layouts import grid_network


@pytest.fixture
def small_regions(monkeypatch):
    """Regions of at most two chunks along each side."""
    monkeypatch.setattr(map_regions, "SIDE", 2)
    monkeypatch.setattr(map_regions, "WHOLE", 2)


@pytest.fixture(scope="module")
def options(tmp_path_factory):
    folder = tmp_path_factory.mktemp("regions")
    road = folder / "grid.xodr"
    road.write_bytes(network_xml(grid_network((1, 1), 0), "grid"))
    return BuildOptions(road, "1", "residential", folder / "out", workers=1, actors=False)


@pytest.mark.usefixtures("small_regions")
def test_regions_partition_the_chunks_of_a_map():
    boxes = np.array([[-30.0, -30.0, 1250.0, 30.0], [1190.0, -30.0, 1250.0, 700.0]])
    regions = MapRegions.of(boxes, 100.0)
    held = [
        [region.name for region in regions.all if region.has(Chunk(x, y))]
        for x in range(-2, 8)
        for y in range(-2, 5)
    ]
    assert max(map(len, held)) == 1
    assert ["0_0"] in held
    assert [] in held  # far from both roads is no region
    for region in regions.all:
        assert region in regions.beside(region)
        assert 1 <= region.last.x - region.first.x + 1 <= 3
    numbers = [regions.number(region) for region in regions.all]
    assert len(set(numbers)) == len(numbers)


@pytest.mark.usefixtures("small_regions")
@pytest.mark.parametrize("area", ["residential", "harbour"])
def test_the_land_of_regions_is_that_of_the_map(options, tmp_path, area):
    options = replace(options, out=tmp_path / "out", area=area)
    profile, clock = read_profile("1", area), Clock(lambda *_: None)
    regional = regional_map(options, profile, read_road_file(options.road, 0.02))
    assert len(regional.regions) >= 4
    found = lay_out_regions(regional, options, "k" * 20, clock)
    whole = lay_out_land(options, profile, clock)
    assert tuple(found.chunks) == tuple(whole.chunks)
    assert {issue.kind for issue in found.issues} == {issue.kind for issue in whole.issues}
    regions, land = found.regional.regions, found.regional.land
    for region in regions:
        maps = RegionMaps(land, region)
        for chunk in land.chunks(region):
            own, other = maps.of(chunk), whole.of(chunk)
            assert np.array_equal(own.landuse.classes, other.landuse.classes)
            assert np.array_equal(own.landuse.plots > 0, other.landuse.plots > 0)
            assert np.abs(own.heightmap.heights - other.heightmap.heights).max() < 1e-9
            water, expected = own.heightmap.water, other.heightmap.water
            assert (water is None) == (expected is None)
            if water is not None:
                np.testing.assert_array_equal(water.levels, expected.levels)
                np.testing.assert_array_equal(water.beyond, expected.beyond)
            assert len(own.plots) == len(other.plots)
            assert [a.chunk for a in own.around] == [b.chunk for b in other.around]
    near = found.regional.near(regions[0], BESIDE)
    streets = StreetLayout.of(land, regions[0], near).surface
    assert streets == replace(surface_of(near, 0.02, profile.road.marks), issues=())
    assert land.has("roads", regions[0])
    (land.folder / f"surface_{regions[0].name}.npz").unlink()
    assert not land.has("roads", regions[0])  # whoever resumes makes it again
    plots = [plot for region in regions for plot in land.store.read("plots", region.name)[0]]
    shapes = [shapely.Polygon(plot.polygon) for plot in plots]
    assert len({plot.id for plot in plots}) == len(plots) == len(whole.plots)
    one, two = shapely.STRtree(shapes).query(shapes, "intersects")
    apart = [(a, b) for a, b in zip(one.tolist(), two.tolist(), strict=True) if a < b]
    assert max(shapes[a].intersection(shapes[b]).area for a, b in apart) < 1e-6


@pytest.mark.usefixtures("small_regions")
def test_shards_by_region_are_the_whole_build(options, tmp_path):
    road = tmp_path / "small.xodr"
    road.write_text(IN_NINE_CHUNKS, encoding="utf-8")
    options = replace(options, road=road)
    parts, whole = (replace(options, out=tmp_path / name) for name in ("parts", "whole"))
    built = [build_shard(parts, (number, 2)).built for number in (1, 2)]
    assert min(built) > 0
    stages = {path.name.split("_")[0] for path in (parts.out / FOLDER).rglob("*.npz")}
    assert stages == {"surface", "chunks", "streets", *STAGES}
    result = build(parts)
    assert (result.built, result.kept) == (0, sum(built))
    assert not (parts.out / FOLDER).exists()
    assert result.manifest.products == build(whole).manifest.products


def test_products_are_read_as_they_were_written(tmp_path):
    plot = Plot(
        "plot_3",
        np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]]),
        LanduseClass.LAWN,
        np.array([[0.0, 0.0], [9.0, 0.0]]),
        "7",
        None,
        "left",
    )
    issue = Issue("terrain.steep", Severity.WARNING, "chunk 0_0", "steep")
    heights = HeightMap(Chunk(0, -1), np.arange(4.0).reshape(2, 2))
    product = ((plot, heights), (issue,), None, 0.1)
    store = ProductStore(tmp_path / "land")
    assert not store.has("plots", "0_0")
    store.write("plots", "0_0", product)
    assert ProductStore(tmp_path / "land").read("plots", "0_0") == product
    with pytest.raises(TypeError, match="no product"):
        store.write("plots", "0_0", Path("x"))


@pytest.mark.parametrize("content", [b"", b"PK\x05\x06" + bytes(18), b"\x80\x04N."])
def test_a_damaged_product_counts_as_missing(tmp_path, content):
    store = ProductStore(tmp_path)
    (tmp_path / "plots_0_0.npz").write_bytes(content)  # the last one is a pickle
    assert not store.has("plots", "0_0")

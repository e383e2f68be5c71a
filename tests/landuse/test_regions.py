import json

import numpy as np
import pytest
import shapely
from pyproj import Transformer

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.landuse_geojson import write_regions
from envgen_usd.landuse.landuse_regions import Region, find_regions
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.road_areas import RoadAreas
from envgen_usd.models.landuse import BUILT_USES, OPEN_USES, LanduseClass, LanduseMap

# Plots of further rows reach beyond the chunks at the road.
CHUNKS = [Chunk(x, y) for x in range(-3, 4) for y in (-1, 0, 1)]
UTM = "+proj=utm +zone=32 +datum=WGS84 +units=m"


@pytest.fixture(scope="module", params=["straight", "x", "winding"])
def made(request, make_roads, lines):
    surface = make_roads(lines[request.param])
    maps = RuleProvider().generate(surface, CHUNKS, read_profile("1", "residential"), 0)
    plots = find_plots(maps, surface)
    areas = RoadAreas(surface)
    return maps, plots, [find_regions(maps[chunk], plots, areas) for chunk in CHUNKS]


def test_regions_cover_the_map_without_gap_or_overlap(made):
    _, _, regions = made
    shapes = np.array([region.shape for group in regions for region in group])
    assert shapely.is_valid(shapes).all()
    land = shapely.union_all([shapely.box(*chunk.bounds) for chunk in CHUNKS])
    # Without a grid, GEOS 3.14 loses shapes that nearly touch.
    whole = shapely.union_all(shapes, grid_size=1e-6)
    # Plots at the rim of the map may reach beyond it by less than a cell.
    # Traces of rounding between lines that almost meet are no regions.
    assert shapely.difference(land, whole).area < 0.02
    assert shapely.area(shapes).sum() == pytest.approx(whole.area, abs=0.02)


def test_every_cell_lies_in_one_region_of_its_class_and_plot(made):
    maps, _, regions = made
    everywhere = [region for group in regions for region in group]
    shapes = np.array([region.shape for region in everywhere])
    numbers = [int(r.plot.id.removeprefix("plot_")) if r.plot else 0 for r in everywhere]
    plot_of, class_of = np.array(numbers), np.array([r.landuse for r in everywhere])
    cells = right = 0
    for chunk in CHUNKS:
        x, y = np.meshgrid(*chunk.cell_centres())
        # Simplified borders run through the centres of cells.
        points = shapely.points(x.ravel() + 0.011, y.ravel() + 0.007)
        # A query prepares the shapes it asks for: the regions, which have many corners.
        region, cell = shapely.STRtree(points).query(shapes, "intersects")
        order = np.argsort(cell, kind="stable")
        region, cell = region[order], cell[order]
        assert np.array_equal(cell, np.arange(len(points)))
        plots, classes = plot_of[region], class_of[region]
        same = (plots == maps[chunk].plots.ravel()) & (plots > 0)
        same |= (plots == maps[chunk].plots.ravel()) & (classes == maps[chunk].classes.ravel())
        cells, right = cells + len(points), right + same.sum()
    assert right > 0.99 * cells


def test_every_plot_is_one_whole_region(made):
    _, plots, regions = made
    found = {r.plot.id: r for group in regions for r in group if r.plot is not None}
    assert set(found) == {plot.id for plot in plots}
    for plot in plots:
        assert found[plot.id].shape.area == pytest.approx(shapely.Polygon(plot.polygon).area)
        assert found[plot.id].landuse in {LanduseClass.LAWN, *OPEN_USES, *BUILT_USES}


@pytest.mark.parametrize("crs", ["", "nonsense", UTM])
def test_geojson_comes_back(tmp_path, made, crs):
    regions = made[2][CHUNKS.index(Chunk(0, 0))]
    write_regions(regions, tmp_path / "l.geojson", crs, (5e5, 5.4e6, 0.0))
    content = json.loads((tmp_path / "l.geojson").read_text())
    assert [path.name for path in tmp_path.iterdir()] == ["l.geojson"]
    assert len(content["features"]) == len(regions)
    to_utm = Transformer.from_crs("EPSG:4326", "EPSG:32632", always_xy=True)
    for feature, region in zip(content["features"], regions, strict=True):
        shape = shapely.geometry.shape(feature["geometry"])
        assert all(part.exterior.is_ccw for part in shapely.get_parts(shape))
        if crs == UTM:
            shape = shapely.transform(shape, lambda p: np.stack(to_utm.transform(*p.T), axis=1))
        moved = shapely.affinity.translate(region.shape, 5e5, 5.4e6)
        assert shape.hausdorff_distance(moved) < 2e-3
        assert feature["properties"]["landuse"] == region.landuse.name.lower()
        assert ("plot" in feature["properties"]) == (region.plot is not None)


@pytest.mark.parametrize("crs", ["", UTM])
def test_written_polygons_are_valid_and_leave_no_gap(tmp_path, made, crs):
    for number, regions in enumerate(made[2]):
        path = tmp_path / f"{number}.geojson"
        write_regions(regions, path, crs, (5e5, 5.4e6, 0.0))
        features = json.loads(path.read_text())["features"]
        shapes = np.array([shapely.geometry.shape(f["geometry"]) for f in features])
        assert shapely.is_valid(shapes).all()
        if not crs:
            written = shapely.area(shapes).sum()
            assert written == pytest.approx(sum(r.shape.area for r in regions), abs=0.2)


@pytest.mark.parametrize("degrees", [0.0, 40.0, 135.0, 290.0])
def test_orientation_is_where_the_street_side_faces(tmp_path, made, degrees):
    plot = made[1][0]
    # A plot north of its street faces south; it is turned clockwise from there.
    front = shapely.affinity.rotate(shapely.LineString([(0, 0), (10, 0)]), -degrees, (0, 0))
    turned = type(plot)("p", plot.polygon, plot.landuse, shapely.get_coordinates(front), "7")
    write_regions([Region(shapely.Polygon(plot.polygon), plot.landuse, turned)], tmp_path / "p")
    (feature,) = json.loads((tmp_path / "p").read_text())["features"]
    assert feature["properties"]["orientation"] == pytest.approx((180.0 + degrees) % 360, abs=0.01)
    assert feature["properties"]["road"] == "7"


def regions_around(ground):
    """Regions of a chunk of grass around the ground of a road."""

    class Areas:
        def in_chunk(self, _chunk):
            return ground

    cells = (LANDUSE_CELLS, LANDUSE_CELLS)
    grass = np.full(cells, LanduseClass.GRASS, np.uint8)
    landuse = LanduseMap(Chunk(0, 0), grass, np.zeros(cells, np.int32))
    return find_regions(landuse, (), Areas())


@pytest.mark.parametrize("polygons", [0, 1])
def test_a_road_whose_ground_ends_in_lines_has_regions(polygons):
    """A lane of width 0 leaves them; GEOS then ended the build of its chunk."""
    square = shapely.box(20, 20, 60, 60)
    lines = [shapely.LineString([(0, y), (0, y - 3.5)]) for y in (100, 200)]
    rest = [shapely.Point(0, 0), *lines]
    regions = regions_around(shapely.GeometryCollection([square, *rest] if polygons else rest))
    roads = [region.shape for region in regions if region.landuse == LanduseClass.ROAD]
    assert len(roads) == polygons
    assert all(road.equals(square) for road in roads)


def test_a_hole_that_touches_the_outline_ends_no_build():
    """Mitres beside it crossed the outline; GEOS then ended a build of Munich's streets."""
    outline = [(760.784313725, -178.823529412), (760.784313725, -185.098039216)]
    outline += [(758.431372549, -188.235294118), (755.294117647, -189.803921569)]
    outline += [(752.941176471, -189.803921569), (752.941176471, -196.078431373)]
    outline += [(752.156862745, -196.078431373), (752.156862745, -181.912655874)]
    outline += [(752.975, -181.866), (752.862, -179.869), (752.802318654, -178.823529412)]
    hole = [(753.725490196, -181.960784314), (753.725490196, -181.176470588)]
    hole += [(752.941176471, -181.176470588)]
    ground = shapely.Polygon(outline, [hole])
    regions = regions_around(ground)
    roads = [region.shape for region in regions if region.landuse == LanduseClass.ROAD]
    assert shapely.is_valid(roads).all()
    assert shapely.area(roads).sum() == pytest.approx(ground.area, abs=1e-3)

"""Rasters of a thousand million pixels: only the part that the map needs is read."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine
from rasterio.windows import Window

from envgen_usd.chunks import chunks_of_points
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.given_landuse import read_given_landuse
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.recipe.build_options import demo_road
from envgen_usd.recipe.map_land import read_road
from envgen_usd.terrain.dem_geotiff import read_dem

SIDE = {"heights": 26_000, "landuse": 40_000}
"""Pixels along a side; heights of 4 bytes are 2.7 GB, classes of 1 byte 1.6 GB."""
BLOCK = 512
MOST_MEMORY = 2e9
"""Bytes of a whole process with a map of a raster."""
READING = """
import sys
from pathlib import Path
import numpy as np
from envgen_usd.chunks import chunks_of_points
from envgen_usd.environment_files import read_profile
from envgen_usd.recipe.build_options import BuildOptions, demo_road
from envgen_usd.recipe.map_land import given_land, landuse_provider, read_road

kind, path = sys.argv[1:]
options = BuildOptions(
    demo_road("straight"), "1", "residential", Path("out"),
    landuse=path if kind == "landuse" else "rules",
    heightmap=Path(path) if kind == "heights" else None,
)
profile = read_profile("1", "residential")
surface = read_road(options.road, options.tolerance)[1]
chunks = chunks_of_points(surface.vertices, 50.0)
if kind == "heights":
    land = given_land(options, surface, chunks)
    places = surface.vertices[::50, :2]
    print(np.abs(land(places) - 0.01 * places[:, 0] - 5.0).max())
else:
    maps = landuse_provider(options, profile, surface, chunks).generate(surface, chunks, profile, 0)
    print(np.mean(np.concatenate([np.isin(m.classes, (1, 7)) for m in maps.values()])))
# Not ru_maxrss, which a process inherits from the one that started it.
status = Path("/proc/self/status").read_text()
print(1024 * int(status.split("VmHWM:")[1].split()[0]))
"""


@pytest.fixture(scope="module")
def surface() -> RoadSurface:
    return read_road(demo_road("straight"), 0.05)[1]


def write_sparse(path: Path, kind: str, pixel: float, surface: RoadSurface) -> None:
    """A raster with a plane, or wood, within 500 m of the road; other blocks are absent."""
    side = SIDE[kind]
    middle = surface.vertices[:, :2].mean(axis=0)
    west, north = middle[0] - side * pixel / 2, middle[1] + side * pixel / 2
    reach = min(side // 2, int(500.0 / pixel))
    with rasterio.open(
        path, "w", driver="GTiff", width=side, height=side, count=1, tiled=True, blockxsize=BLOCK,
        blockysize=BLOCK, dtype="float32" if kind == "heights" else "uint8", SPARSE_OK=True,
        BIGTIFF="YES", transform=Affine(pixel, 0, west, 0, -pixel, north), compress="deflate",
        zlevel=1,
    ) as file:  # fmt: skip
        starts = range((side // 2 - reach) // BLOCK * BLOCK, min(side // 2 + reach, side), BLOCK)
        for column in starts:
            x = west + (column + np.arange(BLOCK) + 0.5) * pixel
            values = np.tile(0.01 * x + 5.0 if kind == "heights" else np.full(BLOCK, 7), (BLOCK, 1))
            for row in starts:
                height, width = min(BLOCK, side - row), min(BLOCK, side - column)
                place = Window(column, row, width, height)
                file.write(values[:height, :width].astype(file.dtypes[0]), 1, window=place)


@pytest.mark.parametrize(
    ("kind", "pixel"), [("heights", 0.05), ("landuse", 0.5), ("landuse", 0.05)]
)
def test_a_raster_beyond_memory_is_read_by_windows(
    tmp_path: Path, surface: RoadSurface, kind: str, pixel: float
) -> None:
    path = tmp_path / "large.tif"
    write_sparse(path, kind, pixel, surface)
    reading = subprocess.run(
        [sys.executable, "-c", READING, kind, str(path)],
        capture_output=True, text=True, check=True, cwd=tmp_path,
    )  # fmt: skip
    value, memory = map(float, reading.stdout.split())
    assert memory < MOST_MEMORY
    if kind == "heights":
        assert value < 0.01 * max(pixel, 0.4), "heights are those of the plane to a pixel"
    else:
        assert value == 1.0, "all land is wood, beside the road"


def test_parts_of_a_mosaic_beyond_the_map_are_not_read(
    tmp_path: Path, surface: RoadSurface
) -> None:
    """A mosaic whose distant tile is gone still holds all that the map needs."""
    west, south = surface.vertices[:, :2].min(axis=0) - 1000.0
    with rasterio.open(
        tmp_path / "near.tif", "w", driver="GTiff", width=500, height=500, count=1,
        dtype="float32", transform=Affine(10, 0, west, 0, -10, south + 5000),
    ) as file:  # fmt: skip
        file.write(np.full((500, 500), 7.0, dtype=np.float32), 1)
    sources = "".join(
        f"""<SimpleSource><SourceFilename relativeToVRT="1">{name}.tif</SourceFilename>
        <SourceBand>1</SourceBand>
        <SourceProperties RasterXSize="500" RasterYSize="500" DataType="Float32"/>
        <SrcRect xOff="0" yOff="0" xSize="500" ySize="500"/>
        <DstRect xOff="{column}" yOff="0" xSize="500" ySize="500"/></SimpleSource>"""
        for name, column in (("near", 0), ("gone", 90_000))
    )
    path = tmp_path / "mosaic.vrt"
    path.write_text(
        f"""<VRTDataset rasterXSize="90500" rasterYSize="20000">
        <GeoTransform>{west}, 10, 0, {south + 5000}, 0, -10</GeoTransform>
        <VRTRasterBand dataType="Float32" band="1">{sources}</VRTRasterBand></VRTDataset>"""
    )
    assert np.allclose(read_dem(path, surface)(surface.vertices[:, :2]), 7.0)


def test_blocks_too_large_to_read_in_parts_are_refused(
    tmp_path: Path, surface: RoadSurface
) -> None:
    """A reader decodes whole blocks, so the only block of a raster means the whole raster."""
    path = tmp_path / "block.tif"
    with rasterio.open(
        path, "w", driver="GTiff", width=20_000, height=20_000, count=1, dtype="float32",
        blockysize=20_000, compress="deflate", SPARSE_OK=True,
        transform=Affine(1, 0, -10_000, 0, -1, 10_000),
    ):  # fmt: skip
        pass
    chunks = chunks_of_points(surface.vertices)
    for read in (read_dem, lambda *given: read_given_landuse(*given, chunks)):
        with pytest.raises(EnvgenError, match=r"blocks of 20000 x 20000 pixels.*TILED=YES"):
            read(path, surface)


def test_thinning_that_costs_detail_is_an_issue(
    tmp_path: Path, surface: RoadSurface, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("envgen_usd.geometry.raster_part.MOST_PIXELS", 10_000)
    west, south = surface.vertices[:, :2].min(axis=0) - 1000.0
    with rasterio.open(
        tmp_path / "dem.tif", "w", driver="GTiff", width=4000, height=4000, count=1,
        dtype="float32", transform=Affine(1, 0, west, 0, -1, south + 4000),
    ) as file:  # fmt: skip
        file.write(np.tile(0.01 * (west + np.arange(4000) + 0.5), (4000, 1)), 1)
    dem = read_dem(tmp_path / "dem.tif", surface)
    assert dem.heights.size <= 10_000
    assert [issue.kind for issue in dem.issues] == ["raster.thinned"]
    places = surface.vertices[:, :2]
    assert np.allclose(dem(places), 0.01 * places[:, 0], atol=0.01)

"""Landuse as GeoTIFF files."""

from pathlib import Path

import numpy as np
import rasterio
from rasterio.errors import RasterioError
from rasterio.io import DatasetWriter, MemoryFile

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.errors import EnvgenError, one_line
from envgen_usd.geometry.georeference import Offset, parse_crs, raster_transform
from envgen_usd.landuse.landuse_preview import COLOURS
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.whole_files import write_whole

PLOT_BAND = "plot"
"""Description of the band with plot numbers."""
PLOTS_ALONE = 2
"""Images of a file without directions of rows."""
ROW_BAND = "rows"
"""Description of the band with directions of rows."""


def write_landuse_map(
    landuse: LanduseMap, path: Path, crs: str = "", offset: Offset = (0.0, 0.0, 0.0)
) -> None:
    """Writes the landuse of a chunk; the file is written whole or not at all.

    The first image of the file holds class bytes with a colour table and class names as tags. The
    second image holds plot numbers as 32-bit integers. A third one holds the directions of rows,
    where there are others than along x.

    Args:
        landuse: Landuse to write.
        path: File to write.
        crs: The road's geoReference; left out if invalid.
        offset: The road's header offset, added to road-frame coordinates.

    Raises:
        EnvgenError: The file cannot be written.
    """
    common = {
        "driver": "GTiff",
        "width": LANDUSE_CELLS,
        "height": LANDUSE_CELLS,
        "count": 1,
        "crs": parse_crs(crs),
        "transform": raster_transform(landuse.chunk, offset, LANDUSE_CELLS),
        "compress": "deflate",
    }
    # GDAL does not report a full disk when it closes a file; `write_whole` does.
    with MemoryFile() as memory:
        with rasterio.open(memory.name, "w", dtype="uint8", nodata=0, **common) as file:
            file.write(landuse.classes[::-1], 1)
            file.write_colormap(1, {int(kind): (*colour, 255) for kind, colour in COLOURS.items()})
            _describe(file, landuse, offset)
        with rasterio.open(
            memory.name, "w", dtype="int32", APPEND_SUBDATASET=True, **common
        ) as file:
            file.write(landuse.plots[::-1].astype(np.int32), 1)
            file.set_band_description(1, PLOT_BAND)
        if landuse.rows is not None and landuse.rows.any():
            with rasterio.open(
                memory.name, "w", dtype="int32", APPEND_SUBDATASET=True, **common
            ) as file:
                file.write(landuse.rows[::-1].astype(np.int32), 1)
                file.set_band_description(1, ROW_BAND)
        write_whole(path, memory.read())


def _describe(file: DatasetWriter, landuse: LanduseMap, offset: Offset) -> None:
    file.set_band_description(1, "landuse")
    file.update_tags(1, **{f"CLASS_{int(kind)}": kind.name.lower() for kind in LanduseClass})
    file.update_tags(
        ENVGEN_CHUNK=landuse.chunk.name, ENVGEN_OFFSET=" ".join(repr(float(v)) for v in offset)
    )


def read_landuse_map(path: Path) -> LanduseMap:
    """Reads the landuse of a chunk.

    Raises:
        EnvgenError: The file cannot be read, or is not the landuse of a chunk.
    """
    try:
        with rasterio.open(path) as file:
            tags, classes, images = file.tags(), file.read(1), len(file.subdatasets)
        if "ENVGEN_CHUNK" not in tags or classes.shape != (LANDUSE_CELLS, LANDUSE_CELLS):
            raise EnvgenError(
                f"{path}: not the landuse of a chunk; use --landuse for other landuse maps"
            )
        with rasterio.open(plot_image(path)) as file:
            plots = file.read(1).astype(np.int64)[::-1].copy()
        rows = None
        if images > PLOTS_ALONE:
            with rasterio.open(f"GTIFF_DIR:{images}:{path}") as file:
                rows = file.read(1).astype(np.int64)[::-1].copy()
    except RasterioError as error:
        raise EnvgenError(f"{path}: cannot be read as GeoTIFF: {one_line(error)}") from error
    x, y = tags["ENVGEN_CHUNK"].split("_")
    return LanduseMap(Chunk(int(x), int(y)), classes[::-1].copy(), plots, rows)


def plot_image(path: Path) -> str:
    """Name, for GDAL, of the image of plot numbers, the second of `write_landuse_map`."""
    return f"GTIFF_DIR:2:{path}"

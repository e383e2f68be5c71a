"""Height maps as GeoTIFF files."""

from pathlib import Path

import numpy as np
import rasterio

from envgen_usd.chunks import HEIGHT_SAMPLES
from envgen_usd.geometry.georeference import Offset, parse_crs, raster_transform
from envgen_usd.models.ground import HeightMap


def write_heightmap(
    heightmap: HeightMap, path: Path, crs: str = "", offset: Offset = (0.0, 0.0, 0.0)
) -> None:
    """Writes a height map as float32; the file appears at once or not at all.

    Pixel centres are the grid's corners. Coordinates and heights in the file are those of the
    road's reference system; tags tell the chunk and the offset, so that `read_heightmap` finds
    back to the road frame.

    Args:
        heightmap: What to write.
        path: File to make.
        crs: The road's geoReference; left out where it cannot be understood.
        offset: The road's header offset, added to road-frame coordinates.
    """
    part = path.with_name(f".{path.name}.part")
    heights = heightmap.heights[::-1] + offset[2]
    with rasterio.open(
        part,
        "w",
        driver="GTiff",
        width=HEIGHT_SAMPLES,
        height=HEIGHT_SAMPLES,
        count=1,
        dtype="float32",
        crs=parse_crs(crs),
        transform=raster_transform(heightmap.chunk, offset, HEIGHT_SAMPLES),
        compress="deflate",
        predictor=3,
    ) as file:
        file.write(heights.astype(np.float32), 1)
        file.set_band_unit(1, "metre")
        file.update_tags(
            AREA_OR_POINT="Point",
            ENVGEN_CHUNK=heightmap.chunk.name,
            ENVGEN_OFFSET=" ".join(map(repr, map(float, offset))),
        )
    part.replace(path)

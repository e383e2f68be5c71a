"""Landuse as GeoTIFF files."""

from pathlib import Path

import numpy as np
import rasterio
from rasterio.io import DatasetWriter

from envgen_usd.chunks import LANDUSE_CELLS
from envgen_usd.geometry.georeference import Offset, parse_crs, raster_transform
from envgen_usd.landuse.preview import COLOURS
from envgen_usd.models.landuse import LanduseClass, LanduseMap


def write_landuse_map(
    landuse: LanduseMap, path: Path, crs: str = "", offset: Offset = (0.0, 0.0, 0.0)
) -> None:
    """Writes the landuse of a chunk; the file appears at once or not at all.

    The first image of the file holds the classes as bytes with a colour table and the classes'
    names as tags, the second one the numbers of the plots as 32-bit integers.

    Args:
        landuse: What to write.
        path: File to make.
        crs: The road's geoReference; left out where it cannot be understood.
        offset: The road's header offset, added to road-frame coordinates.
    """
    part = path.with_name(f".{path.name}.part")
    part.unlink(missing_ok=True)
    common = {
        "driver": "GTiff",
        "width": LANDUSE_CELLS,
        "height": LANDUSE_CELLS,
        "count": 1,
        "crs": parse_crs(crs),
        "transform": raster_transform(landuse.chunk, offset, LANDUSE_CELLS),
        "compress": "deflate",
    }
    with rasterio.open(part, "w", dtype="uint8", nodata=0, **common) as file:
        file.write(landuse.classes[::-1], 1)
        file.write_colormap(1, {int(kind): (*colour, 255) for kind, colour in COLOURS.items()})
        _describe(file, landuse, offset)
    with rasterio.open(part, "w", dtype="int32", APPEND_SUBDATASET=True, **common) as file:
        file.write(landuse.plots[::-1].astype(np.int32), 1)
        file.set_band_description(1, "plot")
    part.replace(path)


def _describe(file: DatasetWriter, landuse: LanduseMap, offset: Offset) -> None:
    file.set_band_description(1, "landuse")
    file.update_tags(1, **{f"CLASS_{int(kind)}": kind.name.lower() for kind in LanduseClass})
    file.update_tags(
        ENVGEN_CHUNK=landuse.chunk.name, ENVGEN_OFFSET=" ".join(repr(float(v)) for v in offset)
    )

"""Reads landuse from GeoTIFF files: what `write_landuse_map` wrote, and maps of any origin."""

from pathlib import Path

import numpy as np
import rasterio
from rasterio.errors import RasterioError

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.georeference import place_raster
from envgen_usd.landuse.given import GivenLanduse
from envgen_usd.models.arrays import IntArray
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.surface import RoadSurface

PLOT_BAND = "plot"
"""Description of the band that holds the numbers of plots."""


def read_landuse_map(path: Path) -> LanduseMap:
    """Reads the landuse of a chunk.

    Raises:
        EnvgenError: The file cannot be read, or is no landuse of a chunk.
    """
    try:
        with rasterio.open(path) as file:
            tags, classes = file.tags(), file.read(1)
        if "ENVGEN_CHUNK" not in tags or classes.shape != (LANDUSE_CELLS, LANDUSE_CELLS):
            raise EnvgenError(
                f"{path}: is no landuse of a chunk; use --landuse for other landuse maps"
            )
        plots = _read_plots(path)
    except RasterioError as error:
        raise EnvgenError(f"{path}: cannot be read as GeoTIFF: {error}") from error
    x, y = tags["ENVGEN_CHUNK"].split("_")
    return LanduseMap(Chunk(int(x), int(y)), classes[::-1].copy(), plots[::-1].copy())


def read_given_landuse(path: Path, surface: RoadSurface) -> GivenLanduse:
    """Reads a landuse map that stands in for a generated one.

    Args:
        path: GeoTIFF (or any raster that GDAL reads) with `LanduseClass` values in its first
            band. Without a reference system of its own it is taken to be in the road's. A band
            described as ``plot`` holds numbers of plots, 0 for none.
        surface: The road, with its reference system and offset.

    Raises:
        EnvgenError: The file cannot be read, holds other values, does not cover the road, or
            cannot be placed.
    """
    try:
        with rasterio.open(path) as file:
            classes, transform, crs = file.read(1), file.transform, file.crs
            tags, bands = file.tags(), file.descriptions
            plots = file.read(bands.index(PLOT_BAND) + 1) if PLOT_BAND in bands else None
        if "ENVGEN_CHUNK" in tags:
            plots = _read_plots(path)
    except RasterioError as error:
        raise EnvgenError(f"{path}: cannot be read as a raster: {error}") from error
    known = [int(kind) for kind in LanduseClass]
    if unknown := sorted(set(np.unique(classes).tolist()) - set(known)):
        raise EnvgenError(
            f"{path}: holds values {unknown[:5]} that are no landuse classes; known: "
            + ", ".join(f"{int(kind)} {kind.name.lower()}" for kind in LanduseClass)
        )
    place = place_raster(path, transform, crs, surface.crs, surface.offset)
    numbers = None if plots is None else plots.astype(np.int64)
    given = GivenLanduse(classes.astype(np.uint8), place, numbers)
    if not np.any(given.classes_at(surface.vertices[:, :2])):
        raise EnvgenError(f"{path}: does not cover the road; is its reference system right?")
    return given


def _read_plots(path: Path) -> IntArray:
    """The second image of a file that `write_landuse_map` wrote; first row in the north."""
    with rasterio.open(f"GTIFF_DIR:2:{path}") as file:
        plots: IntArray = file.read(1).astype(np.int64)
    return plots

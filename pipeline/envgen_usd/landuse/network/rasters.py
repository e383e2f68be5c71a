"""Training samples from label rasters of any origin."""

import tomllib
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import rasterio
from numpy.typing import NDArray
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.conditions import CONDITIONS
from envgen_usd.landuse.network.fields import NO_WOOD, RAW, REACH
from envgen_usd.landuse.network.samples import LanduseSample
from envgen_usd.models.arrays import BoolArray, ByteArray
from envgen_usd.models.landuse import LanduseClass

SUFFIXES = frozenset({".tif", ".tiff", ".png"})
"""Kinds of files that are read."""
LEAST = 64
"""Cells along the shorter side of a raster below which it is too small."""


def read_raster_samples(folder: Path, class_map: Path | None = None) -> list[LanduseSample]:
    """Reads all label rasters of a folder; cells are taken to be as large as landuse cells.

    Args:
        folder: With GeoTIFF or PNG files; the first band counts.
        class_map: TOML whose table ``classes`` gives the landuse class of each value, e.g.
            ``7 = "wood"``; a value that is not named is grass. Without a map values are
            `LanduseClass` values.

    Raises:
        EnvgenError: Nothing can be read, or the map names an unknown class.
    """
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise EnvgenError(f"{folder}: holds no raster ({', '.join(sorted(SUFFIXES))})")
    table = _table(_read_class_map(class_map)) if class_map else np.arange(256, dtype=np.uint8)
    return [_sample(_read(path, table)) for path in paths]


def street_free(raw: NDArray[np.float16]) -> NDArray[np.float16]:
    """Fields of which only those are left that a raster tells: `RAW` x H x W.

    For networks that were trained on rasters, which know where roads are but not their course.
    """
    kept = np.zeros_like(raw)
    for name in ("distance", "normal_x", "normal_y"):
        kept[RAW.index(name)] = raw[RAW.index(name)]
    kept[RAW.index("offset")] = kept[RAW.index("distance")]
    kept[RAW.index("wood")] = NO_WOOD
    return kept


def _read_class_map(path: Path) -> Mapping[int, LanduseClass]:
    try:
        with path.open("rb") as file:
            named = tomllib.load(file)["classes"]
        return {int(value): LanduseClass[name.upper()] for value, name in named.items()}
    except (OSError, tomllib.TOMLDecodeError, ValueError, AttributeError) as error:
        raise EnvgenError(f"{path}: is no class map: {error}") from error
    except KeyError as error:
        names = ", ".join(kind.name.lower() for kind in LanduseClass)
        raise EnvgenError(f"{path}: {error} is unknown; [classes] has {names}") from error


def _table(named: Mapping[int, LanduseClass]) -> ByteArray:
    table = np.full(256, LanduseClass.GRASS, dtype=np.uint8)
    for value, kind in named.items():
        if not 0 <= value < len(table):
            raise EnvgenError(f"class map: value {value} does not fit into a byte")
        table[value] = kind
    return table


def _read(path: Path, table: ByteArray) -> ByteArray:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)  # a picture will do
            with rasterio.open(path) as file:
                values = file.read(1)
    except RasterioError as error:
        raise EnvgenError(f"{path}: cannot be read as a raster: {error}") from error
    if min(values.shape) < LEAST:
        raise EnvgenError(f"{path}: is {values.shape}; at least {LEAST} cells a side are needed")
    if values.dtype != np.uint8:
        raise EnvgenError(f"{path}: holds {values.dtype}; labels are bytes")
    classes: ByteArray = table[values[::-1]]  # the first row of a raster is the north
    if classes.max() > max(LanduseClass):
        raise EnvgenError(f"{path}: holds values that are no landuse classes; give --classes")
    return classes


def _sample(classes: ByteArray) -> LanduseSample:
    side = min(classes.shape) // 2 * 2
    classes = classes[:side, :side]
    none = np.zeros(classes.shape, dtype=np.int32)
    fields = _fields(classes == LanduseClass.ROAD)
    return LanduseSample(fields, np.zeros(CONDITIONS, dtype=np.float32), classes, none)


def _fields(road: BoolArray) -> NDArray[np.float16]:
    """Distance to the road and the direction away from it, on blocks of two cells a side."""
    raw = np.zeros((len(RAW), *road.shape), dtype=np.float16)
    distance = np.full(road.shape, REACH)
    if road.any():
        distance, (row, column) = ndimage.distance_transform_edt(~road, return_indices=True)
        here = np.indices(road.shape)
        raw[RAW.index("normal_y")] = (here[0] - row) / np.maximum(distance, 1.0)
        raw[RAW.index("normal_x")] = (here[1] - column) / np.maximum(distance, 1.0)
        distance = np.minimum(distance * CELL_SIZE, REACH)
    raw[RAW.index("distance")] = distance
    return street_free(raw[:, ::2, ::2])

"""Training samples from label rasters of any origin."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.raster_part import MOST_PIXELS, opened_raster
from envgen_usd.input_paths import check_input_folder
from envgen_usd.landuse.network.data.environment_conditions import CONDITIONS
from envgen_usd.landuse.network.data.known_fields import NO_WOOD, RAW, REACH
from envgen_usd.landuse.network.data.landuse_scenes import LanduseSample
from envgen_usd.models.array_types import BoolArray, ByteArray
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.toml_files import read_toml

SUFFIXES = frozenset({".tif", ".tiff", ".png"})
"""Supported file suffixes."""
LEAST = 64
"""Least side length of a raster, cells; a larger value rejects more rasters."""


@dataclass(frozen=True)
class _ClassMap:
    """Meaning of raster values."""

    classes: Mapping[Annotated[int, Meta(ge=0, le=255)], LanduseClass]


def read_raster_samples(folder: Path, class_map: Path | None = None) -> list[LanduseSample]:
    """Reads all label rasters of a folder; pixels count as landuse cells.

    Args:
        folder: Folder of GeoTIFF or PNG files; the first band is read.
        class_map: TOML whose table ``classes`` gives the landuse class of each value, e.g. ``7 =
            "wood"``; unlisted values are grass. Without a map, values are `LanduseClass` values.

    Raises:
        EnvgenError: No raster can be read, one has more than `MOST_PIXELS`, or the map names an
            unknown class.
    """
    check_input_folder(folder, "name a folder of label rasters", "--data")
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise EnvgenError(f"{folder}: holds no raster ({', '.join(sorted(SUFFIXES))})")
    table = _table(class_map) if class_map else np.arange(256, dtype=np.uint8)
    return [_sample(_read(path, table)) for path in paths]


def street_free(raw: NDArray[np.float16]) -> NDArray[np.float16]:
    """Fields that a raster provides; all others are cleared: `RAW` x H x W.

    For networks trained on rasters, which show roads but not their course.
    """
    kept = np.zeros_like(raw)
    for name in ("distance", "normal_x", "normal_y"):
        kept[RAW.index(name)] = raw[RAW.index(name)]
    kept[RAW.index("offset")] = kept[RAW.index("distance")]
    kept[RAW.index("wood")] = NO_WOOD
    return kept


def _table(path: Path) -> ByteArray:
    """Landuse class of each value."""
    table = np.full(256, LanduseClass.GRASS, dtype=np.uint8)
    for value, kind in read_toml(path, _ClassMap).classes.items():
        table[value] = kind
    return table


def _read(path: Path, table: ByteArray) -> ByteArray:
    with opened_raster(path) as file:
        _check_size(file.height, file.width, path)
        values = file.read(1)
    if values.dtype != np.uint8:
        raise EnvgenError(f"{path}: holds {values.dtype}; labels are bytes")
    classes: ByteArray = table[values[::-1]]  # the first row of a raster is the north
    if classes.max() > max(LanduseClass):
        raise EnvgenError(f"{path}: holds values that are not landuse classes; give --classes")
    return classes


def _check_size(rows: int, columns: int, path: Path) -> None:
    if min(rows, columns) < LEAST:
        raise EnvgenError(
            f"{path}: has {rows} x {columns} pixels; at least {LEAST} cells per side are needed"
        )
    if rows * columns > MOST_PIXELS:
        raise EnvgenError(
            f"{path}: has {rows} x {columns} pixels; a training raster has at most "
            f"{MOST_PIXELS:,}, so cut it into tiles"
        )


def _sample(classes: ByteArray) -> LanduseSample:
    side = min(classes.shape) // 2 * 2
    classes = classes[:side, :side]
    none = np.zeros(classes.shape, dtype=np.int32)
    fields = _fields(classes == LanduseClass.ROAD)
    return LanduseSample(fields, np.zeros(CONDITIONS, dtype=np.float32), classes, none)


def _fields(road: BoolArray) -> NDArray[np.float16]:
    """Distance to the road and the direction away from it, on blocks of 2 x 2 cells."""
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

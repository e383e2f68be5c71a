"""Ground truth of squares of places: cells, fields that follow from what is given, statistics."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.errors import EnvgenError
from envgen_usd.input_paths import check_input_file
from envgen_usd.landuse.network.data.place_channels import to_place_channels
from envgen_usd.landuse.network.data.training_sample import Sample
from envgen_usd.landuse.place_landuse import PlaceLand
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.whole_files import whole_file

_MADE = "envgen-usd landuse places"
PLACE_RAW = ("distance", "normal_x", "normal_y", "barrier")
"""Fields as they are stored: distance to the road, metres; unit vector away from it; distance to
water or railway, metres. Distances end at `REACH`, where the vector is 0."""
REACH = 100.0
"""Farthest road that a cell knows of, metres; a larger value needs more land around a window."""
AROUND = 128
"""Cells around a square that decide about its fields: `REACH`."""
PLACE_CONDITIONS = 6
"""Length of `place_condition`."""


@dataclass(frozen=True)
class PlaceSample(Sample):
    """Ground truth of a square of a place.

    Attributes:
        classes: S x S `LanduseClass` values; row 0 is the south.
        plots: S x S plot numbers, 0 without a plot.
        built: S x S, true on main buildings.
    """

    classes: ByteArray
    plots: NDArray[np.int32]
    built: BoolArray
    CELLS: ClassVar[tuple[str, ...]] = ("classes", "plots", "built")
    VECTOR: ClassVar[tuple[int, int]] = (PLACE_RAW.index("normal_x"), PLACE_RAW.index("normal_y"))

    @property
    def channels(self) -> ByteArray:
        """The network's channel of each cell."""
        return to_place_channels(self.classes, self.built)

    @classmethod
    def of(cls, land: PlaceLand, statistics: FloatArray, *, is_real: bool = True) -> Self:
        """The sample of a square.

        Args:
            land: The square with `AROUND` cells on each side.
            statistics: Figures of `AREA_STATISTICS`.
            is_real: False for a town by rules.
        """
        cut = np.s_[AROUND:-AROUND, AROUND:-AROUND]
        return cls(
            place_fields(land.classes),
            place_condition(statistics, is_real=is_real),
            land.classes[cut],
            land.plots[cut].astype(np.int32),
            land.built[cut],
        )


def place_fields(classes: ByteArray) -> NDArray[np.float16]:
    """Fields of a square: `PLACE_RAW` x S / 2 x S / 2.

    Args:
        classes: `LanduseClass` values of the square with `AROUND` cells on each side.
    """
    distance, away = _from(classes == LanduseClass.ROAD)
    barrier, _ = _from(np.isin(classes, (LanduseClass.WATER, LanduseClass.RAIL)))
    stacked = np.stack([distance, *away, barrier])
    cut: NDArray[np.float16] = stacked[:, AROUND:-AROUND:2, AROUND:-AROUND:2].astype(np.float16)
    return cut


def place_condition(statistics: FloatArray, *, is_real: bool = True) -> NDArray[np.float32]:
    """Numbers of order one: figures of `AREA_STATISTICS`, known height or not, real or by rules."""
    built, footprint, height, industrial = statistics.tolist()
    is_known = bool(np.isfinite(height)) and height > 0.0
    condition = [
        5.0 * built - 1.0,
        np.log(max(footprint, 10.0) / 200.0),
        np.log(height / 8.0) if is_known else 0.0,
        1.0 if is_known else -1.0,
        2.0 * industrial - 1.0,
        1.0 if is_real else -1.0,
    ]
    return np.array(condition, dtype=np.float32)


def write_place_samples(samples: Sequence[PlaceSample], path: Path) -> None:
    """Writes squares of equal size to a compressed file of arrays, whole or not at all."""
    stacked = {
        field.name: np.stack([getattr(sample, field.name) for sample in samples])
        for field in fields(PlaceSample)
    }
    with whole_file(path) as part, part.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **stacked)


def read_place_samples(path: Path) -> list[PlaceSample]:
    """Reads a file of `write_place_samples`.

    Raises:
        EnvgenError: It is not there, cannot be read, or holds no squares.
    """
    check_input_file(path, f"{_MADE} makes one", "--places")
    names = [field.name for field in fields(PlaceSample)]
    try:
        # numpy leaves a damaged archive open that it opens by itself.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            arrays = {name: data[name] for name in names}
    except Exception as error:  # numpy, zipfile and zlib raise many kinds
        raise EnvgenError(
            f"--places {path}: is no file of squares, or damaged; {_MADE} makes one"
        ) from error
    count = {len(values) for values in arrays.values()}
    if len(count) != 1 or not count.pop():
        raise EnvgenError(f"--places {path}: holds no squares; {_MADE} makes them")
    return [
        PlaceSample(**{name: values[number] for name, values in arrays.items()})
        for number in range(len(arrays["classes"]))
    ]


def _from(source: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Distance to the nearest source cell, metres, and the unit vector away from it (2 x H x W)."""
    if not source.any():
        return np.full(source.shape, REACH), np.zeros((2, *source.shape))
    distance, (row, column) = ndimage.distance_transform_edt(~source, return_indices=True)
    here = np.indices(source.shape)
    length = np.maximum(distance, 1.0)
    away = np.stack([(here[1] - column) / length, (here[0] - row) / length])
    metres = distance * CELL_SIZE
    return np.minimum(metres, REACH), np.where(metres < REACH, away, 0.0)

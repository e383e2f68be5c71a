"""Landuse of places by a network: classes and buildings are sampled, plots follow from them."""

from collections.abc import Sequence

import numpy as np
import torch
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.landuse.network.data.place_channels import (
    CORE,
    GIVEN,
    HALL,
    HOUSE,
    of_place_channels,
)
from envgen_usd.landuse.network.data.place_sample import PlaceSample
from envgen_usd.landuse.network.hole_filling import UNSEEN, draw_chance, fill, schedule
from envgen_usd.landuse.network.model.generator import Generator, PlainUNet
from envgen_usd.landuse.place_landuse import PlaceLand, land_with_plots
from envgen_usd.landuse.specks import remove_specks
from envgen_usd.models.array_types import ByteArray, IntArray
from envgen_usd.seeds import generator

LEAST_HOUSE = 30.0
"""Least footprint of a generated main building, m²; a larger value drops more specks."""

LEAST_CELLS = 12
"""Least number of connected cells of a channel; a larger value removes larger specks."""


def fill_places(
    network: Generator | PlainUNet, samples: Sequence[PlaceSample], seed: int
) -> list[PlaceLand]:
    """Fills squares of equal size whose land is unknown.

    Args:
        network: Trained on places.
        samples: Squares; only what is given, fields and condition are used.
        seed: Seed of all draws.

    Raises:
        EnvgenError: The network's output is not finite.
    """
    channels = np.stack([one.channels for one in samples])
    known = np.where(channels < len(GIVEN), channels, np.uint8(UNSEEN))
    rngs = [generator(seed, "landuse", "place", number) for number in range(len(samples))]
    passes = schedule(network.config.passes)
    chance = draw_chance(rngs, channels.shape[1:], passes, network.task.outputs)
    condition = torch.from_numpy(np.stack([one.condition for one in samples]))
    filled = fill(network, known, network.task.fields(samples), condition, chance)
    return [land_of_channels(one) for one in filled]


def land_of_channels(channels: ByteArray) -> PlaceLand:
    """Classes, plots and buildings of generated channels, H x W.

    Specks take what is around them. Connected cells of buildings are one building for each core
    among them (`buildings_of`). What is smaller than `LEAST_HOUSE` is no building, and residential
    ground beyond the reach of all buildings becomes grass.
    """
    smooth = remove_specks(channels, LEAST_CELLS)
    is_given = (channels < len(GIVEN)) | (smooth < len(GIVEN))
    channels = np.where(is_given, channels, smooth)
    classes, _ = of_place_channels(channels)
    houses = buildings_of(channels)
    count = int(houses.max(initial=0)) + 1
    halls, all_of_it = (
        np.bincount(houses[kind], minlength=count)[1:]
        for kind in (channels == HALL, (channels == HALL) | (channels == HOUSE))
    )
    return land_with_plots(classes, houses, 2 * halls > all_of_it)


def buildings_of(channels: ByteArray) -> IntArray:
    """Number of the building on each cell, 0 without: connected cells go to their nearest core."""
    built = channels >= HOUSE
    connected = np.asarray(ndimage.label(built)[0], np.int64)
    cores, count = ndimage.label(channels == CORE)
    parts = connected + count * built
    if count:
        index = ndimage.distance_transform_edt(
            cores == 0, return_distances=False, return_indices=True
        )
        same = connected[tuple(index)] == connected
        parts = np.where(built & same, cores[tuple(index)], parts)
    counts = np.bincount(parts.ravel())
    counts[0] = 0
    large = np.flatnonzero(counts * CELL_SIZE**2 >= LEAST_HOUSE)
    number = np.zeros(len(counts), np.int64)
    number[large] = np.arange(1, len(large) + 1)
    return number[parts]

"""Baselines of the evaluation."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.landuse.network.data.class_channels import OUTPUTS, ROAD
from envgen_usd.landuse.network.data.known_fields import RAW
from envgen_usd.landuse.network.data.landuse_scenes import LanduseSample, make_sample
from envgen_usd.landuse.network.training.landuse_evaluation import CORNER, SIZE, Fill, Window
from envgen_usd.landuse.network.training.training_batches import window_of
from envgen_usd.models.array_types import ByteArray, IntArray

_BINS = 24


def by_majority(training: Sequence[LanduseSample]) -> Fill:
    """The most frequent class everywhere."""
    counts = sum(np.bincount(s.channels.ravel(), minlength=OUTPUTS + 1) for s in training)
    most = np.uint8(1 + np.argmax(np.asarray(counts)[1:]))
    return lambda window, _: np.where(window.sample.channels == ROAD, np.uint8(ROAD), most)


def by_distance(training: Sequence[LanduseSample]) -> Fill:
    """The most frequent class at each offset from the roadside, in plot depths."""
    counts = np.zeros((2, _BINS, OUTPUTS + 1))
    for sample in training:
        np.add.at(counts[_ground(sample)], (_bins(sample), sample.channels), 1)
    most = (1 + np.argmax(counts[..., 1:], axis=-1)).astype(np.uint8)

    def make(window: Window, _: int) -> ByteArray:
        sample = window.sample
        channels = most[_ground(sample), _bins(sample)]
        return np.where(sample.channels == ROAD, np.uint8(ROAD), channels)

    return make


def by_rules(window: Window, draw: int) -> ByteArray:
    """The rules, drawn again on the same roads: their agreement with themselves."""
    again = window_of(make_sample(*window.number, again=draw + 1), CORNER, CORNER, SIZE)
    return again.channels


def _ground(sample: LanduseSample) -> int:
    return int(sample.condition[-1] > 0)


def _bins(sample: LanduseSample) -> IntArray:
    raw = sample.raw.astype(np.float64)
    depth = raw[RAW.index("offset")] / np.maximum(raw[RAW.index("depth")], 1.0)
    depth = depth.repeat(2, 0).repeat(2, 1)
    bins: IntArray = np.clip((depth + 0.2) * 12, 0, _BINS - 1).astype(np.int64)
    return bins

"""Batches: windows cut from samples, turned and masked."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from envgen_usd.landuse.network.classes import ROAD
from envgen_usd.landuse.network.fields import RAW, expand
from envgen_usd.landuse.network.generator import one_hot
from envgen_usd.landuse.network.masks import draw_mask
from envgen_usd.landuse.network.samples import Sample
from envgen_usd.models.arrays import BoolArray
from envgen_usd.seeds import generator


@dataclass(frozen=True)
class Batch:
    """What a network sees, and the truth.

    Attributes:
        channels: B x H x W, true channel of every cell.
        known: B x `INPUTS` x H x W one-hot of the truth.
        mask: B x 1 x H x W, 1 where known; roads always are.
        fields: B x `FIELDS` x H / 2 x W / 2.
        condition: B x `CONDITIONS`.
    """

    channels: Tensor
    known: Tensor
    mask: Tensor
    fields: Tensor
    condition: Tensor

    def to(self, device: torch.device) -> "Batch":
        """The same batch on a device."""
        return Batch(**{name: value.to(device) for name, value in vars(self).items()})


def training_batch(samples: Sequence[Sample], step: int, size: int, batch: int, seed: int) -> Batch:
    """Draws the batch of a training step; it follows from the step and the seed alone."""
    rng = generator(seed, "landuse", "batch", step)
    chosen = [samples[n] for n in rng.integers(len(samples), size=batch)]
    windows = [_random_window(sample, size, rng) for sample in chosen]
    return stack(windows, [draw_mask(size, rng) for _ in windows])


def stack(windows: Sequence[Sample], masks: Sequence[BoolArray]) -> Batch:
    """Makes a batch of windows (even sides) and of what is known in each besides the road."""
    channels = torch.from_numpy(np.stack([window.channels for window in windows]))
    given = torch.from_numpy(np.stack(masks)) | (channels == ROAD)
    raw = torch.from_numpy(np.stack([window.raw for window in windows]))
    condition = torch.from_numpy(np.stack([window.condition for window in windows]))
    known = one_hot(channels)
    return Batch(channels.long(), known, given[:, None].float(), expand(raw), condition)


def window_of(sample: Sample, row: int, column: int, size: int) -> Sample:
    """Cuts a window; row, column and size are even."""
    cells = np.s_[row : row + size, column : column + size]
    places = np.s_[:, row // 2 : (row + size) // 2, column // 2 : (column + size) // 2]
    return Sample(sample.classes[cells], sample.plots[cells], sample.raw[places], sample.condition)


def mirror(sample: Sample) -> Sample:
    """Swaps west and east of a sample; roadsides keep the place where they begin."""
    raw = sample.raw[..., ::-1].copy()
    raw[_NORMAL[0]] *= -1
    return Sample(sample.classes[:, ::-1], sample.plots[:, ::-1], raw, sample.condition)


def turn(sample: Sample, quarters: int) -> Sample:
    """Turns a square sample clockwise by quarters."""
    raw = np.rot90(sample.raw, quarters, (1, 2)).copy()
    for _ in range(quarters % 4):
        x, y = raw[_NORMAL]
        raw[_NORMAL] = y, -x
    classes, plots = np.rot90(sample.classes, quarters), np.rot90(sample.plots, quarters)
    return Sample(classes, plots, raw, sample.condition)


_NORMAL = [RAW.index("normal_x"), RAW.index("normal_y")]


def _random_window(sample: Sample, size: int, rng: np.random.Generator) -> Sample:
    row, column = 2 * rng.integers(0, (len(sample.plots) - size) // 2 + 1, 2)
    window = turn(window_of(sample, int(row), int(column), size), int(rng.integers(4)))
    return mirror(window) if rng.uniform() < 0.5 else window

"""Batches: windows cropped from samples, rotated and masked."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from envgen_usd.landuse.network.data.training_masks import draw_mask
from envgen_usd.landuse.network.model.network_config import TrainConfig
from envgen_usd.landuse.network.tasks.network_task import S, Task
from envgen_usd.models.array_types import BoolArray
from envgen_usd.seeds import generator


@dataclass(frozen=True)
class Batch:
    """Input of a network, and the truth.

    Attributes:
        truth: B x H x W, true value of every cell.
        known: B x inputs x H x W, the encoded truth.
        mask: B x 1 x H x W, 1 where known; roads always are.
        fields: B x fields x H / 2 x W / 2.
        condition: B x condition, numbers of the environment.
    """

    truth: Tensor
    known: Tensor
    mask: Tensor
    fields: Tensor
    condition: Tensor

    def to(self, device: torch.device) -> "Batch":
        """The same batch on a device."""
        return Batch(**{name: value.to(device) for name, value in vars(self).items()})


def training_batch(
    task: Task[S], samples: Sequence[S], step: int, windows: tuple[int, int], config: TrainConfig
) -> Batch:
    """Draws the batch of a training step; it depends on the step and the seed alone.

    Args:
        task: Task of the network.
        samples: Samples to crop windows from.
        step: Number of the step.
        windows: Side length of a window in cells, and number of windows.
        config: Seed, and parameters of the masks.
    """
    size, count = windows
    rng = generator(config.seed, "landuse", "batch", step)
    chosen = [samples[n] for n in rng.integers(len(samples), size=count)]
    cut = [_random_window(sample, size, rng) for sample in chosen]
    return stack(task, cut, [draw_mask(size, rng, config.scattered) for _ in cut])


def stack(task: Task[S], windows: Sequence[S], masks: Sequence[BoolArray]) -> Batch:
    """Makes a batch from windows (even sides) and the mask of each; the road is always known."""
    truth = task.truth(windows)
    given = torch.from_numpy(np.stack(masks) | np.stack([task.road(one) for one in windows]))
    condition = torch.from_numpy(np.stack([window.condition for window in windows]))
    known = task.encode(truth)
    return Batch(truth, known, given[:, None].float(), task.fields(windows), condition)


def window_of(sample: S, row: int, column: int, size: int) -> S:
    """Crops a window; row, column and size are even."""
    cells = np.s_[row : row + size, column : column + size]
    places = np.s_[:, row // 2 : (row + size) // 2, column // 2 : (column + size) // 2]
    return sample.moved(lambda maps: maps[cells], lambda raw: raw[places])


def mirror(sample: S) -> S:
    """Swaps west and east of a sample; the start of each roadside stays."""
    mirrored = sample.moved(lambda maps: maps[:, ::-1], lambda raw: raw[..., ::-1].copy())
    mirrored.raw[sample.VECTOR[0]] *= -1
    return mirrored


def turn(sample: S, quarters: int) -> S:
    """Rotates a square sample clockwise by quarter turns."""
    raw = np.rot90(sample.raw, quarters, (1, 2)).copy()
    vector = list(sample.VECTOR)
    for _ in range(quarters % 4):
        x, y = raw[vector]
        raw[vector] = y, -x
    return sample.moved(lambda maps: np.rot90(maps, quarters), lambda _: raw)


def _random_window(sample: S, size: int, rng: np.random.Generator) -> S:
    row, column = 2 * rng.integers(0, (sample.side - size) // 2 + 1, 2)
    window = turn(window_of(sample, int(row), int(column), size), int(rng.integers(4)))
    return mirror(window) if rng.uniform() < 0.5 else window

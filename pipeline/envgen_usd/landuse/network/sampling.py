"""Fills the holes of windows, a few drawn cells first and then the rest."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from envgen_usd.landuse.network.classes import OUTPUTS, ROAD
from envgen_usd.landuse.network.draws import Draws
from envgen_usd.landuse.network.generator import Generator, PlainUNet
from envgen_usd.landuse.network.masks import DENSEST, SPARSEST
from envgen_usd.landuse.network.precision import computes_in_half
from envgen_usd.models.arrays import ByteArray

UNSEEN = 255
"""Channel of a cell that is to be filled."""
PASSES = (0.0005, 0.004, 0.03)
"""Shares of the cells that are drawn and kept, pass by pass, before the rest is filled in.

One pass cannot choose among many right fills; a few drawn cells choose for it (Chang et al. 2022).
"""


def schedule(passes: int) -> tuple[float, ...]:
    """Shares of the cells that are known after each pass but the last, as in training."""
    return tuple(np.geomspace(SPARSEST, DENSEST, passes - 1).tolist())


@dataclass(frozen=True)
class Chance:
    """Random numbers of a batch of windows.

    Attributes:
        order: B x H x W in [0, 1): cells with the least numbers are drawn first.
        noise: B x `OUTPUTS` x H x W Gumbel noise: the largest of log-probability plus noise is a
            draw of the class.
        seeds: B seeds of style and noise of the network.
        passes: Ascending shares of cells to draw before the rest is filled in.
    """

    order: NDArray[np.float32]
    noise: NDArray[np.float32]
    seeds: Sequence[int]
    passes: Sequence[float]


def draw_chance(
    rngs: Sequence[np.random.Generator], shape: tuple[int, int], passes: Sequence[float]
) -> Chance:
    """Draws the random numbers of a batch, each window's from a generator of its own.

    Without passes no cell is drawn, so only the seeds are.
    """
    if not passes:
        nothing = np.empty((0,), dtype=np.float32)
        return Chance(nothing, nothing, [int(rng.integers(2**31)) for rng in rngs], passes)
    orders = [rng.random(shape, dtype=np.float32) for rng in rngs]
    noises = [gumbel(rng, shape) for rng in rngs]
    seeds = [int(rng.integers(2**31)) for rng in rngs]
    return Chance(np.stack(orders), np.stack(noises), seeds, passes)


def gumbel(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Gumbel noise for `OUTPUTS` classes of each cell, `OUTPUTS` x shape."""
    even = np.clip(rng.random((OUTPUTS, *shape), dtype=np.float32), 1e-6, 1 - 1e-6)
    noise: NDArray[np.float32] = -np.log(-np.log(even))
    return noise


def fill(
    network: Generator | PlainUNet,
    channels: ByteArray,
    fields: Tensor,
    condition: Tensor,
    chance: Chance,
) -> ByteArray:
    """Fills what is `UNSEEN`, some drawn cells first; every other cell stays as it is.

    Args:
        network: Trained.
        channels: B x H x W; the road is always given.
        fields: B x `FIELDS` x H / 2 x W / 2.
        condition: B x `CONDITIONS`.
        chance: Random numbers.
    """
    for share in chance.passes:
        logits = _logits(network, channels, fields, condition, chance.seeds)
        logits = logits.log_softmax(1) + torch.from_numpy(chance.noise)
        drawn = _channels(logits)
        channels = np.where((channels == UNSEEN) & (chance.order < share), drawn, channels)
    made = _channels(_logits(network, channels, fields, condition, chance.seeds))
    return np.where(channels == UNSEEN, made, channels)


@torch.no_grad()
def _logits(
    network: Generator | PlainUNet,
    channels: ByteArray,
    fields: Tensor,
    condition: Tensor,
    seeds: Sequence[int],
) -> Tensor:
    """Logits of the second stage, B x `OUTPUTS` x H x W."""
    mask = torch.from_numpy(channels != UNSEEN)
    known = network.task.encode(torch.from_numpy(np.where(channels == UNSEEN, ROAD, channels)))
    half = computes_in_half(fields.device)
    with torch.autocast(fields.device.type, torch.bfloat16, enabled=half):
        fine, _ = network(known, mask[:, None].float(), fields, condition, Draws(seeds))
    return torch.as_tensor(fine.float())


def _channels(scores: Tensor) -> ByteArray:
    channels: ByteArray = (scores.argmax(1) + 1).numpy().astype(np.uint8)
    return channels

"""Fills the holes of windows: first a few sampled cells, then the rest."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from envgen_usd.landuse.network.data.cell_order import dispersed_order
from envgen_usd.landuse.network.data.class_channels import OUTPUTS, ROAD
from envgen_usd.landuse.network.data.training_masks import DENSEST, SPARSEST
from envgen_usd.landuse.network.model.compute_precision import computes_in_half
from envgen_usd.landuse.network.model.finite_output import finite
from envgen_usd.landuse.network.model.forward_draws import Draws
from envgen_usd.landuse.network.model.generator import Generator, PlainUNet
from envgen_usd.models.array_types import ByteArray

UNSEEN = 255
"""Channel of an unknown cell."""
PASSES = (0.0005, 0.004, 0.03)
"""Shares of the cells that are sampled and kept in each pass before the rest is filled in.

A single pass cannot choose among many valid fills; the sampled cells make the choice (Chang et al.
2022).
"""


def schedule(passes: int) -> tuple[float, ...]:
    """Shares of the known cells after each pass except the last, as in training."""
    return tuple(np.geomspace(SPARSEST, DENSEST, passes - 1).tolist())


@dataclass(frozen=True)
class Chance:
    """Random numbers for a batch of windows.

    Attributes:
        order: B x H x W in [0, 1): cells with the least numbers are sampled first.
        noise: B x outputs x H x W Gumbel noise: the largest of logits plus noise is a sample of
            the class.
        seeds: B seeds of style and noise of the network.
        passes: Ascending shares of cells to sample before the rest is filled in.
    """

    order: NDArray[np.float32]
    noise: NDArray[np.float32]
    seeds: Sequence[int]
    passes: Sequence[float]


def draw_chance(
    rngs: Sequence[np.random.Generator],
    shape: tuple[int, int],
    passes: Sequence[float],
    outputs: int = OUTPUTS,
) -> Chance:
    """Draws the random numbers of a batch, with a separate generator for each window.

    Without passes no cell is sampled, so only the seeds are drawn.

    Args:
        rngs: Generator of each window.
        shape: Rows and columns of a window.
        passes: See `Chance`.
        outputs: Number of output channels of the network.
    """
    if not passes:
        nothing = np.empty((0,), dtype=np.float32)
        return Chance(nothing, nothing, [int(rng.integers(2**31)) for rng in rngs], passes)
    orders = [dispersed_order(shape, rng) for rng in rngs]
    noises = [gumbel(rng, (outputs, *shape)) for rng in rngs]
    seeds = [int(rng.integers(2**31)) for rng in rngs]
    return Chance(np.stack(orders), np.stack(noises), seeds, passes)


def gumbel(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Gumbel noise of a shape."""
    even = np.clip(rng.random(shape, dtype=np.float32), 1e-6, 1 - 1e-6)
    noise: NDArray[np.float32] = -np.log(-np.log(even))
    return noise


def fill(
    network: Generator | PlainUNet,
    channels: ByteArray,
    fields: Tensor,
    condition: Tensor,
    chance: Chance,
) -> ByteArray:
    """Fills `UNSEEN` cells, sampled cells first; every other cell is unchanged.

    Args:
        network: Trained network.
        channels: B x H x W; the road is always known.
        fields: B x fields x H / 2 x W / 2.
        condition: B x condition.
        chance: Random numbers.

    Raises:
        EnvgenError: The network's output is not finite.
    """
    for share in chance.passes:
        logits = _logits(network, channels, fields, condition, chance.seeds)
        drawn = _channels(network, logits + torch.from_numpy(chance.noise))
        channels = np.where((channels == UNSEEN) & (chance.order < share), drawn, channels)
    logits = _logits(network, channels, fields, condition, chance.seeds)
    filled = _channels(network, logits)
    return np.where(channels == UNSEEN, filled, channels)


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
    return finite(torch.as_tensor(fine.float()))


def _channels(network: Generator | PlainUNet, scores: Tensor) -> ByteArray:
    channels: ByteArray = network.task.decode(scores).numpy().astype(np.uint8)
    return channels

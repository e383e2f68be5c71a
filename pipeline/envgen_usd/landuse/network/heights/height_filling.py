"""Generates heights of windows by a trained network."""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import ndimage

from envgen_usd.landuse.network.data.height_sample import HeightSample
from envgen_usd.landuse.network.model.finite_output import finite
from envgen_usd.landuse.network.model.forward_draws import Draws
from envgen_usd.landuse.network.model.generator import Generator, PlainUNet
from envgen_usd.landuse.network.tasks.height_task import to_rise
from envgen_usd.landuse.network.training.training_batches import stack

SOFTNESS = 1.0
"""Deviation of the smoothing of the output, cells, as a network works on every second cell. A
larger value makes smoother ground."""


@torch.no_grad()
def fill_heights(
    network: Generator | PlainUNet, windows: Sequence[HeightSample], seeds: Sequence[int]
) -> NDArray[np.float32]:
    """Heights above the reference, metres; only the road is known.

    Computes in single precision: half precision would give a roughness of centimetres.

    Args:
        network: Network trained on heights.
        windows: B windows of equal size; their `rise` is ignored.
        seeds: B seeds of style and noise.

    Returns:
        Heights above the reference, B x H x W, metres; 0 on the road.

    Raises:
        EnvgenError: The network's output is not finite.
    """
    nothing = [np.zeros(window.road.shape, dtype=np.bool_) for window in windows]
    batch = stack(network.task, windows, nothing)
    fine, _ = network(batch.known, batch.mask, batch.fields, batch.condition, Draws(seeds))
    rise = to_rise(network.task.decode(finite(fine))) * (1 - batch.mask[:, 0])
    smooth = ndimage.gaussian_filter(rise.numpy(), (0.0, SOFTNESS, SOFTNESS), mode="nearest")
    heights: NDArray[np.float32] = np.where(batch.mask[:, 0].numpy() > 0.0, 0.0, smooth)
    return heights

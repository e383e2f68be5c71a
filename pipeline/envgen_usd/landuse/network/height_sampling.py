"""Heights of windows by a trained network."""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from envgen_usd.landuse.network.batches import stack
from envgen_usd.landuse.network.draws import Draws
from envgen_usd.landuse.network.generator import Generator, PlainUNet
from envgen_usd.landuse.network.height_sample import HeightSample
from envgen_usd.landuse.network.height_task import to_rise


@torch.no_grad()
def fill_heights(
    network: Generator | PlainUNet, windows: Sequence[HeightSample], seeds: Sequence[int]
) -> NDArray[np.float32]:
    """Metres from the reference up to the ground, of which only the road is known.

    It computes in single precision: in half of it, ground would be rough by centimetres.

    Args:
        network: Trained on heights.
        windows: Of one size, B; their `rise` does not count.
        seeds: B seeds of style and noise.

    Returns:
        B x H x W, 0 on the road.
    """
    nothing = [np.zeros(window.road.shape, dtype=np.bool_) for window in windows]
    batch = stack(network.task, windows, nothing)
    fine, _ = network(batch.known, batch.mask, batch.fields, batch.condition, Draws(seeds))
    rise = to_rise(network.task.decode(fine)) * (1 - batch.mask[:, 0])
    made: NDArray[np.float32] = rise.numpy()
    return made

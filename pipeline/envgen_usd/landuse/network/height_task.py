"""Filling the holes of height maps in black and white."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.landuse.network.height_sample import HEIGHT_RAW, HeightSample
from envgen_usd.landuse.network.task import Task
from envgen_usd.models.arrays import BoolArray, ByteArray

CONTRAST = 20.0
"""Metres from mid-grey, the reference, up to white and down to black; what is beyond is cut."""
HEIGHT_FIELDS = 10
"""Channels that `HeightTask.fields` makes."""
HEIGHT_GAIN = 0.01
"""Scale of what comes out at the start: most ground is within metres of the reference."""
HEIGHT_RATE = 1e-2
"""Learning rate of the generator."""
HUBER = 0.05
"""Error in greys, one metre, up to which the loss is quadratic."""
STEEPNESS = 4.0
"""Weight of errors of the difference between neighbouring cells, so that ground is smooth."""
HOLE = (44, 62, 120)
"""Colour of the hole in pictures."""


class HeightTask(Task[HeightSample]):
    """Metres above a reference as a grey between -1, black, and 1, white; in and out.

    The reference is the ground that the road alone tells, so the road is mid-grey and greys mean
    the same at any height above the sea. How high the reference lies is among the fields.
    """

    inputs, outputs = 1, 1

    def truth(self, windows: Sequence[HeightSample]) -> Tensor:
        """Greys of the cells."""
        return to_grey(torch.from_numpy(np.stack([window.rise for window in windows])))

    def road(self, window: HeightSample) -> BoolArray:
        """The road's cells."""
        return window.road

    def fields(self, windows: Sequence[HeightSample]) -> Tensor:
        """B x `HEIGHT_FIELDS` x H / 2 x W / 2, see `height_fields`."""
        raw = torch.from_numpy(np.stack([window.raw for window in windows]))
        return height_fields(raw, torch.from_numpy(np.stack([one.reference for one in windows])))

    def encode(self, truth: Tensor) -> Tensor:
        """One channel of greys."""
        return truth[:, None]

    def decode(self, output: Tensor) -> Tensor:
        """Greys."""
        return output[:, 0].float()

    def composite(self, output: Tensor, known: Tensor, mask: Tensor) -> Tensor:
        """Greys: given where known, generated in the hole."""
        return known * mask + output.float() * (1 - mask)

    def loss(self, output: Tensor, truth: Tensor, mask: Tensor, smoothing: float) -> Tensor:  # noqa: ARG002 - there are no labels
        """Huber's loss of heights and the absolute error of their steps from cell to cell."""
        made, hole = output[:, 0].float(), 1 - mask[:, 0]
        error = made - truth
        each = F.huber_loss(made, truth, reduction="none", delta=HUBER) / HUBER
        steps = sum((error.diff(dim=axis).abs() * _both(hole, axis)).sum((1, 2)) for axis in (1, 2))
        total = (each * hole).sum((1, 2)) + STEEPNESS * torch.as_tensor(steps)
        return total / hole.sum((1, 2)).clamp(min=1)

    def real(self, known: Tensor) -> Tensor:
        """As it is."""
        return known

    def picture(self, values: NDArray[Any], known: BoolArray | None = None) -> ByteArray:
        """Greys; twice the contrast, for most ground is near the reference."""
        grey = np.clip(127.5 * (1 + 2 * values), 0, 255).astype(np.uint8)
        picture: ByteArray = np.repeat(grey[..., None], 3, axis=-1)
        if known is not None:
            picture[~known] = HOLE
        return picture


def to_grey(rise: Tensor) -> Tensor:
    """Metres above the reference to greys."""
    return (rise / CONTRAST).clamp(-1.0, 1.0)


def to_rise(grey: Tensor) -> Tensor:
    """Greys to metres above the reference."""
    return grey * CONTRAST


def height_fields(raw: Tensor, reference: Tensor) -> Tensor:
    """What is known everywhere of heights.

    Args:
        raw: B x `HEIGHT_RAW` x H / 2 x W / 2.
        reference: B x H x W, metres.

    Returns:
        B x `HEIGHT_FIELDS` x H / 2 x W / 2: distance to the road on four scales, direction away
        from it, height of the nearest road; height and slope of the reference, its height seen
        from the window's mean.
    """
    part = dict(zip(HEIGHT_RAW, raw.float().unbind(1), strict=True))
    level = F.avg_pool2d((reference - reference.mean((1, 2), keepdim=True))[:, None], 2)[:, 0]
    north, east = torch.gradient(level, spacing=2 * CELL_SIZE, dim=(1, 2))
    distance = part["distance"]
    fields = [
        (distance / 150).clamp(0.0, 2.0),
        (distance / 40).clamp(0.0, 2.0),
        torch.tanh(distance / 12),
        torch.tanh(distance / 3),
        part["normal_x"],
        part["normal_y"],
        (part["above"] / 5).clamp(-2.0, 2.0),
        (level / 10).clamp(-3.0, 3.0),
        (east * 10).clamp(-2.0, 2.0),
        (north * 10).clamp(-2.0, 2.0),
    ]
    return torch.stack(fields, dim=1)


def _both(hole: Tensor, axis: int) -> Tensor:
    """Pairs of neighbours along an axis that are both in the hole."""
    count = hole.shape[axis] - 1
    return hole.narrow(axis, 0, count) * hole.narrow(axis, 1, count)

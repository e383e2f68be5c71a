"""The task of filling holes of height maps in greyscale."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL, HEIGHT_RAW, HeightSample
from envgen_usd.landuse.network.tasks.network_task import Task
from envgen_usd.models.array_types import BoolArray, ByteArray

CONTRAST = 40.0
"""Height range from mid-grey, the reference, to white or black, metres; heights beyond are clipped.

A larger value covers more relief with less precision.
"""
HEIGHT_FIELDS = 14
"""Number of channels of `HeightTask.fields`."""
HEIGHT_GAIN = 0.1
"""Initial output scale, as most ground is within metres of the reference.

A larger value starts with rougher heights.
"""
HEIGHT_RATE = 1e-2
"""Learning rate of the generator; a larger value takes larger steps."""
LEAST_RISE = 2.0
"""Rise below which windows count alike in the loss, metres; a larger value learns plains less."""
STEEPNESS = 0.5
"""Weight of errors in height differences of adjacent cells; a larger value makes smoother ground.

"""
SCALES = (12.5, 25.0, 50.0, 100.0)
"""Deviations of the means of the reference among the fields, metres."""
HOLE = (44, 62, 120)
"""Colour of the hole in images."""


class HeightTask(Task[HeightSample]):
    """Heights above a reference as greys from -1 (black) to 1 (white), for input and output.

    The reference is the ground interpolated from the road alone. The road is thus mid-grey, and
    greys do not depend on the elevation. The reference's height is among the fields.
    """

    inputs, outputs = 1, 1

    def truth(self, windows: Sequence[HeightSample]) -> Tensor:
        """Greys of the cells."""
        return to_grey(torch.from_numpy(np.stack([window.rise for window in windows])))

    def road(self, window: HeightSample) -> BoolArray:
        """Cells of the road."""
        return window.road

    def fields(self, windows: Sequence[HeightSample]) -> Tensor:
        """B x `HEIGHT_FIELDS` x H / 2 x W / 2, see `height_fields`."""
        raw = torch.from_numpy(np.stack([window.raw for window in windows]))
        return height_fields(raw, torch.from_numpy(np.stack([one.reference for one in windows])))

    def encode(self, truth: Tensor) -> Tensor:
        """A single channel of greys."""
        return truth[:, None]

    def decode(self, output: Tensor) -> Tensor:
        """Greys."""
        return output[:, 0].float()

    def composite(self, output: Tensor, known: Tensor, mask: Tensor) -> Tensor:
        """Greys: given in known cells, generated in the hole."""
        return known * mask + output.float() * (1 - mask)

    def loss(self, output: Tensor, truth: Tensor, mask: Tensor, smoothing: float) -> Tensor:  # noqa: ARG002 - there are no labels
        """Squared error of heights, plus the absolute error of differences of adjacent cells.

        The squared error is divided by the window's root mean square of the truth, as a few slopes
        would hold nearly all of it.
        """
        hole = 1 - mask[:, 0]
        error, count = output[:, 0].float() - truth, hole.sum((1, 2)).clamp(min=1)
        square, rise = ((one**2 * hole).sum((1, 2)) / count for one in (error, truth))
        steps = sum((error.diff(dim=axis).abs() * _both(hole, axis)).sum((1, 2)) for axis in (1, 2))
        least = (LEAST_RISE / CONTRAST) ** 2
        return square / (rise + least).sqrt() + STEEPNESS * torch.as_tensor(steps) / count

    def real(self, known: Tensor) -> Tensor:
        """Unchanged."""
        return known

    def picture(self, values: NDArray[Any], known: BoolArray | None = None) -> ByteArray:
        """Greys at twice the contrast, as most ground is near the reference."""
        grey = np.clip(127.5 * (1 + 2 * values), 0, 255).astype(np.uint8)
        picture: ByteArray = np.repeat(grey[..., None], 3, axis=-1)
        if known is not None:
            picture[~known] = HOLE
        return picture


def to_grey(rise: Tensor) -> Tensor:
    """Converts metres above the reference to greys."""
    return (rise / CONTRAST).clamp(-1.0, 1.0)


def to_rise(grey: Tensor) -> Tensor:
    """Converts greys to metres above the reference."""
    return grey * CONTRAST


def height_fields(raw: Tensor, reference: Tensor) -> Tensor:
    """Height fields known everywhere.

    Args:
        raw: B x `HEIGHT_RAW` x H / 2 x W / 2.
        reference: B x H x W, metres.

    Returns:
        B x `HEIGHT_FIELDS` x H / 2 x W / 2: distance to the road on four scales, direction away
        from it, height of the nearest road; height of the reference relative to the window's mean,
        its slope, and how much it is below its mean on four scales, in hollows.
    """
    part = dict(zip(HEIGHT_RAW, raw.float().unbind(1), strict=True))
    level = F.avg_pool2d((reference - reference.mean((1, 2), keepdim=True))[:, None], 2)[:, 0]
    north, east = torch.gradient(level, spacing=2 * HEIGHT_CELL, dim=(1, 2))
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
        *(((mean - level) / 5).clamp(-3.0, 3.0) for mean in _means(level)),
    ]
    return torch.stack(fields, dim=1)


def _means(level: Tensor) -> list[Tensor]:
    """Gaussian means of `SCALES`; beyond the window lie the values of its border."""
    means = []
    for scale in SCALES:
        deviation = scale / (2 * HEIGHT_CELL)
        reach = math.ceil(3 * deviation)
        steps = torch.arange(-reach, reach + 1.0, device=level.device)
        weights = torch.exp(-0.5 * (steps / deviation) ** 2)
        weights /= weights.sum()
        wide = F.pad(level[:, None], (reach,) * 4, mode="replicate")
        rows = F.conv2d(wide, weights.reshape(1, 1, 1, -1))
        means.append(F.conv2d(rows, weights.reshape(1, 1, -1, 1))[:, 0])
    return means


def _both(hole: Tensor, axis: int) -> Tensor:
    """Pairs of adjacent cells along an axis that both lie in the hole."""
    count = hole.shape[axis] - 1
    return hole.narrow(axis, 0, count) * hole.narrow(axis, 1, count)

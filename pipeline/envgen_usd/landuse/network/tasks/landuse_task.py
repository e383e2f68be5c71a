"""The task of filling holes of class maps."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.data.class_channels import INPUTS, OUTPUTS, ROAD
from envgen_usd.landuse.network.data.known_fields import expand
from envgen_usd.landuse.network.data.landuse_scenes import LanduseSample
from envgen_usd.landuse.network.tasks.network_task import Task
from envgen_usd.models.array_types import BoolArray, ByteArray

COLOURS = np.array(
    [
        (80, 80, 84),
        (124, 172, 86),
        (66, 122, 46),
        (176, 222, 136),
        (184, 156, 118),
        (236, 214, 130),
        (24, 74, 34),
        (206, 44, 40),
        (20, 20, 20),
    ],
    dtype=np.uint8,
)
"""Colour of each input channel; the last colour is for the hole."""
HOLE = len(COLOURS) - 1
"""Index that draws a cell of the hole."""
SMOOTHING = 0.1
"""Softness of the real maps for the critic; a larger value makes them softer."""


class LanduseTask(Task[LanduseSample]):
    """Inputs are one-hot classes, outputs are logits of all classes except road."""

    inputs, outputs = INPUTS, OUTPUTS

    def truth(self, windows: Sequence[LanduseSample]) -> Tensor:
        """Channels of the cells."""
        return torch.from_numpy(np.stack([window.channels for window in windows])).long()

    def road(self, window: LanduseSample) -> BoolArray:
        """Cells of the road."""
        road: BoolArray = window.channels == ROAD
        return road

    def fields(self, windows: Sequence[LanduseSample]) -> Tensor:
        """B x `FIELDS` x H / 2 x W / 2."""
        return expand(torch.from_numpy(np.stack([window.raw for window in windows])))

    def encode(self, truth: Tensor) -> Tensor:
        """One-hot."""
        return F.one_hot(truth.long(), INPUTS).permute(0, 3, 1, 2).float()

    def decode(self, output: Tensor) -> Tensor:
        """The most likely channels; never road."""
        return output.argmax(1) + 1

    def composite(self, output: Tensor, known: Tensor, mask: Tensor) -> Tensor:
        """Probabilities of every class: given in known cells, generated in the hole, never road."""
        generated = F.pad(output.float().softmax(1), (0, 0, 0, 0, 1, 0))  # no road
        return known * mask + generated * (1 - mask)

    def loss(self, output: Tensor, truth: Tensor, mask: Tensor, smoothing: float) -> Tensor:
        """Cross-entropy with label smoothing; the road is known and does not count."""
        target = (truth - 1).clamp(min=0)
        each = F.cross_entropy(output.float(), target, reduction="none", label_smoothing=smoothing)
        hole = 1 - mask[:, 0]
        return (each * hole).sum((1, 2)) / hole.sum((1, 2)).clamp(min=1)

    def real(self, known: Tensor) -> Tensor:
        """Softened one-hot, so that softness alone does not reveal generated cells."""
        return known * (1 - SMOOTHING) + SMOOTHING / INPUTS

    def picture(self, values: NDArray[Any], known: BoolArray | None = None) -> ByteArray:
        """A colour for each channel."""
        drawn = values if known is None else np.where(known, values, HOLE)
        picture: ByteArray = COLOURS[drawn]
        return picture

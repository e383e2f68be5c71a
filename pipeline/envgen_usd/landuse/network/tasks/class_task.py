"""What tasks of filling holes of class maps share, whatever their classes."""

from collections.abc import Sequence
from typing import Any, ClassVar, Generic

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.tasks.network_task import S, Task
from envgen_usd.models.array_types import BoolArray, ByteArray

SMOOTHING = 0.1
"""Softness of the real maps for the critic; a larger value makes them softer."""


class ClassTask(Task[S], Generic[S]):
    """Inputs are one-hot channels, outputs are logits of all channels that are not given.

    Attributes:
        colours: Colour of each input channel; the last colour is for the hole.
    """

    colours: ClassVar[NDArray[np.uint8]]

    def truth(self, windows: Sequence[S]) -> Tensor:
        """Channels of the cells."""
        return torch.from_numpy(np.stack([self.channels(window) for window in windows])).long()

    def channels(self, window: S) -> ByteArray:
        """Channels of a window, H x W."""
        channels: ByteArray = window.channels  # type: ignore[attr-defined]
        return channels

    def road(self, window: S) -> BoolArray:
        """Cells that are given."""
        given: BoolArray = self.channels(window) < self.given
        return given

    def encode(self, truth: Tensor) -> Tensor:
        """One-hot."""
        count, *size = truth.shape
        nothing = torch.zeros(count, self.inputs, *size, device=truth.device)
        return nothing.scatter_(1, truth.long()[:, None], 1.0)

    def decode(self, output: Tensor) -> Tensor:
        """The most likely channels; never given ones."""
        # A third of the time of ``argmax`` over channels on the CPU.
        return output.max(1).indices + self.given

    def composite(self, output: Tensor, known: Tensor, mask: Tensor) -> Tensor:
        """Probabilities of every channel: known in known cells, generated in the hole."""
        generated = F.pad(output.float().softmax(1), (0, 0, 0, 0, self.given, 0))
        return known * mask + generated * (1 - mask)

    def loss(self, output: Tensor, truth: Tensor, mask: Tensor, smoothing: float) -> Tensor:
        """Cross-entropy with label smoothing; what is given does not count."""
        target = (truth - self.given).clamp(min=0)
        each = F.cross_entropy(output.float(), target, reduction="none", label_smoothing=smoothing)
        hole = 1 - mask[:, 0]
        return (each * hole).sum((1, 2)) / hole.sum((1, 2)).clamp(min=1)

    def real(self, known: Tensor) -> Tensor:
        """Softened one-hot, so that softness alone does not reveal generated cells."""
        return known * (1 - SMOOTHING) + SMOOTHING / self.inputs

    def picture(self, values: NDArray[Any], known: BoolArray | None = None) -> ByteArray:
        """A colour for each channel."""
        hole = len(self.colours) - 1
        picture: ByteArray = self.colours[
            values if known is None else np.where(known, values, hole)
        ]
        return picture
